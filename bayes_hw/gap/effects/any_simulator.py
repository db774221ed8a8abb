"""The catalogue for a simulator of any kind: which entries find a door, and those that exist for it alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.catalogue import catalogue
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.friction import SIZES
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.model.parameters import Parameter

LARGEST_SHARES = (0.02, 0.06, 0.15, 0.3)
"""Of the largest command, at which dead zones are tried."""


class DeadZone(Effect):
    """u - half_width above it, u + half_width below minus it, zero between: small commands do nothing.

    The input dead zone (Tao and Kokotovic, doi 10.1109/9.273339): stiction and a bridge's dead time. Not to
    be believed where the command seldom comes near zero.
    """

    label: ClassVar[str] = "dead_zone"
    block: ClassVar[Block] = "input"
    form: ClassVar[str] = "equal edges"
    starts_tried: ClassVar[int] = 2
    test_values: ClassVar[tuple[float, ...]] = (0.05,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("dead_zone.half_width", scale.units.input, 0.1 * scale.speed, 1.5),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[[S.INPUT_DEAD_LOWER, S.INPUT_DEAD_UPPER]] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(share * scale.speed,) for share in LARGEST_SHARES]


class UnequalDeadZone(DeadZone):
    """u - upper above it, u + lower below minus it, zero between: a dead zone that is not the same both ways.

    The input dead zone (Tao and Kokotovic, doi 10.1109/9.273339). Not to be believed where the command keeps
    one sign.
    """

    form: ClassVar[str] = "unequal edges"
    test_values = (0.04, 0.06)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        unit, usual = scale.units.input, 0.1 * scale.speed
        return (
            positive("dead_zone.lower", unit, usual, 1.5),
            positive("dead_zone.upper", unit, usual, 1.5),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[[S.INPUT_DEAD_LOWER, S.INPUT_DEAD_UPPER]] = values

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(share * scale.speed, share * scale.speed) for share in LARGEST_SHARES]


class Limits(Effect):
    """min(max(u, lower), upper): the drive cannot follow large commands.

    Saturation (eq. 2 of the paper). Not to be believed where few commands are large.
    """

    label: ClassVar[str] = "saturation"
    block: ClassVar[Block] = "input"
    starts_tried: ClassVar[int] = 2
    test_values = (0.2, 0.2)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        unit = scale.units.input
        return (
            positive("saturation.below", unit, scale.speed, 0.7),
            positive("saturation.above", unit, scale.speed, 0.7),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[[S.LOWER, S.UPPER]] = -values[0], values[1]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(share * scale.speed, share * scale.speed) for share in (0.4, 0.6, 0.8, 0.95)]


class FirstOrderLag(Effect):
    """time x' = u - x: the command is followed with a delay that grows with its frequency.

    A first-order lag (Astroem and Murray, Feedback Systems, 6.3). Not to be believed beside transport_delay
    where the command changes slowly: the records cannot tell the two apart then.
    """

    label: ClassVar[str] = "lag"
    block: ClassVar[Block] = "linear"
    starts_tried: ClassVar[int] = 2
    test_values = (0.2,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("lag.time", "s", 3 / scale.rate, 1.5),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.LAG] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(samples / scale.rate,) for samples in (0.5, 1.5, 4.0, 10.0, 25.0)]


class ViscousFriction(Effect):
    """a = -F sign(v) - B v: Coulomb and viscous friction on the moving mass, over its inertia.

    Coulomb's law with a viscous part (Armstrong-Helouvry et al., doi 10.1016/0005-1098(94)90209-7). Not to be
    believed without reversals, where an offset of the force does the same.
    """

    label: ClassVar[str] = "friction"
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "Coulomb and viscous"
    test_values: ClassVar[tuple[float, ...]] = (0.05, 0.3)

    def usual(self, scale: AxisScale) -> float:
        """The acceleration at which friction is first tried."""
        return scale.sigma * 4 * scale.stiffness[0]

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        usual = self.usual(scale)
        return (
            positive("friction.torque", f"{scale.units.output}/s^2", 3 * usual),
            positive("friction.viscous", "1/s", 3 * usual / scale.output_speed),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.MOTOR_FRICTION], settings[S.VISCOUS] = values[:2]
        settings[S.MOTOR_SMOOTHING] = 0.003 * scale.output_speed

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        usual = self.usual(scale)
        return [
            (size * usual, share * size * usual / scale.output_speed)
            for size in (*SIZES, 27.0)
            for share in (0.3, 3.0)
        ]


class DirectedFriction(ViscousFriction):
    """a = -F (1 + m d) d - B (1 + b d) v, d = sign v: friction that is not the same both ways.

    Coulomb's law with a viscous part, each by direction (Janot, Gautier, Brunot, Workshop on Nonlinear
    System Identification Benchmarks 2019). Not to be believed without stretches of both directions; the
    difference of the Coulomb parts is an offset of the force, as command_bias is.
    """

    form: ClassVar[str] = "Coulomb and viscous, unequal by direction"
    test_values = (0.05, 0.3, 0.2, 0.2)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            *super().parameters(scale),
            signed("friction.torque_asymmetry", "", 0.2),
            signed("friction.viscous_asymmetry", "", 0.2),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        super().apply(values, settings, scale)
        settings[S.MOTOR_ASYMMETRY], settings[S.VISCOUS_ASYMMETRY] = np.clip(values[2:], -0.99, 0.99)

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(*start, 0.01, 0.01) for start in super().starts(scale)]


FOR_ANY_SIMULATOR: tuple[type[Effect], ...] = (
    DeadZone,
    UnequalDeadZone,
    Limits,
    FirstOrderLag,
    ViscousFriction,
    DirectedFriction,
)

STOCHASTIC_ON_OUTPUT = ("encoder_quantization", "sensor_drift", "timing_jitter", "outliers")
"""Labels of stochastic effects that need nothing of the simulator; wind needs the path of a load torque."""


def effects_for(
    scale: AxisScale, inner: frozenset[int], without: frozenset[str] = frozenset()
) -> tuple[Effect, ...]:
    """The effects, built in or registered, that enter a simulator before it, behind it or within it.

    An effect finds its door by what it writes into the settings, of which the simulator takes `inner` within
    it; one that needs what is in no simulator (a resonator, limits that depend on position) finds none.
    """
    doors = S.COMMAND_SIDE | S.OUTPUT_SIDE | inner
    own = [kind() for kind in FOR_ANY_SIMULATOR]
    return tuple(
        effect
        for effect in (*catalogue(without), *own)
        if effect.label not in without and len(used := written(effect, scale)) > 0 and used <= doors
    )


def written(effect: Effect, scale: AxisScale) -> frozenset[int]:
    """Which settings an effect changes; none where it changes the linear block instead."""
    values = np.array(effect.test_values)
    if effect.resonator(values) is not None:
        return frozenset()
    settings = S.NEUTRAL.copy()
    effect.apply(values, settings, scale)
    return frozenset(np.flatnonzero(settings != S.NEUTRAL).tolist())
