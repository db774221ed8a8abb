"""Friction, in its forms: dry, falling with speed, presliding; at the motor or at the load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.effects.priors import positive
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.model.parameters import Parameter

SIZES = (1.0, 3.0, 9.0)
"""Errors, in units of the noise, at which effects of unknown size are screened."""


class _Friction(Effect):
    """What the forms of friction share: a torque that opposes the motion, in units of acceleration."""

    label: ClassVar[str] = "friction"
    needs_drive_train: ClassVar[bool] = True
    block: ClassVar[Block] = "drive"

    def usual(self, scale: AxisScale) -> float:
        """The torque whose wind-up of the velocity loop shows as one sigma: sigma times loop stiffness."""
        return scale.sigma * 4 * scale.stiffness[0]

    def smoothing(self, scale: AxisScale) -> float:
        """Speed below which sliding friction fades, in output units per second."""
        return 0.03 * scale.output_speed


class CoulombFrictionAtMotor(_Friction):
    """torque = -F sign(motor speed), smoothed below a small speed, inside the velocity loop.

    Coulomb's law (Armstrong-Helouvry et al., doi 10.1016/0005-1098(94)90209-7). The loop's integrator winds
    up at every reversal, which looks like play at the motor; backlash at the output does not.
    """

    form: ClassVar[str] = "Coulomb, motor"
    test_values: ClassVar[tuple[float, ...]] = (30.0, 0.01)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            positive("friction.torque", f"{scale.units.output}/s^2", 3 * self.usual(scale)),
            positive("friction.smoothing_speed", f"{scale.units.output}/s", self.smoothing(scale), 1.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.MOTOR_FRICTION], settings[S.MOTOR_SMOOTHING] = values

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(size * self.usual(scale), self.smoothing(scale)) for size in SIZES]


class StribeckFrictionAtMotor(_Friction):
    """torque = -F (1 + a exp(-(speed / speed_s)^2)) sign(motor speed): friction that falls with speed.

    Stribeck's curve (doi 10.1016/0005-1098(94)90209-7). Not to be believed where the axis is seldom slow.
    """

    form: ClassVar[str] = "Stribeck, motor"
    test_values: ClassVar[tuple[float, ...]] = (30.0, 0.4, 0.03, 0.01)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        speed = f"{scale.units.output}/s"
        return (
            positive("friction.torque", f"{scale.units.output}/s^2", 3 * self.usual(scale)),
            positive("friction.static_excess", "", 0.5, 1.0),
            positive("friction.stribeck_speed", speed, 0.1 * scale.output_speed, 1.0),
            positive("friction.smoothing_speed", speed, self.smoothing(scale), 1.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.MOTOR_FRICTION], settings[S.MOTOR_STATIC], settings[S.MOTOR_STRIBECK_SPEED] = values[:3]
        settings[S.MOTOR_SMOOTHING] = values[3]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [
            (size * self.usual(scale), 0.5, 0.1 * scale.output_speed, self.smoothing(scale)) for size in SIZES
        ]


class PreslidingFriction(_Friction):
    """Bristles that bend before they slide: z' = speed - |speed| stiffness z / F, torque = -stiffness z.

    Dahl's model (Armstrong-Helouvry et al., doi 10.1016/0005-1098(94)90209-7). Not to be believed where
    reversals are far apart: it is then Coulomb friction.
    """

    form: ClassVar[str] = "presliding, motor"
    test_values: ClassVar[tuple[float, ...]] = (30.0, 5e3)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        usual = self.usual(scale)
        return (
            positive("friction.torque", f"{scale.units.output}/s^2", 3 * usual),
            positive("friction.presliding_stiffness", "1/s^2", usual / scale.sigma, 2.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.MOTOR_FRICTION], settings[S.MOTOR_PRESLIDING] = values

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        usual = self.usual(scale)
        return [(size * usual, factor * usual / scale.sigma) for size in SIZES for factor in (0.3, 3.0)]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(BristleFriction(), (*values, 0.3, 0.03))]


class BristleFriction(PreslidingFriction):
    """Bristles whose sliding torque falls with speed: F (1 + a exp(-(speed / speed_s)^2)) in Dahl's model.

    The model of LuGre without its damping (Canudas de Wit et al., doi 10.1109/9.376053). Not to be believed
    where the axis is seldom slow.
    """

    form: ClassVar[str] = "bristles, motor"
    test_values: ClassVar[tuple[float, ...]] = (30.0, 5e3, 0.4, 0.03)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            *super().parameters(scale),
            positive("friction.static_excess", "", 0.5, 1.0),
            positive("friction.stribeck_speed", f"{scale.units.output}/s", 0.1 * scale.output_speed, 1.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        super().apply(values[:2], settings, scale)
        settings[S.MOTOR_STATIC], settings[S.MOTOR_STRIBECK_SPEED] = values[2:]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(*start, 0.5, 0.1 * scale.output_speed) for start in super().starts(scale)]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []


class CoulombFrictionAtLoad(_Friction):
    """torque = -F sign(load speed), smoothed below a small speed, on the far side of the compliance.

    Bearing and rail friction (doi 10.1016/0005-1098(94)90209-7).
    """

    form: ClassVar[str] = "Coulomb, load"
    test_values: ClassVar[tuple[float, ...]] = (2.0, 0.01)

    def usual(self, scale: AxisScale) -> float:
        return scale.sigma * scale.stiffness[1]

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            positive("friction.torque", f"{scale.units.output}/s^2", self.usual(scale)),
            positive("friction.smoothing_speed", f"{scale.units.output}/s", self.smoothing(scale), 1.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.LOAD_FRICTION], settings[S.LOAD_SMOOTHING] = values

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(0.5 * size * self.usual(scale), self.smoothing(scale)) for size in SIZES]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        torque, smoothing = values
        slow = 3 * smoothing
        return [
            (StribeckFrictionAtLoad(), (torque, 0.3, slow, smoothing)),
            (BristleFrictionAtLoad(), (torque, 100 * torque / slow, 0.3, slow)),
        ]


class StribeckFrictionAtLoad(CoulombFrictionAtLoad):
    """torque = -F (1 + a exp(-(speed / speed_s)^2)) sign(load speed): Stribeck's curve on the far side.

    Doi 10.1016/0005-1098(94)90209-7. Not to be believed where the axis is seldom slow.
    """

    form: ClassVar[str] = "Stribeck, load"
    test_values: ClassVar[tuple[float, ...]] = (2.0, 0.4, 0.03, 0.01)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        torque, smoothing = super().parameters(scale)
        return (
            torque,
            positive("friction.static_excess", "", 0.5, 1.0),
            positive("friction.stribeck_speed", f"{scale.units.output}/s", 0.1 * scale.output_speed, 1.0),
            smoothing,
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.LOAD_FRICTION], settings[S.LOAD_STATIC], settings[S.LOAD_STRIBECK_SPEED] = values[:3]
        settings[S.LOAD_SMOOTHING] = values[3]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(torque, 0.5, 0.1 * scale.output_speed, slow) for torque, slow in super().starts(scale)]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []


class BristleFrictionAtLoad(CoulombFrictionAtLoad):
    """Bristles on the far side of the compliance, sliding on Stribeck's curve: see BristleFriction.

    Canudas de Wit et al., doi 10.1109/9.376053. Not to be believed where reversals are far apart.
    """

    form: ClassVar[str] = "bristles, load"
    test_values: ClassVar[tuple[float, ...]] = (2.0, 2e3, 0.4, 0.03)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        usual = self.usual(scale)
        return (
            positive("friction.torque", f"{scale.units.output}/s^2", usual),
            positive("friction.presliding_stiffness", "1/s^2", usual / scale.sigma, 2.0),
            positive("friction.static_excess", "", 0.5, 1.0),
            positive("friction.stribeck_speed", f"{scale.units.output}/s", 0.1 * scale.output_speed, 1.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.LOAD_FRICTION], settings[S.LOAD_PRESLIDING] = values[:2]
        settings[S.LOAD_STATIC], settings[S.LOAD_STRIBECK_SPEED] = values[2:]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        usual, slow = self.usual(scale), 0.1 * scale.output_speed
        return [(0.5 * size * usual, usual / scale.sigma, 0.5, slow) for size in SIZES]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []
