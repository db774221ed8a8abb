"""An axis with effects: base parameters and settings in, w and y of a record out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap import settings as S  # noqa: N812
from bayes_hw.gap.chain_kernel import MOTOR_ANGLE, MOTOR_SPEED, W
from bayes_hw.gap.drive_train import (
    ContinuousPoles,
    DriveTrain,
    TorqueSystem,
    UnknownTrain,
    continuous_poles,
    realise,
)
from bayes_hw.gap.nominal_prior import STATIC_SPREAD, base_parameters
from bayes_hw.gap.resonator import Resonator
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

STATIC_COUNT = GAIN = 3
"""Base parameters before those of G: both limits and the dead zone; the row of the gain, its first."""

KEPT = 24

CommandPath: TypeAlias = tuple[FloatArray, FloatArray, ComplexArray, ComplexArray]
TorquePath: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, ComplexArray, ComplexArray, ComplexArray]


@dataclass(frozen=True)
class Chain:
    """Poles and gains of the linear block, in continuous time.

    `command_path` holds real poles (n,) in 1/s, their output gains (4, n), the upper poles of pairs (m,) and
    their output gains (4, m), outputs w, motor angle, motor speed, load speed; `torque_path` the same with
    input gains (2, n) and (2, m) by motor and load torque after the poles.
    """

    command_path: CommandPath
    torque_path: TorquePath
    direct: float
    delay_samples: int
    rate: float
    stiffness: tuple[float, float]
    contact_damping: float

    @property
    def structure(self) -> tuple[int, ...]:
        """Numbers of real poles and pairs in front of w, and of those that torques drive."""
        return (
            len(self.command_path[0]),
            len(self.command_path[2]),
            len(self.torque_path[0]),
            len(self.torque_path[3]),
        )


class ChainBuilder:
    """Builds chains from base parameter vectors (those of `AxisParameters`, dominant)."""

    def __init__(self, model: HammersteinWiener) -> None:
        self.model = model
        self.axis = AxisParameters(model)
        self._linear = lru_cache(KEPT)(self._linear_of)
        self._train = lru_cache(KEPT)(self._train_of)
        self._torques = lru_cache(KEPT)(self._torques_of)
        self._chain = lru_cache(KEPT)(self._chain_of)
        self.base_parameters = base_parameters(self.axis)
        self.start_spreads = STATIC_SPREAD
        self.nominal_of_g = tuple(self.axis.nominal[STATIC_COUNT:].tolist())
        self.reference = realise(self._linear(self.nominal_of_g)[0], model.sample_rate_hz)

        nominal = self.axis.nominal[None]
        unscaled = self._speed_of_unit_gain(nominal)
        self.gain_row = GAIN if np.isfinite(unscaled[0]) and unscaled[0] != 0 else None
        self._nominal_speed_of_unit_gain = unscaled

    def speed_per_gain(self, values: FloatArray) -> FloatArray:
        """Steady speed per command and gain (points,), relative to the nominal model's, at base parameters
        (points, parameters)."""
        return np.asarray(self._speed_of_unit_gain(values) / self._nominal_speed_of_unit_gain)

    def _speed_of_unit_gain(self, values: FloatArray) -> FloatArray:
        of_unit_gain = values.copy()
        of_unit_gain[:, GAIN] = 1.0
        return self.axis.velocity_gain(of_unit_gain.T)

    def write_base(self, values: FloatArray, settings: FloatArray) -> None:
        """Write the limits and the dead zone at parameter values (parameters,) into `settings`."""
        settings[[S.LOWER, S.UPPER, S.DEAD_ZONE]] = values[:STATIC_COUNT]

    def train(self, values: FloatArray) -> DriveTrain | UnknownTrain:
        """The drive train behind G at base parameters `values` (parameters,).

        The latest few are kept: most derivatives leave G as it is.
        """
        return self._train(tuple(values[STATIC_COUNT:].tolist()))

    def _train_of(self, of_g: tuple[float, ...]) -> DriveTrain | UnknownTrain:
        train: DriveTrain | UnknownTrain | None = None
        if self.reference is not None:
            train = realise(self._linear(of_g)[0], self.model.sample_rate_hz, self.reference)
        return train or UnknownTrain()

    def _torques_of(self, of_g: tuple[float, ...], resonator: Resonator | None) -> TorquePath:
        return _torque_path(self._train(of_g).torque_system(self._linear(of_g)[0], resonator))

    def _linear_of(self, of_g: tuple[float, ...]) -> tuple[ContinuousPoles, float]:
        """G in continuous time and its direct term; it does not depend on the static parameters."""
        batch = self.axis.linear_batch(np.array([*[0.0] * STATIC_COUNT, *of_g])[:, None])
        real, pairs, direct = batch.residues()
        system = continuous_poles(
            batch.real_poles[:, 0], batch.pair_poles[:, 0], real[:, 0], pairs[:, 0], self.model.sample_rate_hz
        )
        return system, float(direct[0])

    def chain(
        self, values: FloatArray, resonator: Resonator | None = None, needs_train: bool = True
    ) -> Chain:
        """The linear block at base parameters `values` (parameters,), with a resonator on the load if given.

        Without `needs_train` the torque paths are those of the nominal model, for effects without torques.
        """
        return self._chain(tuple(values[STATIC_COUNT:].tolist()), resonator, needs_train)

    def _chain_of(self, of_g: tuple[float, ...], resonator: Resonator | None, needs_train: bool) -> Chain:
        system, direct = self._linear(of_g)
        s, r = system.poles, system.residues
        driving = of_g if needs_train else self.nominal_of_g
        train = self._train(driving)
        if resonator is not None and resonator.inertia_ratio == 0:
            resonator = None
        torque_path = self._torques(driving, resonator)
        if resonator is not None:
            own = np.concatenate([torque_path[0].astype(np.complex128), torque_path[3]])
            s, r = train.with_resonator(system, resonator, own)
        outputs = np.concatenate([r[None], r * train.ratios(s, resonator)])
        if isinstance(train, DriveTrain):
            outputs = turning_together(s, outputs)
        real = s.imag == 0
        return Chain(
            (s[real].real, outputs[:, real].real, s[~real], outputs[:, ~real]),
            torque_path,
            direct,
            self.model.linear.delay_samples,
            self.model.sample_rate_hz,
            train.stiffness,
            train.contact_damping,
        )


def turning_together(poles: ComplexArray, outputs: ComplexArray) -> ComplexArray:
    """`outputs` (4, n) with the motor at the load's speed whenever the command has been constant for long.

    The fastest real pole, that of the velocity loop, lies near the zero of the gear's damping. There w shows
    next to nothing of it while the motor's ratio to w is nearly infinite, so that a damping a few per cent
    off would have the motor turn at another speed than the load. Both turn at the residue of the integrator;
    without one, or without such a pole, nothing is changed.
    """
    real = (poles.imag == 0) & (poles != 0)
    if not np.any(real) or not np.any(poles == 0):
        return outputs
    fastest = int(np.argmax(np.where(real, np.abs(poles), 0.0)))
    others = (poles != 0) & (np.arange(len(poles)) != fastest)
    each = outputs[MOTOR_SPEED, others] / poles[others]
    settled = np.sum(np.where(poles[others].imag == 0, each.real, 2 * each.real))
    turned = outputs.copy()
    turned[MOTOR_SPEED, fastest] = -poles[fastest] * (outputs[W, poles == 0].real.sum() + settled)
    turned[MOTOR_ANGLE, fastest] = turned[MOTOR_SPEED, fastest] / poles[fastest]
    return turned


def _torque_path(torques: TorqueSystem) -> TorquePath:
    real = torques.poles.imag == 0
    return (
        torques.poles[real].real,
        torques.inputs[:, real].real,
        torques.outputs[:, real].real,
        torques.poles[~real],
        torques.inputs[:, ~real],
        torques.outputs[:, ~real],
    )
