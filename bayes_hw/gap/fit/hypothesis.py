"""A hypothesis about the gap: the base model with some effects of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.case.simulator import command_of
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.builder import Builder, Followed, KnownPositions, SignalChain, Signals
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Transform

BASE_DERIVATIVE_STEP = 3e-4

FOLLOWED_DERIVATIVE_STEP = 0.1
"""Largest in prior standard deviations where the motion is followed: some of its chaos is left."""

LARGEST_STRAIN = 4.0
"""Prior standard deviations; base parameters farther from the nominal model stand for something else."""


@dataclass(frozen=True)
class Hypothesis:
    """The base model of `builder` with `effects`, for `inputs`: one array a record, of commands (samples,) or
    with the known inputs of a simulator (samples, columns).

    `known` says where ripple acts under those commands, if not at the simulated position, `followed` what the
    simulation is corrected by at every sample, if anything, `unread` which samples of the records were not
    measured (a mask a record), None where all were, and `free_levels` which records (by number) count their
    angles from a level that was estimated.
    """

    builder: Builder
    scale: AxisScale
    inputs: Sequence[FloatArray]
    effects: tuple[Effect, ...] = ()
    known: KnownPositions | None = None
    followed: Followed | None = None
    unread: tuple[BoolArray, ...] | None = None
    free_levels: tuple[int, ...] = ()
    parameters: tuple[Parameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        effects = [parameter for effect in self.effects for parameter in effect.parameters(self.scale)]
        object.__setattr__(self, "parameters", (*self.builder.base_parameters, *effects))

    @property
    def commands(self) -> list[FloatArray]:
        """Of every record (samples,)."""
        return [command_of(given) for given in self.inputs]

    @property
    def base_count(self) -> int:
        return len(self.builder.base_parameters)

    @cached_property
    def effect_rows(self) -> tuple[slice, ...]:
        """Where the parameters of every effect stand."""
        counts = [len(effect.parameters(self.scale)) for effect in self.effects]
        ends = np.cumsum([self.base_count, *counts]).tolist()
        return tuple(slice(start, stop) for start, stop in pairwise(ends))

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(effect.label for effect in self.effects)

    def with_effect(self, effect: Effect) -> Hypothesis:
        """The same with one effect more."""
        return replace(self, effects=(*self.effects, effect))

    @property
    def torques(self) -> bool:
        """Whether the drive train behind G matters to the simulated output."""
        return any(effect.needs_drive_train for effect in self.effects)

    def settings(self, values: FloatArray, chain: SignalChain) -> FloatArray:
        """The chain simulator's settings at parameter values (parameters,) of the linear block `chain`."""
        settings = S.NEUTRAL.copy()
        settings[S.MOTOR_STIFFNESS], settings[S.LOAD_STIFFNESS] = chain.stiffness
        settings[S.CONTACT_DAMPING] = chain.contact_damping
        self.builder.write_base(values, settings)
        for effect, rows in zip(self.effects, self.effect_rows, strict=True):
            effect.apply(values[rows], settings, self.scale)
        return settings

    def chain(self, values: FloatArray) -> SignalChain:
        """The linear block at parameter values (parameters,)."""
        return self.builder.chain(values[: self.base_count], self._resonator(values), self.torques)

    def _chains(self, values: FloatArray) -> Sequence[SignalChain]:
        """The linear blocks at parameter values (n, parameters)."""
        resonators = [self._resonator(point) for point in values]
        return self.builder.chains(values[:, : self.base_count], resonators, self.torques)

    def _resonator(self, values: FloatArray) -> Resonator | None:
        """That of the last effect that hangs one on the drive train."""
        resonator = None
        for effect, rows in zip(self.effects, self.effect_rows, strict=True):
            resonator = effect.resonator(values[rows]) or resonator
        return resonator

    def simulate(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None = None, drift: bool = True
    ) -> list[FloatArray]:
        """y of every record at parameter values (parameters,); of `inputs` where given.

        Without `drift` the encoder's drift is left out: the angle of the axis.
        """
        return [y[:, 0] for y in self.simulate_batch(values[None], inputs, drift)]

    def simulate_batch(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None = None, drift: bool = True
    ) -> list[FloatArray]:
        """y (samples, n) of every record at n parameter vectors (n, parameters), as `simulate` does."""
        return [y for _, y in self._signals(values, inputs, drift, keep_w=False)]

    def simulate_signals(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None = None, drift: bool = True
    ) -> list[tuple[FloatArray, FloatArray]]:
        """(w, y) of every record at parameter values (parameters,)."""
        return [(w[:, 0], y[:, 0]) for w, y in self._signals(values[None], inputs, drift, keep_w=True)]

    def motion(self, values: FloatArray) -> tuple[list[FloatArray], float]:
        """w (samples,) of every record, and the dead zone, inside which the encoder sees no motion."""
        dead_zone = self.settings(values, self.chain(values))[S.DEAD_ZONE]
        return [w for w, _ in self.simulate_signals(values)], float(dead_zone)

    def axes(self, values: FloatArray) -> tuple[Sequence[SignalChain], FloatArray]:
        """The linear blocks at parameter values (n, parameters), and the settings (n, COUNT) of each."""
        chains = self._chains(values)
        return chains, np.array([self.settings(*pair) for pair in zip(values, chains, strict=True)])

    def _signals(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None, drift: bool, keep_w: bool
    ) -> list[Signals]:
        chains, settings = self.axes(values)
        if not drift:
            settings[:, [S.DRIFT_RATE, S.DRIFT_SETTLING]] = 0.0
        if inputs is not None:
            return self.builder.simulate(chains, settings, inputs, keep_w)
        return self.builder.simulate(chains, settings, self.inputs, keep_w, self.known, self.followed)

    def to_values(self, coordinates: FloatArray) -> FloatArray:
        """Parameter values of unbounded coordinates, both (..., parameters).

        The coordinate of the gain of a Hammerstein-Wiener axis is the logarithm of the steady speed per unit
        of command: behind an integrator the data fix that far better than the gain, which follows the modes,
        and in the gain's own coordinate the posterior is a curved ridge.
        """
        values = self._with_speed_for_gain(coordinates)
        row = self.builder.gain_row
        if row is not None:
            values[..., row] /= self._speed_per_gain(values)
        return values

    def to_coordinates(self, values: FloatArray) -> FloatArray:
        """Unbounded coordinates of parameter values, both (..., parameters): the inverse of `to_values`."""
        row = self.builder.gain_row
        if row is not None:
            values = values.copy()
            values[..., row] *= self._speed_per_gain(values)
        coordinates = np.empty_like(values)
        for transform, rows in self._transforms:
            coordinates[..., rows] = transform.to_coordinate(values[..., rows])
        return coordinates

    def _with_speed_for_gain(self, coordinates: FloatArray) -> FloatArray:
        """Parameter values, in the place of the gain the speed that it gives, relative to the nominal's."""
        values = np.empty_like(coordinates)
        for transform, rows in self._transforms:
            values[..., rows] = transform.to_value(coordinates[..., rows])
        return values

    @cached_property
    def _transforms(self) -> list[tuple[Transform, slice]]:
        """Transforms with the rows of neighbouring parameters that have them.

        Slices: to index by a list lets go of the interpreter, and threads side by side wait for it.
        """
        runs: list[tuple[Transform, slice]] = []
        for row, parameter in enumerate(self.parameters):
            start = row
            if runs and runs[-1][0] == parameter.transform:
                start = runs.pop()[1].start
            runs.append((parameter.transform, slice(start, row + 1)))
        return runs

    def _speed_per_gain(self, values: FloatArray) -> FloatArray:
        base = values[..., : self.base_count]
        flat = self.builder.speed_per_gain(base.reshape(-1, self.base_count))
        return np.asarray(flat.reshape(base.shape[:-1]))

    def prior_deviations(self, coordinates: FloatArray) -> FloatArray:
        """Deviations (..., parameters) from the prior means in prior standard deviations.

        The priors are independent in the logarithm of the gain itself, not in that of the speed.
        """
        row = self.builder.gain_row
        if row is not None:
            speed_per_gain = self._speed_per_gain(self._with_speed_for_gain(coordinates))
            coordinates = coordinates.copy()
            coordinates[..., row] -= np.log(np.abs(speed_per_gain))
        return (coordinates - self.prior_means) / self.prior_sds

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """Logarithm of the prior density (...,) at coordinates (..., parameters), up to a constant."""
        return np.asarray(-0.5 * np.sum(self.prior_deviations(coordinates) ** 2, axis=-1))

    def prior_jacobian(self, coordinates: FloatArray) -> FloatArray:
        """Derivatives (deviations, parameters) of `prior_deviations` at `coordinates` (parameters,)."""
        steps = np.diag(self.derivative_steps)
        difference = self.prior_deviations(coordinates + steps) - self.prior_deviations(coordinates - steps)
        return np.asarray(difference.T / (2 * self.derivative_steps))

    @cached_property
    def derivative_steps(self) -> FloatArray:
        """Finite-difference step of every coordinate."""
        largest = np.inf if self.followed is None else FOLLOWED_DERIVATIVE_STEP
        coarse = [min(effect.derivative_step, largest) for effect in self.effects if effect.chaotic]
        relative = [max([BASE_DERIVATIVE_STEP, *coarse])] * self.base_count
        for effect, rows in zip(self.effects, self.effect_rows, strict=True):
            relative += [min(effect.derivative_step, largest)] * (rows.stop - rows.start)
        return np.array(relative) * self.prior_sds

    @cached_property
    def prior_means(self) -> FloatArray:
        """Mean of every prior in coordinates: all are normal there."""
        return self.to_coordinates(
            np.array([float(p.prior.quantile(np.asarray(0.5))) for p in self.parameters])
        )

    @cached_property
    def prior_sds(self) -> FloatArray:
        """Standard deviation of every prior in coordinates."""
        return np.array([parameter.coordinate_sd for parameter in self.parameters])


def held_within_prior(hypothesis: Hypothesis, drawn: FloatArray, centre: FloatArray) -> FloatArray:
    """Coordinates `drawn` (n, parameters) about `centre` (parameters,), moved towards it where a base
    parameter would be farther than LARGEST_STRAIN prior standard deviations off."""
    deviations = np.abs(hypothesis.prior_deviations(drawn)[:, : hypothesis.base_count])
    farthest = np.max(deviations, axis=1, keepdims=True)
    return np.asarray(centre + (drawn - centre) * (LARGEST_STRAIN / np.maximum(farthest, LARGEST_STRAIN)))


@dataclass(frozen=True)
class Candidate:
    """A start for an effect: parameter values and the reduction it promises."""

    effect: Effect
    values: tuple[float, ...]
    reduction: float
