"""Diagnosis around a given model whatever its drive train: read back from G where that is possible, through
ports on G's poles where it is not, or where what the train allows leaves doubt or what has no name."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bayes_hw.gap import diagnosis
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.joint.answer.advice import Drive
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis, diagnose_records
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Start
from bayes_hw.progress import Progress

NOT_READ = "no drive train was read back from the model's G"
ASKED_AGAIN = (
    "with the drive train read back from the model's G the gap was not explained for certain: the answer was "
    "found without it"
)
"""Said of why ports were asked."""


def has_ports(model: HammersteinWiener) -> bool:
    """Whether G answers behind a delay, so that torques can enter through its poles."""
    linear = model.linear
    return len(linear.poles) > len(linear.zeros) or linear.delay_samples > 0


def needs_ports(model: HammersteinWiener) -> bool:
    """Whether G is not that of the drive train that can be read back, and answers behind a delay."""
    return has_ports(model) and ChainBuilder(model).reference is None


def diagnose_around(
    case: Case,
    rng: np.random.Generator,
    *,
    jobs: int = 1,
    without: frozenset[str] = frozenset(),
    calibration: Calibration | None = None,
    progress: Progress | None = None,
    start: Start = "auto",
    drive: Drive | None = None,
    within_s: float = float("inf"),
) -> Diagnosis | JointDiagnosis:
    """Diagnose a case around its model; labels `without` are struck from the catalogue, as ports cannot.

    What is known of the `drive`, and the `start` of records held out, concern what is found through ports.
    """
    through_ports = partial(
        diagnose_records,
        case.train,
        case.holdout,
        rng,
        name=case.name,
        progress=progress,
        drive=drive,
        model=case.model,
        start=start,
        jobs=jobs,
    )
    if not without and needs_ports(case.model):
        return through_ports(notes=(NOT_READ,), within_s=within_s)
    calibration = calibration or Calibration.built_in()
    by_train = diagnosis.diagnose(
        case,
        rng,
        jobs=jobs,
        without=without,
        calibration=calibration,
        progress=progress,
        within_s=within_s,
    )
    left_s = within_s - by_train.verdict.seconds
    has_name = OTHER not in by_train.verdict.answer
    stands = has_name and by_train.verdict.certainty >= calibration.sure_enough
    if stands or without or left_s <= 0 or not has_ports(case.model):
        return by_train
    if progress is not None:
        progress.say("nothing explains it for certain: asked again through ports on the poles of G")
    by_ports = through_ports(notes=(ASKED_AGAIN,), within_s=left_s)
    return _better(by_train, by_ports, calibration.sure_enough)


def _better(by_train: Diagnosis, by_ports: JointDiagnosis, sure_enough: float) -> Diagnosis | JointDiagnosis:
    """Of a diagnosis in doubt and one through ports that there was time for, with all the seconds of both:
    the second where it is the more certain or names more than the first names, and something where the first
    has no name."""
    first, second = by_train.verdict, by_ports.verdict
    names_nothing = OTHER in first.answer and not set(second.answer) - {OTHER}
    if names_nothing or by_ports.found.cut_short:
        return by_train
    names_more = bool(first.answer) and set(second.answer) > set(first.answer)
    if not names_more and second.certainty <= min(first.certainty, sure_enough):
        return by_train
    return replace(by_ports, verdict=replace(second, seconds=first.seconds + second.seconds))


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
    """Diagnose the case in `folder` and write what `Diagnosis.write` or `JointDiagnosis.write` does to `out`.

    `without` names labels to leave out of the catalogue, joined by commas.
    """
    found = diagnose_around(
        Case.read(folder),
        np.random.default_rng(seed),
        jobs=jobs,
        without=frozenset(without.split(",")) - {""},
        calibration=calibration,
        within_s=within_s,
    )
    found.write(out)
    return found
