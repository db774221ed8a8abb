"""A whole blind check in one call, as studies want it: make, run, open."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from bayes_hw.errors import InputError
from bayes_hw.executor import Executor
from bayes_hw.gap.blind.evidence import Evidence, read_evidence
from bayes_hw.gap.blind.folders import ORIGIN, SEAL, TRUTH, read_seal, read_truth
from bayes_hw.gap.blind.make import make_set
from bayes_hw.gap.blind.run import DIAGNOSIS, run_set
from bayes_hw.progress import Progress


def check_blind(
    folder: Path,
    number: int,
    seed: int,
    kind: str,
    *,
    labels: Sequence[Sequence[str]] | None = None,
    changes: Mapping[str, Any] | None = None,
    diagnosis: str = DIAGNOSIS,
    options: Mapping[str, Any] | None = None,
    from_records: bool = False,
    executor: Executor,
    progress: Progress,
) -> Evidence:
    """Make the set in FOLDER/set unless it is there, diagnose it, and open the truth.

    The verdicts are where `verdicts_in` says. A check that was stopped goes on.
    With `from_records` the diagnosis is given no model.
    Raises InputError when FOLDER/set is another set than this one.
    """
    where = folder / "set"
    if not (where / SEAL).exists():
        make_set(
            where, number, seed, kind, labels=labels, changes=changes, executor=executor, progress=progress
        )
    seal = read_seal(where)
    wanted = json.loads(json.dumps([number, seed, kind, dict(changes or {})]))
    origin = json.loads(read_truth(where / TRUTH)[ORIGIN])
    if [seal["number"], origin["seed"], origin["kind"], origin["changes"]] != wanted:
        raise InputError(f"{where}: is another set; remove the folder or give another --out")
    verdicts = verdicts_in(folder, diagnosis, options, from_records=from_records)
    run_set(
        where,
        verdicts,
        seed,
        diagnosis=diagnosis,
        options=options,
        from_records=from_records,
        executor=executor,
        progress=progress,
    )
    return read_evidence(where, verdicts)


def verdicts_in(
    folder: Path,
    diagnosis: str,
    options: Mapping[str, Any] | None = None,
    *,
    from_records: bool = False,
) -> Path:
    """Where `check_blind` writes the verdicts of a diagnosis with these options, a folder for every case."""
    function = diagnosis.rpartition(":")[2]
    given = [f"{k}_{v}" for k, v in (options or {}).items()] + ["from_records"] * from_records
    return folder / "_".join(["verdicts", function, *given])


def joined(parts: Sequence[Evidence], names: Sequence[str] = ()) -> Evidence:
    """Several sets as one: cases in order, seals and digests one after another.

    Where `names` of the sets are given, every case is called by its set and its own name.
    """
    prefixes = [f"{name} " for name in names] or [""] * len(parts)
    return Evidence(
        tuple(
            replace(truth, name=prefix + truth.name)
            for prefix, part in zip(prefixes, parts, strict=True)
            for truth in part.truths
        ),
        tuple(verdict for part in parts for verdict in part.verdicts),
        " ".join(part.seal for part in parts if part.seal),
        " ".join(part.verdicts_sha256 for part in parts),
        parts[0].diagnosis,
    )
