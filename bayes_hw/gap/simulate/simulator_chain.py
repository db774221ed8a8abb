"""Any simulator under the catalogue's effects: before it, behind it, and as a force within it.

Forces that depend on the motion, as a simulator with a force door takes them: friction and ripple.

All are accelerations, in output units per s^2: forces over the inertia that they act on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.signal import fftconvolve

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.case.lattice import shortest_period
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.case.simulator import (
    Force,
    Simulator,
    command_of,
    known_inputs,
    with_command,
    with_doors,
)
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.builder import Followed, KnownPositions, Signals
from bayes_hw.gap.simulate.injection_point import NO_STATES, InjectionPoint, InjectionStates
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.gap.simulate.signal_kernel import command_side, output_side
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Normal
from bayes_hw.record import Record


@dataclass(frozen=True)
class ForceLaw:
    """Friction and ripple of `settings` (batch, COUNT) and, where given, a known `signal` (samples,).

    With position x and velocity v, d = sign v:

        a = - F (1 + d m) (1 + e exp(-(v / v_s)^2)) clip(v / v_0, -1, 1) - B (1 + d b) v
            + A sin(2 pi x / period + phase) + constant + signal(k)

    Coulomb friction F with its excess e at rest (Stribeck's curve, doi 10.1016/0005-1098(94)90209-7), viscous
    friction B, both unequal by direction (m, b), smoothed below v_0. A simulator that integrates with
    explicit steps h is stable where F h < 2 v_0.
    """

    settings: FloatArray
    signal: FloatArray | None = None

    def __call__(self, k: int, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Acceleration (batch,) at sample k, for positions and velocities (batch,)."""
        s = self.settings.T
        direction = np.sign(velocity)
        curve = 1 + s[S.MOTOR_STATIC] * np.exp(-((velocity / s[S.MOTOR_STRIBECK_SPEED]) ** 2))
        coulomb = s[S.MOTOR_FRICTION] * (1 + direction * s[S.MOTOR_ASYMMETRY]) * curve
        viscous = s[S.VISCOUS] * (1 + direction * s[S.VISCOUS_ASYMMETRY])
        rubbed = coulomb * np.clip(velocity / s[S.MOTOR_SMOOTHING], -1.0, 1.0) + viscous * velocity
        angle = 2 * np.pi * position / s[S.RIPPLE_PERIOD] + s[S.RIPPLE_PHASE]
        ripple = s[S.RIPPLE] * np.sin(angle) + s[S.RIPPLE_START]
        known = 0.0 if self.signal is None else float(self.signal[k])
        return np.asarray(ripple - rubbed + known)


COMMANDS = sorted(S.COMMAND_SIDE)


def inner_settings(simulator: Simulator) -> frozenset[int]:
    """Settings of the forces that a simulator takes within it."""
    if (axis := with_doors(simulator)) is not None:
        return axis.obeyed
    return S.FORCE_SIDE if simulator.force_door else frozenset()


@dataclass(frozen=True)
class SimulatorChain:
    """A simulator at parameter values (parameters,)."""

    simulator: Simulator
    values: FloatArray
    delay_samples: int = 0
    stiffness: tuple[float, float] = (0.0, 0.0)
    contact_damping: float = 0.0
    torque_path: None = None

    def can_inject(self, door: InjectionPoint) -> bool:
        return door in ("command", "output") or (door == "motor_torque" and self.simulator.force_door)

    def injection_states(self, door: InjectionPoint) -> InjectionStates | None:
        return NO_STATES if door == "output" else None

    def torsions(self, commands: FloatArray) -> FloatArray:
        return np.zeros_like(commands)

    def small_responses(self, door: InjectionPoint, signals: FloatArray) -> FloatArray:
        """Change of w (samples, n) for `signals` (samples, n) added at `door`, each held over its sample.

        By convolution with the response to a pulse; of a simulator that is not linear, from where a zero
        command leaves it.
        """
        if door == "output":
            return signals
        pulse, rest = np.zeros(len(signals)), np.zeros(len(signals))
        pulse[0] = 1.0
        if door == "command":
            response = self._respond(pulse, None) - self._respond(rest, None)
        else:
            law, none = (ForceLaw(S.NEUTRAL[None].copy(), signal) for signal in (pulse, rest))
            response = self._respond(rest, law) - self._respond(rest, none)
        return np.asarray(fftconvolve(signals, response[:, None], axes=0)[: len(signals)])

    def _respond(self, command: FloatArray, force: Force | None) -> FloatArray:
        still = np.zeros((len(command), 1 + len(known_inputs(self.simulator))))
        given = with_command(command, still) if still.shape[1] > 1 else command
        return np.asarray(self.simulator.simulate(self.values[None], given, force)[0], np.float64)


def simulate_simulators(
    chains: Sequence[SimulatorChain], settings: FloatArray, inputs: Sequence[FloatArray]
) -> list[tuple[FloatArray, FloatArray]]:
    """w and y (samples, chains) of every record under every chain and its row of `settings` (chains, COUNT).

    The chains are of one simulator; those that the settings give the same command are simulated together.
    """
    simulator, values = chains[0].simulator, np.array([chain.values for chain in chains])
    forces = sorted(inner_settings(simulator))
    rubbing = bool(np.any(settings[:, forces] != S.NEUTRAL[forces]))
    groups: dict[bytes, list[int]] = {}
    for row, ahead in enumerate(settings[:, COMMANDS]):
        groups.setdefault(ahead.tobytes(), []).append(row)
    found = []
    for u in inputs:
        w, y = np.empty((len(chains), len(u))), np.empty((len(chains), len(u)))
        for rows in groups.values():
            command = np.empty(len(u))
            command_side(command_of(u), simulator.sample_rate_hz, settings[rows[0]], command)
            law = ForceLaw(settings[rows]) if rubbing else None
            outputs = np.ascontiguousarray(
                simulator.simulate(values[rows], with_command(command, u), law), np.float64
            )
            for row, output in zip(rows, outputs, strict=True):
                output_side(output, simulator.sample_rate_hz, settings[row], w[row], y[row])
        found.append((np.ascontiguousarray(w.T), np.ascontiguousarray(y.T)))
    return found


class SimulatorBuilder:
    """Builds the chains of one simulator.

    Raises InputError where a parameter's prior is not normal in the coordinate that it is estimated in.
    """

    has_drive_train = False
    said_of_torques: tuple[str, ...] = ()
    gain_row: None = None

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.base_parameters: tuple[Parameter, ...] = tuple(simulator.parameters)
        if not self.base_parameters:
            raise InputError(f"simulator {simulator.name}: no parameter; give at least one to estimate")
        for parameter in self.base_parameters:
            kinds = (type(parameter.prior), type(parameter.transform))
            if kinds not in ((Normal, Identity), (LogNormal, Logarithm)):
                raise InputError(
                    f"simulator {simulator.name}: {parameter.name}: give a Normal prior with Identity, or a "
                    "LogNormal prior with Logarithm"
                )

    @property
    def said_of_structure(self) -> str:
        """What of the simulator was not questioned."""
        if with_doors(self.simulator) is not None:
            return (
                "The simulator's structure was taken as given; only the parameters declared uncertain were "
                "estimated again. Effects were sought on the simulator linearised about its rest, before it, "
                "behind it and where forces may enter; what was found was fitted to the simulator itself."
            )
        return (
            "The simulator's structure was taken as given; only its parameters were estimated again. Effects "
            "were tried before it, behind it and, where it takes forces, as forces: not within it."
        )

    @cached_property
    def start_spreads(self) -> FloatArray:
        """Those of the priors."""
        return np.array([parameter.coordinate_sd for parameter in self.base_parameters])

    def speed_per_gain(self, values: FloatArray) -> FloatArray:
        """One: no parameter is known to scale the speed."""
        return np.ones(len(values))

    def write_base(self, values: FloatArray, settings: FloatArray) -> None:
        """Nothing: limits and dead zones of the simulator are its own."""

    def chain(
        self,
        values: FloatArray,
        resonator: Resonator | None = None,  # noqa: ARG002
        needs_train: bool = True,  # noqa: ARG002
    ) -> SimulatorChain:
        """The simulator at base parameters `values` (base parameters,)."""
        return SimulatorChain(self.simulator, np.array(values))

    def chains(
        self,
        values: FloatArray,
        resonators: Sequence[Resonator | None],  # noqa: ARG002
        needs_train: bool = True,  # noqa: ARG002
    ) -> list[SimulatorChain]:
        """The simulator at every row of `values` (points, base parameters)."""
        return [self.chain(row) for row in values]

    def simulate(
        self,
        chains: Sequence[SimulatorChain],
        settings: FloatArray,
        inputs: Sequence[FloatArray],
        keep_w: bool = False,  # noqa: ARG002
        known: KnownPositions | None = None,  # noqa: ARG002
        followed: Followed | None = None,  # noqa: ARG002
    ) -> list[Signals]:
        return simulate_simulators(chains, settings, inputs)


SPEED_LAG = 1 / 200
"""Of a record: the time over which the speed of the measured output is taken."""

USUAL_FORCE_SHARE = 0.1
"""Of the acceleration of the usual motion: the force at which friction is first tried."""


def simulator_scale(simulator: Simulator, records: Sequence[Record], sigma: float) -> AxisScale:
    """The scale of `simulator` on `records`, with noise `sigma` in output units.

    Speeds and accelerations are those of the measured motion: with its root mean square speed v and standard
    deviation d, a sine would have the acceleration v^2 / d.
    """
    commanded = max(float(np.abs(record.u).max()) for record in records)
    travel = max(float(np.ptp(record.y)) for record in records)
    squares, deviations = [], []
    for record in records:
        lag = max(1, round(SPEED_LAG * len(record)))
        squares.append(np.mean(((record.y[lag:] - record.y[:-lag]) * record.sample_rate_hz / lag) ** 2))
        deviations.append(np.std(record.y))
    speed, deviation = float(np.sqrt(np.mean(squares))), float(np.mean(deviations))
    if commanded == 0 or speed == 0:
        raise InputError(
            f"simulator {simulator.name}: the command is zero or the output constant throughout; give "
            "records that move"
        )
    usual, axis = USUAL_FORCE_SHARE * speed**2 / deviation, with_doors(simulator)
    stiffness = (usual / (4 * sigma), usual / sigma) if axis is None else axis.stiffness
    return AxisScale(
        rate=simulator.sample_rate_hz,
        duration=max(record.duration_s for record in records),
        travel=travel,
        speed=commanded,
        sigma=sigma,
        first_mode_hz=simulator.sample_rate_hz / 10,
        stiffness=stiffness,
        velocity_gain=1.4 * speed / commanded,
        units=simulator.units,
        shortest=shortest_period([record.y for record in records]),
    )
