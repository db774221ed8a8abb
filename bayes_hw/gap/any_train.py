"""Diagnosis around a given model whatever its drive train: read back from G where that is possible, through
ports on G's poles where it is not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayes_hw.gap import diagnosis
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis, diagnose_records
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Start
from bayes_hw.progress import Progress


def needs_ports(model: HammersteinWiener) -> bool:
    """Whether G is not that of the drive train that can be read back, and answers behind a delay."""
    linear = model.linear
    behind = len(linear.poles) > len(linear.zeros) or linear.delay_samples > 0
    return behind and ChainBuilder(model).reference is None


def diagnose_by_ports(
    case: Case,
    rng: np.random.Generator,
    *,
    notes: Sequence[str] = (),
    progress: Progress | None = None,
    start: Start = "auto",
    within_s: float = float("inf"),
) -> JointDiagnosis:
    """Diagnose a case around its model without any drive train; raises InputError on a direct path."""
    return diagnose_records(
        case.train,
        case.holdout,
        rng,
        name=case.name,
        notes=notes,
        progress=progress,
        model=case.model,
        start=start,
        within_s=within_s,
    )


def diagnose_any_case(
    folder: Path,
    out: Path,
    seed: int,
    *,
    jobs: int = 1,
    without: str = "",
    calibration: Calibration | None = None,
    within_s: float = float("inf"),
) -> Diagnosis | JointDiagnosis:
    """Diagnose the case in `folder`, results to `out`; with labels struck and the search cut short as
    `diagnose_case` does."""
    case = Case.read(folder)
    if without or not needs_ports(case.model):
        return diagnosis.diagnose_case(
            folder, out, seed, jobs=jobs, without=without, calibration=calibration, within_s=within_s
        )
    return _through_ports(case, out, seed, within_s)


def diagnose_case_by_ports(
    folder: Path, out: Path, seed: int, within_s: float = float("inf")
) -> JointDiagnosis:
    """As `diagnose_any_case`, through ports even where the drive train can be read back."""
    return _through_ports(Case.read(folder), out, seed, within_s)


def _through_ports(case: Case, out: Path, seed: int, within_s: float) -> JointDiagnosis:
    found = diagnose_by_ports(case, np.random.default_rng(seed), within_s=within_s)
    found.write(out)
    return found
