"""Where the error of the best model without effects lies: block, band, regime and time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.locate import Location
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.decision.joint_decision import JointDecision
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.gap.joint.search.known_input import BLOCKS
from bayes_hw.identify.holes import with_holes, without_holes
from bayes_hw.record import Record

SEGMENTS = 12
UNNAMED_SHARES = {"drive": 0.4, "disturbance": 0.6}
"""What is without a name lies in these blocks."""


FEWEST_SAMPLES = 20
"""Of a regime that is told of."""


def location_of(
    train: Sequence[Record], found: JointAnswer, decision: JointDecision, sigma: float
) -> Location:
    """Block, band and regime of the error of the best model without effects, for noise `sigma`."""
    base = found.bare
    predicted = [base.response.simulate(base.values, r.u, r.known).y for r in train]
    errors = [with_holes(r.y - y, r.measured) for r, y in zip(train, predicted, strict=True)]
    residuals = [without_holes(e) for e in errors]
    share = _shares(decision)
    regimes = _regimes(base, train, residuals, sigma)
    return Location(
        _block(found, decision, share),
        share,
        _band(residuals, train[0].sample_rate_hz),
        max(regimes, key=lambda r: regimes[r]),
        regimes,
        {},
        _segments(residuals, sigma),
    )


def _shares(decision: JointDecision) -> dict[str, float]:
    """Of every block, by the probabilities of its labels; what has no name is a torque rather than not."""
    share: dict[str, float] = dict.fromkeys(("input", "linear", "drive", "disturbance", "sensor"), 0.0)
    for label, home in LABEL_BLOCKS.items():
        share[home] += decision.probability.get(label, 0.0)
    for block, part in UNNAMED_SHARES.items():
        share[block] += part * decision.probability[OTHER]
    total = max(sum(share.values()), 1.0)
    return {home: value / total for home, value in share.items()}


def _block(found: JointAnswer, decision: JointDecision, share: dict[str, float]) -> str:
    named = [label for label in decision.answer if label != OTHER]
    if named:
        return str(LABEL_BLOCKS[named[0]])
    if decision.answer:
        return max(share, key=lambda b: share[b])
    followed = [one for one in found.known if one.accepted]
    return BLOCKS[followed[0].way] if followed else "none"


def _band(residuals: Sequence[FloatArray], rate_hz: float) -> tuple[float, float]:
    """Frequencies, Hz, between which the middle 80 % of what exceeds the median of the spectrum lies."""
    spectra = [welch(e, rate_hz, nperseg=min(512, len(e)))[1] for e in residuals]
    frequency = welch(residuals[0], rate_hz, nperseg=min(512, min(len(e) for e in residuals)))[0]
    power = np.mean([s[: len(frequency)] for s in spectra], axis=0)
    excess = np.cumsum(np.maximum(power - np.median(power), 0.0)[1:])
    if excess[-1] > 0:
        inside = frequency[1:][(excess / excess[-1] > 0.1) & (excess / excess[-1] <= 0.9)]
        if len(inside):
            return float(inside[0]), float(inside[-1])
    return float(frequency[1]), float(frequency[-1])


def _segments(residuals: Sequence[FloatArray], sigma: float) -> tuple[float, ...]:
    """Root mean square error in every part of the records, over sigma."""
    parts = [np.array_split(e, SEGMENTS) for e in residuals]
    return tuple(
        float(np.sqrt(np.mean(np.concatenate([part[i] for part in parts]) ** 2)) / sigma)
        for i in range(SEGMENTS)
    )


def _regimes(
    base: JointFit, train: Sequence[Record], residuals: Sequence[FloatArray], sigma: float
) -> dict[str, float]:
    """Mean square error over the noise's in every regime of the motion."""
    values, e = base.values, np.concatenate(list(residuals))
    runs = [base.response.simulate(values, record.u, record.known) for record in train]
    speed = np.concatenate([np.gradient(run.w) for run in runs])
    v = np.concatenate([run.v for run in runs])
    usual = float(np.sqrt(np.mean(speed**2)))
    turning = np.concatenate([[False], speed[1:] * speed[:-1] < 0])
    masks = {
        "all": np.ones(len(e), dtype=bool),
        "saturated": (v <= values.cascade.lower) | (v >= values.cascade.upper),
        "slow": np.abs(speed) < 0.1 * usual,
        "reversing": np.convolve(turning, np.ones(10), "full")[: len(e)] > 0,
    }
    return {n: float(np.mean(e[m] ** 2) / sigma**2) for n, m in masks.items() if m.sum() >= FEWEST_SAMPLES}
