"""Making a set of withheld cases from the torque-level plant."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw import __version__
from bayes_hw.errors import InputError
from bayes_hw.executor import Executor, LocalExecutor, ResultFolder
from bayes_hw.files import write_json, write_text_atomically
from bayes_hw.gap.blind.folders import (
    CASES,
    ORIGIN,
    SEAL,
    TRUTH,
    case_name,
    folder_digest,
    write_seal,
    write_truth,
)
from bayes_hw.plant.case import BlindCase, BlindRecord, make_case
from bayes_hw.plant.kinds import KINDS, LABELS
from bayes_hw.progress import Progress

STAGING, UNFINISHED = ".truth", ".unfinished"


@dataclass(frozen=True)
class MakeTask:
    """One case to make: plain data that a worker understands."""

    seed: int
    index: int
    kind: str
    labels: tuple[str, ...] | None
    changes: Mapping[str, Any]
    folder: str


def make_set(
    folder: Path,
    number: int,
    seed: int,
    kind: str = "hard",
    *,
    labels: Sequence[Sequence[str]] | None = None,
    changes: Mapping[str, Any] | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> str:
    """Write `number` cases and their sealed truth; the SHA-256 of the seal.

    `labels` gives the faults of the cases in turn (repeated as often as needed) instead of drawing them;
    `changes` replaces fields of the kind, such as {"durations_s": (60.0,)}. Same arguments, same bytes,
    however many workers; one that was stopped goes on. Raises InputError when the folder holds a set already,
    or for a kind or label that does not exist.
    """
    _check(folder, number, kind, labels)
    tasks = [
        asdict(
            MakeTask(
                seed=seed,
                index=i,
                kind=kind,
                labels=None if labels is None else tuple(labels[i % len(labels)]),
                changes=dict(changes or {}),
                folder=str(folder),
            )
        )
        for i in range(number)
    ]
    identity = json.dumps([__version__, tasks], sort_keys=True)
    (executor or LocalExecutor()).map(
        run_make_task,
        tasks,
        progress=progress,
        label="making blind cases",
        kept=ResultFolder(folder / UNFINISHED, hashlib.sha256(identity.encode()).hexdigest()),
    )
    staging = folder / STAGING
    files = {path.name: path.read_text(encoding="utf-8") for path in sorted(staging.iterdir())}
    cases = folder_digest(folder / CASES)
    origin = {"seed": seed, "kind": kind, "changes": dict(changes or {}), "cases_sha256": cases}
    files[ORIGIN] = json.dumps(origin, indent=1) + "\n"
    seal = write_truth(folder / TRUTH, files)
    shutil.rmtree(staging)
    shutil.rmtree(folder / UNFINISHED)
    write_seal(folder, {"sha256": seal, "number": number})
    return seal


def run_make_task(task: dict[str, Any]) -> int:
    """Make one case in a worker; its index."""
    kind = replace(KINDS[task["kind"]], **task["changes"])
    labels = None if task["labels"] is None else list(task["labels"])
    case = make_case(task["seed"], task["index"], kind, labels)
    folder, name = Path(task["folder"]), case_name(task["index"])
    write_case(case, folder / CASES / name)
    for file, content in truth_files(case, name).items():
        write_text_atomically(folder / STAGING / file, content)
    return int(task["index"])


def write_case(case: BlindCase, folder: Path) -> None:
    """case.json, model.json and the records, as a user would hand them in."""
    description = {
        "model": "model.json",
        "train": [f"{record.name}.csv" for record in case.train],
        "holdout": [f"{case.holdout.name}.csv"],
    }
    model = case.simulator.to_dict("blind axis", case.simulator_sigma)
    write_json(folder / "case.json", description)
    write_json(folder / "model.json", model)
    for record in (*case.train, case.holdout):
        content = _record_text(record, case.simulator.sample_rate_hz)
        write_text_atomically(folder / f"{record.name}.csv", content)


def truth_files(case: BlindCase, name: str) -> dict[str, str]:
    """Name and content of the files of one case in the sealed truth."""
    files = {f"{name}.json": json.dumps(case.truth, indent=1) + "\n"}
    for record in (*case.train, case.holdout):
        files[f"{name}_{record.name}.csv"] = _column_text(record.noise_free)
        if not np.array_equal(record.noise_free, record.without_noise):
            files[f"{name}_{record.name}_shown.csv"] = _column_text(record.without_noise)
    return files


def _record_text(record: BlindRecord, rate: float) -> str:
    time = np.arange(len(record.command)) / rate
    rows = zip(time.tolist(), record.command.tolist(), record.measured.tolist(), strict=True)
    return "t,u,y\n" + "".join(f"{t:.6f},{u:.6f},{y:.8f}\n" for t, u, y in rows)


def _column_text(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    return "".join(f"{value:.8f}\n" for value in values.tolist())


def _check(folder: Path, number: int, kind: str, labels: Sequence[Sequence[str]] | None) -> None:
    if number < 1:
        raise InputError(f"--n {number}: must be one or more")
    if kind not in KINDS:
        raise InputError(f"--kind {kind}: unknown; use one of {', '.join(KINDS)}")
    if (folder / SEAL).exists() or ((folder / CASES).exists() and not (folder / UNFINISHED).exists()):
        raise InputError(f"{folder}: holds a blind set already; give another --out")
    for label in {label for group in labels or () for label in group}:
        if label not in (*LABELS, "other"):
            raise InputError(f"--effects {label}: unknown; use none, other or {', '.join(LABELS)}")


@dataclass(frozen=True)
class OpenCase:
    """What a simulated axis has that its simulator lacks, and how large the gap is in noise sigmas."""

    labels: tuple[str, ...]
    forms: tuple[str, ...]
    gap_over_sigma: tuple[float, ...]
    train: tuple[str, ...]
    holdout: str


def write_open_case(
    folder: Path, seed: int, labels: tuple[str, ...], *, duration_s: float | None = None
) -> OpenCase:
    """Write case.json, model.json, records of an easy plant with these faults, and its truth as truth.json.

    The records last `duration_s` each, or as long as easy cases have them. Same arguments, same files.
    Raises UnreachableGapError where no axis that is drawn can show the faults.
    """
    easy = KINDS["easy"]
    durations = easy.durations_s if duration_s is None else (duration_s,)
    case = make_case(seed, 0, replace(easy, durations_s=durations), labels)
    write_case(case, folder)
    write_json(folder / "truth.json", case.truth)
    truth = case.truth
    return OpenCase(
        labels=labels,
        forms=tuple(truth["form"]),  # type: ignore[arg-type]
        gap_over_sigma=tuple(truth["gap_over_sigma"]),  # type: ignore[arg-type]
        train=tuple(f"{record.name}.csv" for record in case.train),
        holdout=f"{case.holdout.name}.csv",
    )
