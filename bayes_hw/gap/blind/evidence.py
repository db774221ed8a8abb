"""What the scoring reads: the truth of every case and the verdict on it, checked to be unchanged."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.files import read_small_text
from bayes_hw.gap.answer.verdict import NOISE_SIGMA
from bayes_hw.gap.blind.folders import (
    CASES,
    ORIGIN,
    TRUTH,
    case_folders,
    file_digest,
    folder_digest,
    read_seal,
    read_truth,
)
from bayes_hw.gap.blind.run import (
    PREDICTION,
    SCHEMA,
    VERDICT,
    VERDICTS,
    case_digest,
    run_digest,
    verdict_digest,
)
from bayes_hw.gap.joint.decision.joint_decision import PART_OF_G


@dataclass(frozen=True, eq=False)
class CaseTruth:
    """What a case really carries; `holdout` is its noise-free hold-out, shape (samples,)."""

    name: str
    effects: tuple[str, ...]
    detail: tuple[str, ...]
    gap_over_sigma: tuple[float, ...]
    base: Mapping[str, float]
    correlation: float
    holdout: FloatArray

    @property
    def kind(self) -> str:
        """none, single, pair or other."""
        if not self.effects:
            return "none"
        if "other" in self.effects:
            return "other"
        return "single" if len(self.effects) == 1 else "pair"


@dataclass(frozen=True, eq=False)
class CaseVerdict:
    """What the diagnosis said of a case.

    `share` is the probability of every block, `before` and `after` (samples,) are its predictions of the
    hold-out; `failed` that it gave no verdict.
    """

    answer: tuple[str, ...]
    probability: Mapping[str, float]
    block: str = ""
    share: Mapping[str, float] = field(default_factory=dict)
    confusable: tuple[frozenset[str], ...] = ()
    closed: float = float("nan")
    closed_interval: tuple[float, float] = (float("nan"), float("nan"))
    base: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    before: FloatArray | None = None
    after: FloatArray | None = None
    seconds: float = float("nan")
    failed: bool = False
    white_choice: tuple[str, ...] = ()


KEYS = ("sha256", "verdicts_sha256", "truth_is_open", "seal", "cases", "failed", "diagnosis")
"""Of verdicts.json, that are read."""

FAILED = CaseVerdict(("no verdict",), {}, failed=True)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Truths and verdicts of the same cases, in order, and how the check was kept honest."""

    truths: tuple[CaseTruth, ...]
    verdicts: tuple[CaseVerdict, ...]
    seal: str
    verdicts_sha256: str
    diagnosis: str


def read_evidence(
    folder: Path,
    verdicts: Path,
    practice: bool = False,
    seal: str | None = None,
    run_sha256: str | None = None,
) -> Evidence:
    """Open the truth of a set and the verdicts on it.

    Raises InputError when the seal is not the one in seal.json (or `seal`, as printed by make), when cases,
    truth or verdicts have changed since the run (or are not those of `run_sha256`, as printed by run), when
    the verdicts are those of another set, or of a run that may have seen the truth. With `practice` the truth
    lies open in DIR/truth and there is no seal to check. Of a run that was given no model, more delay and a
    further mode are no gap: a G that is inferred from the records has them, and the truth is read so.
    """
    run = _read_run(verdicts)
    changed = run["verdicts_sha256"] != verdict_digest(verdicts) or run["sha256"] != run_digest(run)
    if changed or run_sha256 not in (None, run["sha256"]):
        raise InputError(f"{verdicts}: the verdicts have changed since the run; run it again in a new folder")
    if run["truth_is_open"] and not practice:
        raise InputError(f"{verdicts}: the run was let see the truth; score it with --practice")
    files = _open_truth(folder) if practice else _unseal(folder, run, seal)
    cases = case_folders(folder if practice else folder / CASES)
    if {case.name: case_digest(case) for case in cases} != run["cases"]:
        raise InputError(f"{verdicts}: the verdicts are those of other cases than {folder} holds")
    names = [case.name for case in cases]
    truths = [_truth(name, files) for name in names]
    if run.get("from_records", False):
        truths = [without_part_of_g(truth) for truth in truths]
    return Evidence(
        tuple(truths),
        tuple(FAILED if name in run["failed"] else read_verdict(verdicts / name) for name in names),
        "" if practice else file_digest(folder / TRUTH),
        run["sha256"],
        run["diagnosis"],
    )


def without_part_of_g(truth: CaseTruth) -> CaseTruth:
    """The truth as it is where no model was given (see `PART_OF_G`)."""
    kept = [i for i, label in enumerate(truth.effects) if label not in PART_OF_G]
    return replace(
        truth,
        effects=tuple(truth.effects[i] for i in kept),
        detail=tuple(truth.detail[i] for i in kept),
        gap_over_sigma=tuple(truth.gap_over_sigma[i] for i in kept),
    )


def read_verdict(folder: Path) -> CaseVerdict:
    """verdict.json and holdout_prediction.csv; raises InputError when a key of the format is missing."""
    path = folder / VERDICT
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        table = list(csv.DictReader(io.StringIO((folder / PREDICTION).read_text(encoding="utf-8"))))
        holdout = content["gap"]["holdout"]
        low, high = holdout["closed_hdi94"]
        return CaseVerdict(
            answer=tuple(content["answer"]),
            probability={str(k): float(v) for k, v in content["probability"].items()},
            block=str(content["where"]["block"]),
            share={str(k): float(v) for k, v in content["where"].get("share", {}).items()},
            confusable=tuple(frozenset(pair) for pair in content["confusable"]),
            closed=_number(holdout["closed"]),
            closed_interval=(_number(low), _number(high)),
            base={name: (float(b["hdi94"][0]), float(b["hdi94"][1])) for name, b in content["base"].items()},
            before=np.array([float(row["before"]) for row in table]),
            after=np.array([float(row["after"]) for row in table]),
            seconds=float(content["seconds"]),
            white_choice=tuple(content.get("white_choice", ())),
        )
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror})") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: is not a verdict in the fixed format ({error!r})") from None


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _read_run(verdicts: Path) -> dict[str, Any]:
    path = verdicts / VERDICTS
    try:
        content = json.loads(read_small_text(path))
    except OSError:
        raise InputError(
            f"{path}: no such file; give the --out folder of a finished bayes-hw blind run"
        ) from None
    except (ValueError, RecursionError):
        raise InputError(f"{path}: is damaged; run the diagnosis again") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA or not set(KEYS) <= set(content):
        raise InputError(f"{path}: is not a list of verdicts of this version; run the diagnosis again")
    return content


def _unseal(folder: Path, run: Mapping[str, Any], seal: str | None) -> dict[str, str]:
    stated = read_seal(folder)
    found = file_digest(folder / TRUTH)
    for name, expected in (
        ("seal.json", stated["sha256"]),
        ("the run", run["seal"]),
        ("--seal", seal or found),
    ):
        if found != expected:
            raise InputError(f"{folder / TRUTH}: its SHA-256 is not that of {name}; the truth has changed")
    files = read_truth(folder / TRUTH)
    try:
        sealed = json.loads(files[ORIGIN])["cases_sha256"]
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{folder / TRUTH}: does not say which cases it is of; make the set again") from None
    if folder_digest(folder / CASES) != sealed:
        raise InputError(f"{folder / CASES}: the cases have changed since they were sealed")
    return files


def _open_truth(folder: Path) -> dict[str, str]:
    truth = folder / "truth"
    if not truth.is_dir():
        raise InputError(f"{truth}: no such folder; --practice needs the truth beside the cases")
    return {path.name: path.read_text(encoding="utf-8") for path in truth.iterdir() if path.is_file()}


def _truth(name: str, files: Mapping[str, str]) -> CaseTruth:
    try:
        content = json.loads(files[f"{name}.json"])
        base = {key: float(value) for key, value in content["base"].items()}
        if "sigma" in base:
            base[NOISE_SIGMA] = base.pop("sigma")
        return CaseTruth(
            name=name,
            effects=tuple(content["effects"]),
            detail=tuple(content.get("form", content["detail"])),
            gap_over_sigma=tuple(float(g) for g in content["gap_over_sigma"]),
            base=base,
            correlation=float(content.get("rho", 0.0)),
            holdout=np.array([float(line) for line in files[f"{name}_holdout.csv"].split()]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"the truth of {name} is missing or damaged ({error!r})") from None
