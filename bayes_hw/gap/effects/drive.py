"""Effects of the drive: backlash and torque ripple; friction has a file of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.effect import SECOND_HARMONIC, Effect, PeriodicEffect
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.injection_point import InjectionPoint
from bayes_hw.model.parameters import Parameter


class KinematicBacklash(Effect):
    """w* = min(max(w*, w - half_gap), w + half_gap): play with memory behind the compliance.

    The play operator (Tao and Kokotovic, doi 10.1109/9.376056). Not to be believed where the axis hardly
    reverses outside the dead zone.
    """

    label: ClassVar[str] = "backlash"
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "kinematic"
    test_values: ClassVar[tuple[float, ...]] = (0.01,)

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
    derivative_step: ClassVar[float] = 0.3
    chaotic: ClassVar[bool] = True
    rugged: ClassVar[bool] = True
    starts_tried: ClassVar[int] = 2
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "gap in the compliance"
    test_values: ClassVar[tuple[float, ...]] = (0.006,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("backlash.half_gap", scale.units.output, 2 * scale.sigma, 1.5),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.GAP] = values[0]

    def missed_torsion(self, values: FloatArray, scale: AxisScale) -> float:
        return float(values[0])

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(size * scale.sigma,) for size in (0.5, 0.8, 1.2, 1.8, 2.7, 4.0, 6.0, 9.0)]


class TorqueRipple(PeriodicEffect):
    """torque = A (sin(2 pi theta_motor / period + phase) - sin(phase)): cogging, in units of acceleration.

    Cogging torque is periodic in the rotor angle (Hanselman, Brushless Motors, chapter 4). The axis rests at
    zero where the record starts, so that there is no torque there. Not to be believed where the period is
    longer than the travel.
    """

    label: ClassVar[str] = "torque_ripple"
    needs_drive_train: ClassVar[bool] = True
    block: ClassVar[Block] = "drive"
    form: ClassVar[str] = "motor"
    ripples: ClassVar[bool] = True
    door: ClassVar[InjectionPoint] = "motor_torque"
    first_setting: ClassVar[int] = S.RIPPLE
    test_values: ClassVar[tuple[float, ...]] = (20.0, 10.0, 0.3)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        acceleration = f"{scale.units.output}/s^2"
        spread = 20 * self.unit_amplitude(scale)
        return (
            signed("torque_ripple.sine", acceleration, spread),
            signed("torque_ripple.cosine", acceleration, spread),
            positive("torque_ripple.period", scale.units.output, 0.2 * scale.travel),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        self.write_wave(self.first_setting, values, settings)
        cosines = [values[row] for row in (1, SECOND_HARMONIC + 1) if row < len(values)]
        settings[self.first_setting + CONSTANT] = sum(values[CONSTANT : CONSTANT + 1]) - sum(cosines)

    def unit_amplitude(self, scale: AxisScale) -> float:
        """An acceleration that moves the axis by four times the noise."""
        return scale.sigma * 4 * scale.stiffness[0]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(TorqueRippleWithOvertone(), (*values, *NO_OVERTONE))]


class LoadRipple(TorqueRipple):
    """torque = A (sin(2 pi w / period + phase) - sin(phase)) on the load: an uneven rail, as acceleration.

    Azimuth track unevenness moves the structure on it (Gawronski, Modeling and Control of Antennas and
    Telescopes). Not to be believed where the period is longer than the travel.
    """

    form: ClassVar[str] = "load"
    door: ClassVar[InjectionPoint] = "load_torque"
    first_setting: ClassVar[int] = S.LOAD_RIPPLE
    test_values: ClassVar[tuple[float, ...]] = (0.5, 0.3, 0.3)

    def unit_amplitude(self, scale: AxisScale) -> float:
        return scale.sigma * scale.stiffness[1]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(LoadRippleWithOvertone(), (*values, *NO_OVERTONE))]


class MeshRipple(LoadRipple):
    """torque = A (sin(2 pi theta_motor / period + phase) - sin(phase)) on the load, reaction on the motor.

    Gear mesh, in units of the load's acceleration (transmission error of gears; Welbourn, Fundamental
    Knowledge of Gear Noise, 1979). Not to be believed where the period is longer than the travel.
    """

    form: ClassVar[str] = "gear mesh"
    door: ClassVar[InjectionPoint] = "gear_torque"
    first_setting: ClassVar[int] = S.MESH_RIPPLE

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(MeshRippleWithOvertone(), (*values, *NO_OVERTONE))]


CONSTANT = 5
"""Where it stands among the parameters of a ripple with overtone, and behind the wave among the settings."""

NO_OVERTONE = (0.0, 0.0, 0.0)


class _Overtone(TorqueRipple):
    """What ripples share that have a second harmonic and a constant torque where the record starts.

    torque = A (sin(x + phase) - sin(phase)) + A2 (sin(2 x + phase2) - sin(phase2)) + constant.
    """

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        acceleration, spread = f"{scale.units.output}/s^2", 20 * self.unit_amplitude(scale)
        names = ("second_sine", "second_cosine", "constant")
        more = [signed(f"torque_ripple.{name}", acceleration, spread) for name in names]
        return (*super().parameters(scale), *more)

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []


class TorqueRippleWithOvertone(_Overtone):
    """The torque of cogging with its second harmonic and a constant: see TorqueRipple.

    Cogging of poles that are not alike (Hanselman, Brushless Motors, chapter 4). Not to be believed where the
    period is longer than the travel.
    """

    form: ClassVar[str] = "motor, with overtone"
    test_values: ClassVar[tuple[float, ...]] = (20.0, 10.0, 0.3, 5.0, -4.0, 2.0)


class LoadRippleWithOvertone(_Overtone, LoadRipple):
    """The torque of an uneven rail with its second harmonic and a constant: see LoadRipple.

    Not to be believed where the period is longer than the travel.
    """

    form: ClassVar[str] = "load, with overtone"
    test_values: ClassVar[tuple[float, ...]] = (0.5, 0.3, 0.3, 0.1, -0.1, 0.05)


class MeshRippleWithOvertone(_Overtone, MeshRipple):
    """The torque of gear mesh with its second harmonic and a constant: see MeshRipple.

    Not to be believed where the period is longer than the travel.
    """

    form: ClassVar[str] = "gear mesh, with overtone"
    test_values: ClassVar[tuple[float, ...]] = (0.5, 0.3, 0.3, 0.1, -0.1, 0.05)
