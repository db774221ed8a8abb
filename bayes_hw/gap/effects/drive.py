"""Effects of the drive: friction, backlash, torque ripple."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap import settings as S  # noqa: N812
from bayes_hw.gap.effects.effect import Block, Door, Effect, PeriodicEffect
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.scale import AxisScale
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
    test_values = (30.0, 0.01)

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
    test_values = (30.0, 0.4, 0.03, 0.01)

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
    test_values = (30.0, 5e3)

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


class CoulombFrictionAtLoad(_Friction):
    """torque = -F sign(load speed), smoothed below a small speed, on the far side of the compliance.

    Bearing and rail friction (doi 10.1016/0005-1098(94)90209-7).
    """

    form: ClassVar[str] = "Coulomb, load"
    test_values = (2.0, 0.01)

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


class KinematicBacklash(Effect):
    """w* = min(max(w*, w - half_gap), w + half_gap): play with memory behind the compliance.

    The play operator (Tao and Kokotovic, doi 10.1109/9.376056). Not to be believed where the axis hardly
    reverses outside the dead zone.
    """

    label: ClassVar[str] = "backlash"
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "kinematic"
    test_values = (0.01,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("backlash.half_gap", scale.units.output, 2 * scale.sigma, 1.5),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.PLAY] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(size * scale.sigma,) for size in (0.7, 2.0, 5.0)]


class DynamicBacklash(Effect):
    """No torque in the compliance while |torsion| < half_gap, the spring beyond: free play with impacts.

    Nordin and Gutman, doi 10.1016/S0005-1098(02)00047-X. A limit cycle in the gap is chaotic, so that the
    closure of such a gap is bounded. Not to be believed where G is not that of a drive train.
    """

    label: ClassVar[str] = "backlash"
    needs_drive_train: ClassVar[bool] = True
    derivative_step: ClassVar[float] = 0.02
    chaotic: ClassVar[bool] = True
    starts_tried: ClassVar[int] = 2
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "gap in the compliance"
    test_values = (0.006,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("backlash.half_gap", scale.units.output, 2 * scale.sigma, 1.5),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.GAP] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(size * scale.sigma,) for size in (0.5, 0.8, 1.2, 1.8, 2.7, 4.0, 6.0, 9.0)]


class TorqueRipple(PeriodicEffect):
    """torque = A sin(2 pi theta_motor / period + phase): cogging and gear mesh, in units of acceleration.

    Cogging torque is periodic in the rotor angle (Hanselman, Brushless Motors, chapter 4). Not to be believed
    where the period is longer than the travel.
    """

    label: ClassVar[str] = "torque_ripple"
    needs_drive_train: ClassVar[bool] = True
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "motor"
    door: ClassVar[Door] = "motor_torque"
    test_values = (20.0, 10.0, 0.3)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        acceleration = f"{scale.units.output}/s^2"
        spread = 20 * self.unit_amplitude(scale)
        return (
            signed("torque_ripple.sine", acceleration, spread),
            signed("torque_ripple.cosine", acceleration, spread),
            positive("torque_ripple.period", scale.units.output, 0.2 * scale.travel),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.RIPPLE], settings[S.RIPPLE_PERIOD] = np.hypot(values[0], values[1]), values[2]
        settings[S.RIPPLE_PHASE] = np.arctan2(values[1], values[0])

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return []

    def unit_amplitude(self, scale: AxisScale) -> float:
        return scale.sigma * 4 * scale.stiffness[0]


class LoadRipple(TorqueRipple):
    """torque = A sin(2 pi w / period + phase) on the load: unevenness of the rail, in units of acceleration.

    Azimuth track unevenness moves the structure on it (Gawronski, Modeling and Control of Antennas and
    Telescopes). Not to be believed where the period is longer than the travel.
    """

    form: ClassVar[str] = "load"
    door: ClassVar[Door] = "load_torque"
    test_values = (0.5, 0.3, 0.3)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.LOAD_RIPPLE], settings[S.LOAD_RIPPLE_PERIOD] = np.hypot(values[0], values[1]), values[2]
        settings[S.LOAD_RIPPLE_PHASE] = np.arctan2(values[1], values[0])

    def unit_amplitude(self, scale: AxisScale) -> float:
        return scale.sigma * scale.stiffness[1]
