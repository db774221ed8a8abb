"""Fits of ripple begun at the measured position and led from there to the simulated one.

Where the simulated axis is part of a period off, it meets another torque, so that the likelihood of a short
period is rugged. With the ripple at the measured position it is nearly that of a linear model; its minimum is
followed as the ripple moves to the simulated position in steps (continuation: Allgower and Georg,
doi 10.1137/1.9780898719154).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scipy.ndimage import gaussian_filter1d

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.simulate.builder import KnownPositions

EVEN = (1.0, 1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1)
CLOSING_IN = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.04, 0.02)
PATHS = (EVEN, CLOSING_IN, EVEN, CLOSING_IN)
"""Shares of the measured position, round by round: near the end the minimum may turn sharply, and where one
path loses it, the other may not."""

ITERATIONS = 3
LAST_ITERATIONS = 10
"""Of a step, and of the fit with the ripple at the simulated position that they end in."""

WORTH_ANOTHER = 0.98
"""Of the cost before, below which another round is tried."""

SMOOTHING = 1.0
"""Samples; standard deviation of the weights that take the noise out of the measured position."""


def measured_positions(at: Fit) -> list[FloatArray]:
    """w (samples,) of every record: simulated, and the smooth part of what the encoder shows beside it."""
    simulated, _ = at.hypothesis.motion(at.values)
    return [w + gaussian_filter1d(e, SMOOTHING) for w, e in zip(simulated, at.residuals, strict=True)]


def can_be_led(hypothesis: Hypothesis) -> bool:
    """Whether a torque depends on the position of a drive train: users' simulators take no other position."""
    return hypothesis.builder.has_drive_train and any(effect.ripples for effect in hypothesis.effects)


def led(
    hypothesis: Hypothesis,
    start: FloatArray,
    positions: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    whitener: Whitener,
) -> Fit:
    """The fit begun at coordinates `start` (parameters,) whose ripple, first at the measured `positions`
    (samples,), a record each, is led to the simulated ones, and again from where that ended, while it gains.
    """
    best = _led_once(hypothesis, start, positions, measured, whitener, PATHS[0])
    for path in PATHS[1:]:
        found = _led_once(hypothesis, best.coordinates, measured_positions(best), measured, whitener, path)
        gained = found.cost < WORTH_ANOTHER * best.cost
        best = min(best, found, key=lambda f: f.cost)
        if not gained:
            break
    return best


def _led_once(
    hypothesis: Hypothesis,
    start: FloatArray,
    positions: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    whitener: Whitener,
    path: Sequence[float],
) -> Fit:
    """The smooth error that every step leaves corrects the positions for the next."""
    for share in path:
        known = KnownPositions(positions, share)
        at = fit(replace(hypothesis, known=known), measured, start, whitener, ITERATIONS)
        start, positions = at.coordinates, measured_positions(at)
    return fit(hypothesis, measured, start, whitener, LAST_ITERATIONS)
