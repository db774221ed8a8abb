"""The encoder's noise as the answer of a search tells it, and how far that may be off."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.decision.joint_decision import JointDecision
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior.joint_closure import DOUBT, MIMICKED, PLAIN_DOUBT, walks
from bayes_hw.gap.joint.search.joint_search import JointAnswer


def encoder_sigma(found: JointAnswer, decision: JointDecision, fit: JointFit) -> float:
    """Standard deviation of the encoder's noise, output units, as far as the fit tells: noise of higher order
    than one is of the motion, but for what is not of its cause."""
    answer = set(decision.answer)
    moves = (
        found.remainder.order > 1
        or "wind" in answer
        or (OTHER in answer and OTHER not in fit.labels)
        or walks(fit, decision.answer)
    )
    sigma = fit.innovation_sigma if moves else fit.point.rms
    if moves and fit.slow is not None:
        sigma = fit.slow.of_readings(sigma)
    readings = found.readings
    if "encoder_quantization" in answer and readings.step is not None and not readings.taken_off:
        sigma = max(float(np.sqrt(max(sigma**2 - readings.step**2 / 12, 0.0))), 0.15 * readings.step)
    return sigma


def noise_doubt(found: JointAnswer, decision: JointDecision) -> float:
    """How far `encoder_sigma` may be off, a share of it: rounding hides noise, unseen motion mimics it, and
    innovations of motion that is followed have a part of it."""
    answer = set(decision.answer)
    if "encoder_quantization" in answer:
        return 0.4
    followed = found.fit.observer is not None
    return DOUBT if followed or found.remainder.order > 1 or answer & set(MIMICKED) else PLAIN_DOUBT
