"""Many draws of one axis, in the form that a controller designer computes with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.controller_kernel import LoopSignals, PositionLoop
from bayes_hw.record import Units

Roots = TypeVar("Roots", FloatArray, ComplexArray)

SLOWEST = 1e-5
"""Corner frequency, over the sample rate, below which a real pole is taken as an integrator: a tenth of the
lowest frequency at which loops are looked at."""

GRID_POINTS = 100
"""Frequencies from which a response is kept, to be asked for again."""


class EffectInLoop(Protocol):
    """Draws of an axis with an effect that its linear part does not hold, simulated in a position loop."""

    def take(self, index: IntArray) -> EffectInLoop:
        """The draws of the given indices."""
        ...

    def simulate(self, loop: PositionLoop) -> LoopSignals:
        """Command, w and output without noise."""
        ...


@dataclass(frozen=True, eq=False)
class AxisDraws:
    """y = n(G(z) f(u)) for `draws` parameter vectors, G by its poles and residues.

        G(z) = z^-delay_samples (direct + sum_i r_i / (z - p_i))

    `real_poles`, `real_residues` (n_real, draws); `pair_poles`, `pair_residues` (n_pairs, draws) complex, one
    of each pair; `direct`, `lower`, `upper` (limits of v, input units) and `half_width` (dead zone, output
    units) (draws,). `gains` are c1, c2, c3 of the static blocks. Residues are output units per input unit.
    Simulations in time are those of `effect`, where there is one, which holds the same draws.
    """

    sample_rate_hz: float
    units: Units
    real_poles: FloatArray
    pair_poles: ComplexArray
    real_residues: FloatArray
    pair_residues: ComplexArray
    direct: FloatArray
    delay_samples: int
    lower: FloatArray
    upper: FloatArray
    half_width: FloatArray
    gains: tuple[float, float, float]
    effect: EffectInLoop | None = None

    @property
    def count(self) -> int:
        return len(self.direct)

    @property
    def poles(self) -> ComplexArray:
        """Every pole (poles, draws), the real ones first, conjugates last."""
        real = self.real_poles.astype(np.complex128)
        return np.concatenate([real, self.pair_poles, self.pair_poles.conj()])

    @property
    def residues(self) -> ComplexArray:
        """The residues of `poles`."""
        real = self.real_residues.astype(np.complex128)
        return np.concatenate([real, self.pair_residues, self.pair_residues.conj()])

    @property
    def loop_gain(self) -> float:
        """What the static blocks contribute to a loop where neither bends: c1 times the larger of c2, c3."""
        c1, c2, c3 = self.gains
        return c1 * max(c2, c3)

    @classmethod
    def of_values(cls, axis: AxisParameters, values: FloatArray) -> AxisDraws:
        """The axes of every column of `values` (parameters, draws), poles slower than `SLOWEST` added to the
        integrator: that of an identified axis may be split between both, with opposite signs.

        Raises InputError unless G has an integrator: a position loop is closed around a velocity drive.
        """
        batch = axis.linear_batch(values).separated()
        real, pairs, direct = batch.residues()
        if axis.model.linear.integrator_index is None:
            raise InputError(
                f"{axis.model.name}: G has no integrator, so that a velocity command does not move the axis; "
                "design is for position loops around velocity drives"
            )
        real_poles, real = _with_slow_poles(batch.real_poles, real)
        gains = axis.model.normalization
        return cls(
            sample_rate_hz=axis.model.sample_rate_hz,
            units=axis.model.units,
            real_poles=real_poles,
            pair_poles=batch.pair_poles,
            real_residues=real,
            pair_residues=pairs,
            direct=direct,
            delay_samples=axis.model.linear.delay_samples,
            lower=values[0],
            upper=values[1],
            half_width=values[2],
            gains=(gains.c1, gains.c2, gains.c3),
        )

    @classmethod
    def nominal(cls, posterior: Posterior) -> AxisDraws:
        """The point estimate of `posterior` as one draw."""
        axis = posterior.axis
        return cls.of_values(axis, posterior.point_estimate[: len(axis.parameters), None])

    @classmethod
    def of_posterior(cls, posterior: Posterior, values: FloatArray) -> AxisDraws:
        """The axes of `values` (draws, parameters) as `Posterior.draws` gives them."""
        axis = posterior.axis
        return cls.of_values(axis, np.ascontiguousarray(values[:, : len(axis.parameters)].T))

    def take(self, index: IntArray) -> AxisDraws:
        """The draws of the given indices."""
        return replace(
            self,
            real_poles=self.real_poles[:, index],
            pair_poles=self.pair_poles[:, index],
            real_residues=self.real_residues[:, index],
            pair_residues=self.pair_residues[:, index],
            direct=self.direct[index],
            lower=self.lower[index],
            upper=self.upper[index],
            half_width=self.half_width[index],
            effect=None if self.effect is None else self.effect.take(index),
        )

    @cached_property
    def _known(self) -> list[tuple[bytes, ComplexArray]]:
        """The response last computed on a grid, after the bytes of its frequencies: loops of many controllers
        ask for the same."""
        return []

    @cached_property
    def grids(self) -> dict[float, FloatArray]:
        """Frequencies for loops of these draws, by the controller's rate."""
        return {}

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """G at every frequency, shape (draws, frequencies), in output units per input unit; read-only."""
        if len(frequency_hz) < GRID_POINTS:
            return self._response(frequency_hz)
        grid, found = self._known[0] if self._known else (b"", None)
        key = frequency_hz.tobytes()
        if found is None or grid != key:
            found = self._response(frequency_hz)
            found.flags.writeable = False
            self._known[:] = [(key, found)]
        return found

    def _response(self, frequency_hz: FloatArray) -> ComplexArray:
        z = np.exp(2j * np.pi * frequency_hz / self.sample_rate_hz)
        found = np.repeat(self.direct[:, None].astype(np.complex128), len(z), axis=1)
        for pole, residue in zip(self.real_poles, self.real_residues, strict=True):
            found += residue[:, None] / (z - pole[:, None])
        for pole, residue in zip(self.pair_poles, self.pair_residues, strict=True):
            found += _pair_response(pole[:, None], residue[:, None], z)
        return np.asarray(found * z ** (-self.delay_samples), dtype=np.complex128)

    def response_at(self, index: IntArray, frequency_hz: FloatArray) -> ComplexArray:
        """G of draw index[i] at frequency_hz[i], shape (points,)."""
        z = np.exp(2j * np.pi * frequency_hz / self.sample_rate_hz)
        found = self.direct[index].astype(np.complex128)
        for pole, residue in zip(self.real_poles, self.real_residues, strict=True):
            found += residue[index] / (z - pole[index])
        for pole, residue in zip(self.pair_poles, self.pair_residues, strict=True):
            found += _pair_response(pole[index], residue[index], z)
        return np.asarray(found * z ** (-self.delay_samples), dtype=np.complex128)

    def velocity_gain(self) -> FloatArray:
        """Steady output velocity per unit of v, (draws,)."""
        return self.real_residues[self.integrator] * self.sample_rate_hz

    @property
    def integrator(self) -> int:
        """Row of `real_poles` that is the pole at z = 1."""
        return int(np.argmin(np.abs(self.real_poles[:, 0] - 1)))

    def equivalent_delay(self, frequency_hz: float) -> FloatArray:
        """Lag of G beyond the 90 degrees of its integrator at `frequency_hz`, in s, (draws,)."""
        lag = -np.angle(self.response(np.array([frequency_hz]))[:, 0]) - np.pi / 2
        return np.mod(lag + np.pi / 2, 2 * np.pi) / (2 * np.pi * frequency_hz) - 0.25 / frequency_hz

    def held(self, ratio: int) -> AxisDraws:
        """The axis as seen by a controller that acts on every `ratio`-th sample and holds its command
        between.

        Exact: with delay = a ratio + b, 0 <= b < ratio, and S_m(p) = 1 + p + ... + p^(m-1), a pole p with
        residue r becomes p^ratio with r S_ratio(p) p^(ratio - b) after a + 1 slow samples and a direct term
        r S_(ratio-b)(p) when b > 0; r S_ratio(p) after a when b = 0.
        """
        if ratio == 1:
            return self
        whole, rest = divmod(self.delay_samples, ratio)
        real_sum, pair_sum = _geometric(self.real_poles, ratio), _geometric(self.pair_poles, ratio)
        real_residues, pair_residues = self.real_residues * real_sum, self.pair_residues * pair_sum
        direct, delay = self.direct, whole
        if rest:
            part = ratio - rest
            real_early = self.real_residues * _geometric(self.real_poles, part)
            pair_early = self.pair_residues * _geometric(self.pair_poles, part)
            direct = direct + real_early.sum(axis=0) + 2 * pair_early.real.sum(axis=0)
            real_residues = real_residues * self.real_poles**part
            pair_residues = pair_residues * self.pair_poles**part
            delay = whole + 1
        return replace(
            self,
            sample_rate_hz=self.sample_rate_hz / ratio,
            real_poles=self.real_poles**ratio,
            pair_poles=self.pair_poles**ratio,
            real_residues=real_residues,
            pair_residues=pair_residues,
            direct=direct,
            delay_samples=delay,
        )


def _with_slow_poles(poles: FloatArray, residues: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Real poles and residues, both (real poles, draws), the slowest poles added to the integrator, which
    stands at one: where it had to be put apart from another, it does not."""
    integrator = int(np.argmin(np.abs(poles[:, 0] - 1)))
    is_slow = np.abs(poles - 1) < 2 * np.pi * SLOWEST
    is_slow[integrator] = False
    own = np.where(is_slow, 0.0, residues)
    own[integrator] += np.where(is_slow, residues, 0.0).sum(axis=0)
    moved = poles.copy()
    moved[integrator, is_slow.any(axis=0)] = 1.0
    return moved, own


def _pair_response(pole: ComplexArray, residue: ComplexArray, z: ComplexArray) -> ComplexArray:
    """r / (z - p) + r* / (z - p*) as one real second-order section."""
    numerator = 2 * residue.real * z - 2 * (residue * pole.conj()).real
    return np.asarray(numerator / (z * z - 2 * pole.real * z + np.abs(pole) ** 2), dtype=np.complex128)


def _geometric(poles: Roots, terms: int) -> Roots:
    """1 + p + ... + p^(terms - 1)."""
    total = np.ones_like(poles)
    for _ in range(terms - 1):
        total = total * poles + 1
    return total
