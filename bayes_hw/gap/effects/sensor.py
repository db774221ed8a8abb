"""Effects of the encoder that change the response: eccentricity, unequal gains, drift."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.effect import Effect, PeriodicEffect
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.injection_point import InjectionPoint
from bayes_hw.model.parameters import Parameter


class EncoderEccentricity(PeriodicEffect):
    """w + A sin(2 pi w / period + phase) - A sin(phase): a disc off its centre, zero where the record starts.

    Sources of encoder error: Geckeler et al., doi 10.1088/0957-0233/21/7/075302. Not to be believed where the
    travel is less than half a period.
    """

    label: ClassVar[str] = "encoder_eccentricity"
    block: ClassVar[Block] = "sensor"
    door: ClassVar[InjectionPoint] = "output"
    test_values: ClassVar[tuple[float, ...]] = (0.01, 0.005, 0.8)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        unit = scale.units.output
        return (
            signed("encoder_eccentricity.sine", unit, 20 * scale.sigma),
            signed("encoder_eccentricity.cosine", unit, 20 * scale.sigma),
            positive("encoder_eccentricity.period", unit, 0.5 * scale.travel),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        self.write_wave(S.ECCENTRICITY, values, settings)

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(OvalEncoder(), (*values, 0.0, 0.0))]


class ReadingEccentricity(EncoderEccentricity):
    """y + A sin(2 pi w / period + phase) - A sin(phase): the same error behind the dead zone.

    Zero where the record starts. Not to be believed where the travel is less than half a period.
    """

    form: ClassVar[str] = "of the reading"

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        self.write_wave(S.READING_ERROR, values, settings)

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(OvalReading(), (*values, 0.0, 0.0))]


class _Oval(EncoderEccentricity):
    """What the errors of oval discs share: a second harmonic."""

    test_values: ClassVar[tuple[float, ...]] = (0.01, 0.005, 0.8, 0.004, -0.002)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        names = ("second_sine", "second_cosine")
        unit = scale.units.output
        more = [signed(f"encoder_eccentricity.{name}", unit, 20 * scale.sigma) for name in names]
        return (*super().parameters(scale), *more)

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []


class OvalEncoder(_Oval):
    """The error of a disc that is also oval: A sin(x + phase) + A2 sin(2 x + phase2), x = 2 pi w / period.

    Zero where the record starts (doi 10.1088/0957-0233/21/7/075302). Not to be believed where the travel is
    less than half a period.
    """

    form: ClassVar[str] = "oval"


class OvalReading(_Oval, ReadingEccentricity):
    """The same error behind the dead zone, A sin(x + phase) + A2 sin(2 x + phase2).

    Not to be believed where the travel is less than half a period.
    """

    form: ClassVar[str] = "oval, of the reading"


class GainAsymmetry(Effect):
    """ratio w where w > 0: the output gains of the directions differ, c2 / c3 = ratio (eq. 4 of the paper).

    The paper sets c2 = c3, which is an assumption. Not to be believed where w keeps one sign.
    """

    label: ClassVar[str] = "gain_asymmetry"
    block: ClassVar[Block] = "sensor"
    test_values: ClassVar[tuple[float, ...]] = (1.05,)
    vanishing_values = (1 + 1e-9,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("gain_asymmetry.ratio", "", 1.0, 0.1),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.GAIN_RATIO] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(1.01,)]


class ReadingAsymmetry(GainAsymmetry):
    """ratio y where y > 0: the gains differ behind the dead zone, y = c2 (w - delta) and c3 (w + delta).

    Not to be believed where w keeps one sign.
    """

    form: ClassVar[str] = "behind the dead zone"

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.SHOWN_RATIO] = values[0]


class LinearSensorDrift(Effect):
    """y + rate t: the measured angle creeps.

    Not to be believed where a bias of the command would do the same; the dead zone and the limits tell them
    apart.
    """

    label: ClassVar[str] = "sensor_drift"
    block: ClassVar[Block] = "sensor"
    form: ClassVar[str] = "ramp"
    test_values: ClassVar[tuple[float, ...]] = (2e-4,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        unit = f"{scale.units.output}/s"
        return (signed("sensor_drift.rate", unit, 20 * scale.sigma / scale.duration),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.DRIFT_RATE] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(scale.sigma / scale.duration,)]


class ThermalSensorDrift(Effect):
    """y + amount (1 - exp(-t / time)): the encoder's mount settles to a new temperature.

    Not to be believed where time is longer than the record: it is then a ramp.
    """

    label: ClassVar[str] = "sensor_drift"
    block: ClassVar[Block] = "sensor"
    form: ClassVar[str] = "thermal"
    test_values: ClassVar[tuple[float, ...]] = (0.03, 30.0)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            signed("sensor_drift.amount", scale.units.output, 20 * scale.sigma),
            positive("sensor_drift.time", "s", 0.25 * scale.duration, 0.8),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.DRIFT_SETTLING], settings[S.DRIFT_TIME] = values

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(scale.sigma, share * scale.duration) for share in (0.05, 0.15, 0.4)]
