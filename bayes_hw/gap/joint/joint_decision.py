"""From the search's nats to an answer with probabilities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS
from bayes_hw.gap.joint.joint_search import JointAnswer
from bayes_hw.gap.judgement import OTHER

CERTAIN = 0.995
NATS_OF_DOUBT = 60.0
"""A label's doubt falls by a factor e with so many verified nats: forms are never exact."""

COLOURED_NATS = 60.0
"""By which an autoregression of higher order must beat one of the first for the noise to count as a cause."""

TORQUE_NATS = 40.0
AS_GOOD = 15.0
GAUSSIAN = 0.6
"""Largest excess kurtosis of the innovations of wind or of an angle that walks: neither jumps."""

COARSE_RATIO = 1.5
"""Root mean square residual over innovations, beside a label, from which something else is said to remain."""

CONFUSABLE_NATS = 15.0
"""Within which a rival label explains the records as well as the one named."""

SMALL = 0.002


@dataclass(frozen=True)
class JointDecision:
    """The answer, its probabilities, pairs that the records cannot tell apart."""

    answer: tuple[str, ...]
    probability: Mapping[str, float]
    confusable: tuple[tuple[str, str], ...]
    coloured: float


def decide_jointly(found: JointAnswer) -> JointDecision:
    """See the constants above."""
    left, spectrum = found.remainder, found.remainder.spectrum
    evidence = dict(found.nats)
    evidence.update(found.readings.nats)
    coloured = spectrum.autoregression - spectrum.first_order if left.order > 1 else 0.0
    rounded = "encoder_quantization" in evidence
    timed = "timing_jitter" in evidence
    remains = 0.0
    if not rounded and not timed:
        slow = spectrum.torque - max(spectrum.first_order, spectrum.white)
        walk = spectrum.walk - max(spectrum.first_order, spectrum.white)
        closest = max(spectrum.autoregression, spectrum.first_order)
        if found.nats and left.ratio < COARSE_RATIO:
            remains = 0.0
        elif (
            walk > TORQUE_NATS
            and spectrum.walk > max(closest - AS_GOOD, spectrum.torque - AS_GOOD)
            and left.kurtosis < GAUSSIAN
        ):
            evidence.setdefault("sensor_drift", walk)
        elif slow > TORQUE_NATS and spectrum.torque > closest - AS_GOOD and left.kurtosis < GAUSSIAN:
            evidence.setdefault("wind", slow)
        elif coloured > COLOURED_NATS or (left.order > 1 and max(slow, walk) > COLOURED_NATS):
            remains = max(coloured, slow, walk)
    sure = {label: _sure(nats) for label, nats in evidence.items()}
    p_other = _sure(remains) if remains > 0 else min(0.05, SMALL + 0.02 * (left.order > 1))
    answer = tuple(sorted(evidence, key=lambda label: -evidence[label]))
    if len(answer) > 2:
        answer = answer[:2]
    if remains > 0:
        answer = (answer[0], OTHER) if answer and found.nats.get(answer[0], np.inf) > remains else (OTHER,)
    probability = dict.fromkeys(LABEL_BLOCKS, 0.0)
    probability.update(sure)
    if answer == (OTHER,):
        probability = {label: min(p, 0.3) for label, p in probability.items()}
    probability["transport_delay"] = probability["unmodelled_mode"] = 0.0
    confusable = confusions(found, answer)
    for named, rival in confusable:
        shared = probability[named]
        probability[named], probability[rival] = 0.6 * shared, max(probability[rival], 0.35 * shared)
    none = float(np.prod([1 - p for p in sure.values()])) * (1 - p_other) if evidence or remains else 0.0
    if not answer:
        best = max(found.rivals.values(), default=-10.0)
        none = float(np.clip(1 - p_other - 0.3 * np.exp(min(best, 0.0) / 10), 0.5, 0.97))
    rest = max(0.0, 1 - none - p_other) if not answer else SMALL * len(LABEL_BLOCKS)
    silent = [
        label
        for label in LABEL_BLOCKS
        if probability[label] == 0.0 and label not in ("transport_delay", "unmodelled_mode")
    ]
    for label in silent:
        probability[label] = rest / max(len(silent), 1)
    probability["none"], probability[OTHER] = none, p_other
    return JointDecision(answer, probability, confusable, coloured)


def confusions(found: JointAnswer, answer: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Of a single effect: rivals whose own best explanation is as good."""
    if len(found.fit.labels) != 1 or len(answer) != 1 or answer[0] not in found.nats:
        return ()
    own = max(found.rivals.get(answer[0], 0.0), found.fit.score - found.base.score)
    return tuple(
        (answer[0], label)
        for label, nats in found.rivals.items()
        if label != answer[0] and nats > own - CONFUSABLE_NATS and nats > 0
    )


def _sure(nats: float) -> float:
    return float(min(CERTAIN, 1 - 0.6 * np.exp(-max(nats, 0.0) / NATS_OF_DOUBT)))
