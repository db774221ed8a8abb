"""What the intervals leave to the designer: where notches must reach, and how high a crossover may lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Requirements, loop_margins
from bayes_hw.control.notch import Notch

CROSSOVER_POINTS = 28
LOWEST_SHARE, HIGHEST_SHARE = 2e-3, 0.3
"""Range of crossovers of the nominal axis that are tried, as shares of the sample rate."""

BISECTIONS = 8
NOTCH_DEPTH_DB = 10.0
LOW_PASS_SHARE = 0.2
"""Corner of the low pass that is tried, as a share of the sample rate."""


@dataclass(frozen=True)
class NotchRange:
    """Where a notch for one resonance must reach.

    `lower_hz` to `upper_hz` holds the resonance in the given share of the draws. `notch` stands in its
    middle, has the resonance's damping in its numerator and is wide enough for NOTCH_DEPTH_DB at both ends.
    """

    mode: int
    lower_hz: float
    upper_hz: float
    notch: Notch


@dataclass(frozen=True, eq=False)
class CrossoverCurve:
    """Share of the draws that keep the margins (`share`) against the median crossover in Hz, both (points,),
    under proportional control with the filters named; `allowed_hz` is the highest crossover at which the
    share asked for keeps them, NaN where none does."""

    filters: str
    gain: FloatArray
    crossover_hz: FloatArray
    share: FloatArray
    allowed_hz: float
    allowed_gain: float


def notch_ranges(
    frequency_hz: Sequence[FloatArray], damping_ratio: Sequence[FloatArray], share: float
) -> tuple[NotchRange, ...]:
    """One range for each mode from its draws (draws,) of frequency and damping."""
    tail = (1 - share) / 2
    found = []
    for mode, (frequency, damping) in enumerate(zip(frequency_hz, damping_ratio, strict=True), start=1):
        low, high = (float(f) for f in np.quantile(frequency, [tail, 1 - tail]))
        middle = float(np.sqrt(low * high))
        own = float(np.median(damping))
        offset = (high / low - low / high) / 4
        wide = float(np.sqrt(10 ** (NOTCH_DEPTH_DB / 10) * (own**2 + offset**2) - offset**2))
        found.append(NotchRange(mode, low, high, Notch(middle, own, wide)))
    return tuple(found)


def crossover_curves(
    nominal: AxisDraws,
    axis: AxisDraws,
    notches: Sequence[Notch],
    requirements: Requirements,
    share: float,
) -> tuple[CrossoverCurve, ...]:
    """Proportional control at the model's rate: alone, with a low pass, with notches, and with both."""
    rate = axis.sample_rate_hz
    plain = Controller("proportional", rate, 1.0)
    smooth = replace(plain, low_pass_hz=LOW_PASS_SHARE * rate)
    usable = tuple(notch for notch in notches if notch.frequency_hz < rate / 2)
    variants = {"no filter": plain, f"low pass at {LOW_PASS_SHARE * rate:.3g} Hz": smooth}
    if usable:
        variants |= {
            "notches": replace(plain, notches=usable),
            "low pass and notches": replace(smooth, notches=usable),
        }
    return tuple(
        _curve(label, controller, nominal, axis, requirements, share)
        for label, controller in variants.items()
    )


def _curve(
    filters: str,
    controller: Controller,
    nominal: AxisDraws,
    axis: AxisDraws,
    requirements: Requirements,
    share: float,
) -> CrossoverCurve:
    rate = axis.sample_rate_hz
    target = np.geomspace(LOWEST_SHARE * rate, HIGHEST_SHARE * rate, CROSSOVER_POINTS)
    size = np.abs(nominal.response(target)[0] * controller.response(target)) * nominal.loop_gain
    gains = np.unique(1 / size)

    def kept(gain: float) -> tuple[float, float]:
        margins = loop_margins(Loop(axis, replace(controller, proportional=gain)))
        crossover = margins.crossover_hz[np.isfinite(margins.crossover_hz)]
        middle = float(np.median(crossover)) if len(crossover) else np.nan
        return float(np.mean(margins.meets(requirements))), middle

    pairs = np.array([kept(float(gain)) for gain in gains])
    enough = np.flatnonzero(pairs[:, 0] >= share)
    allowed_gain, allowed = np.nan, np.nan
    if len(enough):
        low = float(gains[enough[-1]])
        high = float(gains[min(enough[-1] + 1, len(gains) - 1)])
        allowed_gain, allowed = low, float(pairs[enough[-1], 1])
        for _ in range(BISECTIONS):
            middle = float(np.sqrt(low * high))
            found, crossover = kept(middle)
            if found >= share:
                low, allowed_gain, allowed = middle, middle, crossover
            else:
                high = middle
    shown = np.isfinite(pairs[:, 1])
    return CrossoverCurve(filters, gains[shown], pairs[shown, 1], pairs[shown, 0], allowed, allowed_gain)
