"""Effects between the command and the drive: rate limit, drifting limits, bias, drifting gain."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.effect import Effect, PeriodicEffect
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.injection_point import InjectionPoint
from bayes_hw.model.parameters import Parameter

NEARLY_STRAIGHT = 200.0
"""Travels in a period of a wave that stands for a line."""


class RateLimit(Effect):
    """|dc/dt| <= rate: the drive ramps its command (slew rate; Astroem and Murray, Feedback Systems, 11.4).

    Not to be believed where the command never jumps by more than rate / sample rate.
    """

    label: ClassVar[str] = "rate_limit"
    block: ClassVar[Block] = "input"
    starts_tried: ClassVar[int] = 3
    test_values = (3.0,)
    vanishing_values = (1e9,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("rate_limit.rate", f"{scale.units.input}/s", 10 * scale.speed, 1.5),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.COMMAND_RATE] = values[0]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(EarlyRateLimit(), tuple(values))]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(float(factor) * scale.speed,) for factor in np.geomspace(0.5, 100.0, 16)]


class EarlyRateLimit(RateLimit):
    """|dc/dt| <= rate in front of the limiter: the position controller ramps what it asks for.

    Not to be believed where the command never jumps by more than rate / sample rate.
    """

    form: ClassVar[str] = "before the limiter"

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.EARLY_RATE] = values[0]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(RateLimit(), tuple(values))]


class SaturationDrift(PeriodicEffect):
    """limits (1 + depth sin(2 pi w / period + phase)): speed limits that vary with the axis position.

    Source: gravity and rail load on the drive's torque limit. Not to be believed where the records hardly
    saturate.
    """

    label: ClassVar[str] = "saturation_drift"
    block: ClassVar[Block] = "input"
    door: ClassVar[InjectionPoint] = "command"
    only_saturated: ClassVar[bool] = True
    starts_tried: ClassVar[int] = 4
    test_values = (0.1, 0.05, 1.5)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            signed("saturation_drift.sine", "", 0.2),
            signed("saturation_drift.cosine", "", 0.2),
            positive("saturation_drift.period", scale.units.output, scale.travel),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        self.write_wave(S.LIMIT_DEPTH, values, settings)


class SaturationSlope(Effect):
    """limits (1 + slope w): speed limits that grow along the travel, as they are where the axis starts.

    Source: as of limits that vary with the position. A wave of NEARLY_STRAIGHT travels stands for the line,
    0.02 % off at its end. Not to be believed where the records hardly saturate.
    """

    label: ClassVar[str] = "saturation_drift"
    block: ClassVar[Block] = "input"
    form: ClassVar[str] = "slope"
    test_values = (0.02,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (signed("saturation_drift.slope", f"1/{scale.units.output}", 0.3 / scale.travel),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        period = NEARLY_STRAIGHT * scale.travel
        settings[S.LIMIT_DEPTH], settings[S.LIMIT_PERIOD] = values[0] * period / (2 * np.pi), period

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(0.1 / scale.travel,)]


class CommandBias(Effect):
    """v + bias behind the limiter: an offset of the drive's analogue input.

    Not to be believed where the first samples show a moving axis (a record that does not start at rest).
    """

    label: ClassVar[str] = "command_bias"
    block: ClassVar[Block] = "input"
    test_values = (0.001,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (signed("command_bias.bias", scale.units.input, 0.02 * scale.speed),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.BIAS] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(5 * scale.sigma / (scale.duration * scale.velocity_gain),)]


class GainDrift(Effect):
    """v (1 + change (1 - exp(-t / time))): the drive warms up during a record.

    Not to be believed where time is much longer than the record: it is then a ramp whose end is unknown.
    """

    label: ClassVar[str] = "gain_drift"
    block: ClassVar[Block] = "input"
    test_values = (0.05, 30.0)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            signed("gain_drift.change", "", 0.1),
            positive("gain_drift.time", "s", 0.35 * scale.duration, 0.8),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.GAIN_CHANGE], settings[S.GAIN_TIME] = values

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(0.01, share * scale.duration) for share in (0.07, 0.2, 0.5)]
