"""Diagnosing withheld cases: the diagnosis is given copies of the cases, and nothing else."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bayes_hw import __version__
from bayes_hw.errors import InputError
from bayes_hw.executor import Executor, LocalExecutor, ResultFolder
from bayes_hw.files import read_small_text, write_json
from bayes_hw.gap.blind.folders import (
    CASES,
    SEAL,
    TRUTH,
    case_folders,
    file_digest,
    folder_digest,
    read_seal,
)
from bayes_hw.named_object import named_object
from bayes_hw.progress import Progress

DIAGNOSIS = "bayes_hw.gap.any_train:diagnose_any_case"
FROM_RECORDS = "bayes_hw.gap.blind.joint_ballot:diagnose_from_records"
GIVEN_MODEL = "bayes_hw.gap.blind.joint_ballot:diagnose_given_model"
"""As DIAGNOSIS, and what it rests on kept where the drive train is not read."""

VERDICTS = "verdicts.json"
SCHEMA = "bayes-hw/verdicts/2"
VERDICT, PREDICTION = "verdict.json", "holdout_prediction.csv"
DESCRIPTION = "case.json"
KEPT = "finished"

Diagnosis = Callable[..., None]


@dataclass(frozen=True)
class RunTask:
    """One case to diagnose: plain data that a worker understands."""

    case: str
    out: str
    seed: int
    diagnosis: str
    options: Mapping[str, Any]
    from_records: bool = False


def run_set(
    folder: Path,
    out: Path,
    seed: int = 1,
    *,
    diagnosis: str | None = None,
    options: Mapping[str, Any] | None = None,
    from_records: bool = False,
    truth_is_open: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> str:
    """Diagnose every case of a set; writes OUT/CASE/verdict.json, holdout_prediction.csv, OUT/verdicts.json.

    `diagnosis` is MODULE:FUNCTION, called as function(case folder, out folder, seed, **options). With
    `from_records` the copy that it is given has no model: case.json names records alone. Finished cases are
    kept in OUT, so that a run that was stopped goes on. A case whose diagnosis raises an error is
    kept as one that gave no verdict. Returns the digest of OUT/verdicts.json, which holds that of all
    verdicts.

    Raises InputError when the truth may lie within reach in `folder` (see `withheld_cases`), and when a kept
    verdict is not the one that the diagnosis wrote; with `truth_is_open` a set with its truth (labelled cases
    to practise on) is accepted, and the verdicts say so. Either way the diagnosis sees copies of the case's
    own files in an empty folder.
    """
    folder = set_folder(folder)
    cases = withheld_cases(folder, truth_is_open)
    function = diagnosis or (FROM_RECORDS if from_records else DIAGNOSIS)
    find_diagnosis(function)
    digests = {case.name: case_digest(case) for case in cases}
    given = dict(options or {})
    identity = json.dumps([SCHEMA, __version__, seed, function, given, from_records, digests], sort_keys=True)
    tasks = [
        asdict(RunTask(str(case.resolve()), str(place.resolve()), seed, function, given, from_records))
        for case, place in ((case, out / case.name) for case in cases)
    ]
    outcomes = (executor or LocalExecutor()).map(
        run_one_case,
        tasks,
        progress=progress,
        label="diagnosing blind cases",
        kept=ResultFolder(out / KEPT, hashlib.sha256(identity.encode()).hexdigest()),
    )
    for outcome in outcomes:
        if not outcome["error"] and outcome["written"] != _written(out / outcome["case"]):
            raise InputError(
                f"{out / outcome['case']}: is not what the diagnosis wrote; run the set again elsewhere"
            )
    seal = read_seal(folder)["sha256"] if (folder / SEAL).exists() else None
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "seal": seal,
        "truth_is_open": truth_is_open,
        "cases": digests,
        "verdicts_sha256": verdict_digest(out),
        "seed": seed,
        "diagnosis": function,
        "options": given,
        "from_records": from_records,
        "failed": {o["case"]: o["error"] for o in outcomes if o["error"]},
        "seconds": {o["case"]: o["seconds"] for o in outcomes},
    }
    content["sha256"] = run_digest(content)
    write_json(out / VERDICTS, content)
    return str(content["sha256"])


def set_folder(folder: Path) -> Path:
    """The set that `folder` is, or that it holds the cases of."""
    parent = folder.resolve().parent
    return parent if folder.resolve().name == CASES and (parent / SEAL).is_file() else folder


def withheld_cases(folder: Path, truth_is_open: bool = False) -> list[Path]:
    """The case folders of a set without its truth.

    Raises InputError where anything lies in the set, or a truth beside it, that a blind run is not given:
    that is the case folders with the files that case.json lists, seal.json and the truth that it seals.
    """
    if folder.is_file():
        raise InputError(f"{folder}: is a file; give the folder of the cases, not the truth")
    cases = case_folders(folder / CASES if (folder / CASES).is_dir() else folder)
    if not truth_is_open:
        allowed = {folder, folder / CASES, folder / SEAL, *cases}
        allowed |= {case / name for case in cases for name in case_files(case)}
        allowed |= {path.parent for path in allowed if path.is_relative_to(folder)}
        beside = [path for path in folder.resolve().parent.iterdir() if path.name.lower().startswith("truth")]
        for path in [*sorted(folder.rglob("*")), *sorted(beside)]:
            if path.is_symlink() or (path not in allowed and not _is_sealed(path, folder)):
                raise InputError(
                    f"{path}: the truth lies open, or may lie there; a blind run is given the cases and a "
                    "sealed truth alone (--practice lifts that, and the verdicts say so)"
                )
    return cases


def _is_sealed(path: Path, folder: Path) -> bool:
    """Whether `path` is the truth of the digest that seal.json of the set states."""
    sealed = path == folder / TRUTH and (folder / SEAL).exists()
    return sealed and read_seal(folder)["sha256"] == file_digest(path)


def run_one_case(task: dict[str, Any]) -> dict[str, Any]:
    """Diagnose one case in a worker; its name, seconds, and what went wrong if anything did."""
    case, out = Path(task["case"]), Path(task["out"])
    begin = time.perf_counter()
    if out.exists():
        shutil.rmtree(out)
    out.mkdir(parents=True)
    error = ""
    with tempfile.TemporaryDirectory(prefix="blind-") as empty:
        copied = copy_case(case, Path(empty) / case.name, from_records=task["from_records"])
        try:
            find_diagnosis(task["diagnosis"])(copied, out, task["seed"], **task["options"])
        except Exception as problem:
            error = f"{type(problem).__name__}: {problem}"
    for name in (VERDICT, PREDICTION):
        if not error and not (out / name).is_file():
            error = f"the diagnosis wrote no {name}"
    seconds = round(time.perf_counter() - begin, 3)
    return {"case": case.name, "seconds": seconds, "error": error, "written": _written(out)}


def _written(out: Path) -> dict[str, str]:
    """Digests of the verdict and the prediction, as far as there are any."""
    return {name: file_digest(out / name) for name in (VERDICT, PREDICTION) if (out / name).is_file()}


def copy_case(case: Path, target: Path, *, from_records: bool = False) -> Path:
    """A copy of what case.json lists, and no other file, without the model if `from_records`.

    Raises InputError when case.json is damaged.
    """
    files = case_files(case)
    if from_records:
        description = json.loads(read_small_text(case / DESCRIPTION))
        withheld = description.pop("model")
        files = [name for name in files if name not in (DESCRIPTION, withheld)]
        write_json(target / DESCRIPTION, description)
    for name in files:
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(case / name, target / name)
    return target


def case_files(case: Path) -> list[str]:
    """case.json and the files that it lists; raises InputError when one is not inside the case."""
    path = case / DESCRIPTION
    try:
        content = json.loads(read_small_text(path))
        names = [
            DESCRIPTION,
            str(content["model"]),
            *map(str, content["train"]),
            *map(str, content["holdout"]),
        ]
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"{path}: is not a case description ({error})") from None
    for name in names:
        try:
            inside = (case / name).resolve().is_relative_to(case.resolve()) and (case / name).is_file()
        except (OSError, ValueError):
            inside = False
        if not inside:
            raise InputError(f"{path}: {name!r} is not a file of the case")
    return names


def case_digest(case: Path) -> str:
    """SHA-256 over the names and contents of the case's own files."""
    lines = [f"{name}\0{file_digest(case / name)}\n" for name in sorted(case_files(case))]
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def failures(out: Path) -> dict[str, str]:
    """The cases of a finished run without a verdict, and why."""
    content = json.loads((out / VERDICTS).read_text(encoding="utf-8"))
    return {str(case): str(error) for case, error in content["failed"].items()}


def verdict_digest(out: Path) -> str:
    """SHA-256 over every verdict and prediction below OUT."""
    return folder_digest(out, (VERDICT, PREDICTION))


def run_digest(content: Mapping[str, Any]) -> str:
    """SHA-256 over all of OUT/verdicts.json but this digest and the times taken."""
    rest = {key: value for key, value in content.items() if key not in ("sha256", "seconds")}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def find_diagnosis(name: str) -> Diagnosis:
    """The function MODULE:FUNCTION; raises InputError where there is none."""
    found = named_object(name, "--diagnosis")
    if not callable(found):
        raise InputError(f"--diagnosis {name}: is not a function; give MODULE:FUNCTION")
    function: Diagnosis = found
    return function
