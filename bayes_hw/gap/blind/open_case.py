"""One case whose truth is told: for a demonstration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from bayes_hw.files import write_json
from bayes_hw.gap.blind.make import write_case
from bayes_hw.plant.case import make_case
from bayes_hw.plant.kinds import KINDS


@dataclass(frozen=True)
class OpenCase:
    """What a simulated axis has that its simulator lacks, and how large the gap is in noise sigmas."""

    labels: tuple[str, ...]
    forms: tuple[str, ...]
    gap_over_sigma: tuple[float, ...]
    train: tuple[str, ...]
    holdout: str


def write_open_case(
    folder: Path, seed: int, labels: tuple[str, ...], *, kind: str = "easy", duration_s: float | None = None
) -> OpenCase:
    """Write case.json, model.json and records of a plant with these faults, and its truth as truth.json.

    The records last `duration_s` each, or as long as the kind of case has them. Same arguments, same files.
    Raises UnreachableGapError where no axis that is drawn can show the faults.
    """
    durations = KINDS[kind].durations_s if duration_s is None else (duration_s,)
    case = make_case(seed, 0, replace(KINDS[kind], durations_s=durations), labels)
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
