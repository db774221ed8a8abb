"""Fitting the probabilities of diagnoses from records alone on cases whose truth is known.

The score is the mean logarithm of the probability stated for every label, present or absent (proper, so that
best is what is calibrated). Answers are left as they are: every constant here says how sure they are. Each is
held near its value by hand by a normal prior on its logarithm, and the best is sought one after another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS
from bayes_hw.gap.joint.joint_calibration import JointCalibration
from bayes_hw.gap.joint.joint_decision import PART_OF_G, decide
from bayes_hw.gap.joint.joint_evidence import JointEvidence

PRIOR_SD = 1.2
FACTORS = np.exp(np.linspace(-1.6, 1.6, 17))
ROUNDS = 4
LEAST = 1e-4
LARGEST = 0.9
"""Of constants that are probabilities."""

STATED = (*(label for label in LABEL_BLOCKS if label not in PART_OF_G), "other", "none")


@dataclass(frozen=True)
class JointCase:
    """Evidence on a case and the labels that it carries, those that are part of G left out."""

    evidence: JointEvidence
    effects: tuple[str, ...]

    def score(self, calibration: JointCalibration) -> float:
        """Sum over labels of the logarithms of what is stated for what is so."""
        stated = decide(self.evidence, calibration).probability
        present = set(self.effects) or {"none"}
        chances = np.array([stated[x] if x in present else 1 - stated[x] for x in STATED])
        return float(np.sum(np.log(np.clip(chances, LEAST, 1.0))))


def calibrate_jointly(
    cases: Sequence[JointCase], by_hand: JointCalibration | None = None
) -> JointCalibration:
    """The constants of the best score with their prior."""
    start = best = by_hand or JointCalibration.built_in()

    def value(candidate: JointCalibration) -> float:
        moved = [np.log(x / y) for x, y in zip(_constants(candidate), _constants(start), strict=True)]
        prior = -0.5 * float(np.sum(np.square(moved))) / PRIOR_SD**2
        return sum(case.score(candidate) for case in cases) + prior

    reached = value(best)
    for _ in range(ROUNDS):
        before = reached
        for name, constant in asdict(best).items():
            for factor in FACTORS:
                tried = float(constant * factor)
                if name != "nats_of_doubt":
                    tried = min(tried, LARGEST)
                candidate = replace(best, **{name: tried})
                if (new := value(candidate)) > reached + 1e-9:
                    best, reached = candidate, new
        if reached - before < 1e-3:
            break
    return best


def left_out_scores(cases: Sequence[JointCase], folds: int = 5) -> FloatArray:
    """Score (cases,) of every case by constants that were fitted without its fold."""
    fold = np.arange(len(cases)) % folds
    found = np.empty(len(cases))
    for left in range(folds):
        fitted = calibrate_jointly([c for c, f in zip(cases, fold, strict=True) if f != left])
        for i in (int(i) for i in np.flatnonzero(fold == left)):
            found[i] = cases[i].score(fitted)
    return found


def _constants(calibration: JointCalibration) -> list[float]:
    return [float(value) for value in asdict(calibration).values()]
