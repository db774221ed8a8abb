"""The answer around a given model: as from records alone, and `other` where more is left than its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import (
    LARGEST,
    MOST_NAMED,
    JointDecision,
    JointEvidence,
    decide,
)
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.remainder import COLOURED_NATS
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.identify.holes import with_holes


@dataclass(frozen=True)
class GivenCalibration(JointCalibration):
    """Those around a model: G as given cannot take up an effect, so they are not those of records alone.
    `excess_doubt` is the doubt of `other` where more is left than the noise that the model states: from
    `times_too_much` of it on (it is stated to 12 %), from `times_too_much_coloured` where what is left is of
    higher order, as no right explanation leaves it. A label that leaves more than the share `most_left` of
    the base's residual is not certain there.
    """

    FILE: ClassVar[str] = "given_calibration.json"

    excess_doubt: float
    times_too_much: float
    times_too_much_coloured: float
    most_left: float


RANDOM = ("wind", "timing_jitter", "outliers", "encoder_quantization", "sensor_drift")
"""Labels whose effect stays in the residual."""


@dataclass(frozen=True)
class GivenEvidence:
    """What the decision rests on, as plain numbers: the evidence of the search; root mean squares of the
    residuals after and before it and the noise that the model states (NaN where it states none), all in
    output units."""

    joint: JointEvidence
    left: float
    before: float
    noise: float

    @classmethod
    def of(cls, found: JointAnswer, noise: float) -> GivenEvidence:
        """Of a finished search around a model."""
        return cls(JointEvidence.of(found), residual_rms(found.fit), residual_rms(found.base), noise)

    def to_dict(self) -> dict[str, Any]:
        """For a file; a noise that is not stated is null, errors of what cannot be simulated at all are the
        largest number."""
        noise = None if np.isnan(self.noise) else self.noise
        left, before = (min(each, LARGEST) for each in (self.left, self.before))
        return {"joint": self.joint.to_dict(), "left": left, "before": before, "noise": noise}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> GivenEvidence:
        """As `to_dict` gives it."""
        noise = np.nan if content["noise"] is None else float(content["noise"])
        joint = JointEvidence.from_dict(content["joint"])
        return cls(joint, float(content["left"]), float(content["before"]), noise)


def decide_given(found: GivenEvidence, calibration: GivenCalibration | None = None) -> JointDecision:
    """The answer, and its probabilities by the constants of `calibration` (built in unless given)."""
    calibration = calibration or GivenCalibration.built_in()
    evidence = found.joint
    decided = decide(evidence, calibration, part_of_g=())
    coloured = evidence.remainder.coloured > COLOURED_NATS
    too_much = calibration.times_too_much_coloured if coloured else calibration.times_too_much
    if (
        not found.left > too_much * found.noise
        or OTHER in decided.answer
        or set(decided.answer) & set(RANDOM)
    ):
        return decided
    certain = [label for label in decided.answer if label in evidence.nats]
    if found.left > calibration.most_left * found.before:
        certain = []
    if sum(evidence.nats[label] > evidence.remainder.coloured for label in certain) == MOST_NAMED:
        # Two labels that each explain more than what is left are the answer, inexact as their forms are.
        return decided
    answer = (*certain[:1], OTHER)
    probability = {
        label: p if label in answer else min(p, calibration.beside_other)
        for label, p in decided.probability.items()
    }
    probability["none"] = min(probability["none"], calibration.excess_doubt)
    probability[OTHER] = 1 - calibration.excess_doubt
    return replace(decided, answer=answer, probability=probability, confusable=())


def residual_rms(fit: JointFit) -> float:
    """Root mean square of the residuals of a simulation without weights, output units."""
    errors = [
        with_holes(
            record.y - level - fit.response.simulate(fit.values, record.u, record.known).y, record.measured
        )
        for record, level in zip(fit.response.records, fit.levels, strict=True)
    ]
    return float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2)))
