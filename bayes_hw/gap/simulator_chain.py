"""Any simulator under the catalogue's effects: before it, behind it, and as a force within it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap import settings as S  # noqa: N812
from bayes_hw.gap.chain import Resonator
from bayes_hw.gap.effects.effect import Door
from bayes_hw.gap.force_law import ForceLaw
from bayes_hw.gap.scale import AxisScale
from bayes_hw.gap.signal_kernel import command_side, output_side
from bayes_hw.gap.simulator import Simulator
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Normal
from bayes_hw.record import Record

FORCES = sorted(S.FORCE_SIDE)


@dataclass(frozen=True)
class SimulatorChain:
    """A simulator at parameter values (parameters,)."""

    simulator: Simulator
    values: FloatArray
    delay_samples: int = 0
    stiffness: tuple[float, float] = (0.0, 0.0)
    contact_damping: float = 0.0

    def simulate(self, u: FloatArray, settings: FloatArray) -> tuple[FloatArray, FloatArray]:
        """w and y (samples,) of the command u (samples,) under `settings` (see `bayes_hw.gap.settings`)."""
        rate = self.simulator.sample_rate_hz
        command = np.empty(len(u))
        command_side(np.ascontiguousarray(u, np.float64), rate, settings, command)
        rubbing = bool(np.any(settings[FORCES] != S.NEUTRAL[FORCES]))
        simulated = self._respond(command, ForceLaw(settings[None]) if rubbing else None)
        w, y = np.empty(len(u)), np.empty(len(u))
        output_side(simulated, rate, settings, w, y)
        return w, y

    def _respond(self, command: FloatArray, force: ForceLaw | None) -> FloatArray:
        found = self.simulator.simulate(self.values[None], command, force)
        return np.ascontiguousarray(found[0], np.float64)

    def impulse_response(self, door: Door, samples: int) -> FloatArray:
        """Response (samples,) of w to one sample of unit signal, held over the sample, at `door`.

        Of a simulator that is not linear, its response from where a command of zero leaves it.
        """
        pulse, rest = np.zeros(samples), np.zeros(samples)
        pulse[0] = 1.0
        if door == "output":
            return pulse
        if door == "command":
            return self._respond(pulse, None) - self._respond(rest, None)
        neutral = S.NEUTRAL[None]
        return self._respond(rest, ForceLaw(neutral, pulse)) - self._respond(rest, ForceLaw(neutral, rest))


class SimulatorBuilder:
    """Builds the chains of one simulator.

    Raises InputError where a parameter's prior is not normal in the coordinate that it is estimated in.
    """

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

    @cached_property
    def start_spreads(self) -> FloatArray:
        """Those of the priors."""
        priors = [parameter.prior for parameter in self.base_parameters]
        return np.array([p.log_sd if isinstance(p, LogNormal) else p.sd for p in priors])  # type: ignore[attr-defined]

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
    usual = USUAL_FORCE_SHARE * speed**2 / deviation
    return AxisScale(
        rate=simulator.sample_rate_hz,
        duration=max(record.duration_s for record in records),
        travel=travel,
        speed=commanded,
        sigma=sigma,
        first_mode_hz=simulator.sample_rate_hz / 10,
        stiffness=(usual / (4 * sigma), usual / sigma),
        velocity_gain=1.4 * speed / commanded,
        units=simulator.units,
    )
