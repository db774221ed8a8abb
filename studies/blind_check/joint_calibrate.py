"""Fitting the probabilities of joint diagnoses, from records alone or around a given model, on cases whose
truth is known.

The score is the mean logarithm of the probability stated for every label, present or absent (proper, so that
best is what is calibrated). Answers are left as they are: every constant here says how sure they are. Each is
held near its value by hand by a normal prior on its logarithm, and the best is sought one after another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.decision.given_decision import GivenCalibration, GivenEvidence, decide_given
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import PART_OF_G, JointEvidence, decide

PRIOR_SD = 1.2
FACTORS = np.exp(np.linspace(-1.6, 1.6, 17))
ROUNDS = 4
LEAST = 1e-4
LARGEST = 0.9
"""Of constants that are probabilities or shares."""

UNBOUNDED = ("nats", "times", "colour")
"""What the names of other constants begin with."""

STATED_GIVEN = (*LABEL_BLOCKS, "other", "none")
STATED = tuple(label for label in STATED_GIVEN if label not in PART_OF_G)

Constants = TypeVar("Constants", bound=JointCalibration)
Taken = TypeVar("Taken", contravariant=True)


class Scored(Protocol[Taken]):
    """A case whose statements are scored by constants."""

    def score(self, calibration: Taken, /) -> float:
        """Sum over labels of the logarithms of what is stated for what is so."""


def log_score(stated: Mapping[str, float], effects: Sequence[str], labels: Sequence[str]) -> float:
    """Sum over `labels` of the logarithms of what is stated for what is so."""
    present = set(effects) or {"none"}
    chances = np.array([stated[x] if x in present else 1 - stated[x] for x in labels])
    return float(np.sum(np.log(np.clip(chances, LEAST, 1.0))))


@dataclass(frozen=True)
class JointCase:
    """Evidence on a case and the labels that it carries, those that are part of G left out."""

    evidence: JointEvidence
    effects: tuple[str, ...]

    def score(self, calibration: JointCalibration) -> float:
        """Sum over labels of the logarithms of what is stated for what is so."""
        return log_score(decide(self.evidence, calibration).probability, self.effects, STATED)


@dataclass(frozen=True)
class GivenCase:
    """Evidence on a case around its model and the labels that it carries."""

    evidence: GivenEvidence
    effects: tuple[str, ...]

    def score(self, calibration: GivenCalibration) -> float:
        """Sum over labels of the logarithms of what is stated for what is so."""
        return log_score(decide_given(self.evidence, calibration).probability, self.effects, STATED_GIVEN)


def calibrate_jointly(cases: Sequence[Scored[Constants]], by_hand: Constants) -> Constants:
    """The constants of the best score with their prior."""
    best = by_hand
    reached = _value(cases, best, by_hand)
    for _ in range(ROUNDS):
        before = reached
        for name in asdict(best):
            for candidate in _moved(best, name):
                if (new := _value(cases, candidate, by_hand)) > reached + 1e-9:
                    best, reached = candidate, new
        if reached - before < 1e-3:
            break
    return best


def log_deviations(
    cases: Sequence[Scored[Constants]], fitted: Constants, by_hand: Constants
) -> dict[str, float]:
    """Posterior standard deviation of every constant's logarithm, the others as fitted."""
    found = {}
    for name, constant in asdict(fitted).items():
        candidates = _moved(fitted, name)
        logs = np.log([getattr(candidate, name) / constant for candidate in candidates])
        values = np.array([_value(cases, candidate, by_hand) for candidate in candidates])
        chance = np.exp(values - values.max())
        chance /= chance.sum()
        found[name] = float(np.sqrt(chance @ logs**2 - (chance @ logs) ** 2))
    return found


def _moved(calibration: Constants, name: str) -> list[Constants]:
    """With one constant times each of FACTORS."""
    tried = getattr(calibration, name) * FACTORS
    if not name.startswith(UNBOUNDED):
        tried = np.minimum(tried, LARGEST)
    return [replace(calibration, **{name: float(x)}) for x in tried]


def _value(cases: Sequence[Scored[Constants]], candidate: Constants, by_hand: Constants) -> float:
    moved = [np.log(x / y) for x, y in zip(_constants(candidate), _constants(by_hand), strict=True)]
    prior = -0.5 * float(np.sum(np.square(moved))) / PRIOR_SD**2
    return sum(case.score(candidate) for case in cases) + prior


def left_out_scores(cases: Sequence[Scored[Constants]], by_hand: Constants, folds: int = 5) -> FloatArray:
    """Score (cases,) of every case by constants that were fitted without its fold."""
    fold = np.arange(len(cases)) % folds
    found = np.empty(len(cases))
    for left in range(folds):
        fitted = calibrate_jointly([c for c, f in zip(cases, fold, strict=True) if f != left], by_hand)
        for i in (int(i) for i in np.flatnonzero(fold == left)):
            found[i] = cases[i].score(fitted)
    return found


def _constants(calibration: JointCalibration) -> list[float]:
    return [float(value) for value in asdict(calibration).values()]
