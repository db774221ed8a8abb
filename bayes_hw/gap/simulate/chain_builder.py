"""Chains from base parameter vectors: the drive train behind G, read back or stated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.builder import Followed, KnownPositions, Signals
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.chain_batch import simulate_chains
from bayes_hw.gap.simulate.continuous_poles import ContinuousPoles, continuous_poles
from bayes_hw.gap.simulate.drive_train import DriveTrain, UnknownTrain, realise
from bayes_hw.gap.simulate.lru_cache import LruCache
from bayes_hw.gap.simulate.nominal_prior import STATIC_SPREAD, base_parameters
from bayes_hw.gap.simulate.path import Path
from bayes_hw.gap.simulate.physical_train import PhysicalTrain
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

STATIC_COUNT = GAIN = 3
"""Base parameters before those of G: both limits and the dead zone; the row of the gain, its first."""

KEPT = 24
"""Latest results of each kind."""

OfG: TypeAlias = tuple[float, ...]
"""The base parameters that G depends on."""

AnyTrain: TypeAlias = DriveTrain | PhysicalTrain | UnknownTrain
Asked: TypeAlias = tuple[OfG, Resonator | None, bool]


class ChainBuilder:
    """Builds chains from base parameter vectors (those of `AxisParameters`, dominant)."""

    has_drive_train = True

    def __init__(self, model: HammersteinWiener) -> None:
        self.model = model
        self.axis = AxisParameters(model)
        self._linears: LruCache[OfG, tuple[ContinuousPoles, float]] = LruCache(KEPT)
        self._trains: LruCache[OfG, AnyTrain] = LruCache(KEPT)
        self._torques: LruCache[tuple[OfG, Resonator | None], Path] = LruCache(KEPT)
        self._chains: LruCache[Asked, Chain] = LruCache(KEPT)
        self.base_parameters = base_parameters(self.axis)
        self.start_spreads = STATIC_SPREAD
        self.nominal_of_g = tuple(self.axis.nominal[STATIC_COUNT:].tolist())
        system = self._linear(self.nominal_of_g)[0]
        self.stated = None if model.physical is None else PhysicalTrain.of(model.physical, system)
        self._read = None if self.stated is not None else realise(system, model.sample_rate_hz)
        self.reference: DriveTrain | PhysicalTrain | None = self.stated or self._read

        nominal = self.axis.nominal[None]
        unscaled = self._speed_of_unit_gain(nominal)
        self.gain_row = GAIN if np.isfinite(unscaled[0]) and unscaled[0] != 0 else None
        self._nominal_speed_of_unit_gain = unscaled

    @property
    def said_of_structure(self) -> str:
        """What of the base model was not questioned."""
        return (
            "The structure of the base model (order and delay of G, roots other than the dominant modes) was "
            "taken as given; only its parameters were estimated again."
        )

    @property
    def said_of_torques(self) -> tuple[str, ...]:
        """Which drive train they act in."""
        if self.stated is not None:
            return ("torques act in the drive train that the model states (physical); its G stays as given",)
        if self.reference is not None:
            return (
                "the drive train (motor, spring, load, loop) was read back from the model's G; torques act "
                "in it",
            )
        return (
            "no drive train could be read back from the model's G, which answers within the sample: effects "
            "that need one (friction, ripple, play, springs, wind) were not looked for in it",
        )

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
        settings[S.LOWER], settings[S.UPPER], settings[S.DEAD_ZONE] = values[:STATIC_COUNT]

    def train(self, values: FloatArray) -> AnyTrain:
        """The drive train behind G at base parameters `values` (parameters,).

        The latest few are kept: most derivatives leave G as it is.
        """
        return self._train(tuple(values[STATIC_COUNT:].tolist()))

    def chain(
        self, values: FloatArray, resonator: Resonator | None = None, needs_train: bool = True
    ) -> Chain:
        """The linear block at base parameters `values` (parameters,), with a resonator on the load if given.

        Without `needs_train` the torque paths are those of the nominal model, for effects without torques.
        """
        return self.chains(values[None], [resonator], needs_train)[0]

    def chains(
        self, values: FloatArray, resonators: Sequence[Resonator | None], needs_train: bool = True
    ) -> list[Chain]:
        """`chain` for every row of `values` (points, parameters) and its resonator."""
        present = [r if r is not None and r.inertia_ratio != 0 else None for r in resonators]
        rows = [tuple(row) for row in values[:, STATIC_COUNT:].tolist()]
        asked = [(of_g, r, needs_train) for of_g, r in zip(rows, present, strict=True)]
        known = {key: self._chains[key] for key in dict.fromkeys(asked)}
        missing = [key for key, chain in known.items() if chain is None]
        linears = self._linears_at({of_g for of_g, _, _ in missing})
        for key in missing:
            known[key] = self._chains[key] = self._built(linears[key[0]], *key)
        return [chain for chain in (known[key] for key in asked) if chain is not None]

    def simulate(
        self,
        chains: Sequence[Chain],
        settings: FloatArray,
        inputs: Sequence[FloatArray],
        keep_w: bool = False,
        known: KnownPositions | None = None,
        followed: Followed | None = None,
    ) -> list[Signals]:
        return [(w, y) for w, y in simulate_chains(chains, settings, inputs, keep_w, known, followed)]

    def _built(
        self, linear: tuple[ContinuousPoles, float], of_g: OfG, resonator: Resonator | None, needs_train: bool
    ) -> Chain:
        system, direct = linear
        driving = of_g if needs_train else self.nominal_of_g
        train = self._train(driving)
        torque_path = self._torque_path(driving, resonator)
        return Chain(
            train.command_path(system, resonator, torque_path),
            torque_path,
            direct,
            self.model.linear.delay_samples,
            self.model.sample_rate_hz,
            train.stiffness,
            train.contact_damping,
        )

    def _train(self, of_g: OfG) -> AnyTrain:
        known = self._trains[of_g]
        if known is None:
            found: DriveTrain | PhysicalTrain | None = self.stated
            if self._read is not None:
                found = realise(self._linear(of_g)[0], self.model.sample_rate_hz, self._read)
            known = self._trains[of_g] = found or UnknownTrain()
        return known

    def _torque_path(self, of_g: OfG, resonator: Resonator | None) -> Path:
        known = self._torques[of_g, resonator]
        if known is None:
            known = self._train(of_g).torque_path(self._linear(of_g)[0], resonator)
            self._torques[of_g, resonator] = known
        return known

    def _linear(self, of_g: OfG) -> tuple[ContinuousPoles, float]:
        return self._linears[of_g] or self._linears_at([of_g])[of_g]

    def _linears_at(self, asked: Iterable[OfG]) -> dict[OfG, tuple[ContinuousPoles, float]]:
        """G in continuous time and its direct term; it does not depend on the static parameters."""
        known = {of_g: self._linears[of_g] for of_g in asked}
        missing = [of_g for of_g, linear in known.items() if linear is None]
        if missing:
            batch = self.axis.linear_batch(np.array([[*[0.0] * STATIC_COUNT, *of_g] for of_g in missing]).T)
            real, pairs, direct = batch.residues()
            of_all = (batch.real_poles, batch.pair_poles, real, pairs)
            poles, pair_poles, residues, pair_residues = (np.ascontiguousarray(part.T) for part in of_all)
            for i, of_g in enumerate(missing):
                system = continuous_poles(
                    poles[i], pair_poles[i], residues[i], pair_residues[i], self.model.sample_rate_hz
                )
                known[of_g] = self._linears[of_g] = system, float(direct[i])
        return {of_g: linear for of_g, linear in known.items() if linear is not None}
