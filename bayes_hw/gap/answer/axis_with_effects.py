"""What the commands that design with a corrected.json take: a posterior of the linear part, and of every draw
the answer's effects."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.answer.words_of_answer import words_of_answer
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters

if TYPE_CHECKING:
    from bayes_hw.control.axis_draws import EffectInLoop

OUTPUT_DRAWS = 24
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class ExpectedInformation:
    """`draws` (draws, size) of coordinates about `location` (size,), those from `first` on of the effects,
    all where there are none; `sigma` of the noise. `angles` gives what so many draws answer a command with,
    (draws, samples), `tangents` (size, samples) the derivatives at the estimate."""

    draws: FloatArray
    location: FloatArray
    first: int
    sigma: float
    angles: Callable[[FloatArray, int], FloatArray]
    tangents: Callable[[FloatArray], FloatArray]

    def outputs(self, u: FloatArray) -> FloatArray:
        """Angles (draws, samples) that draws of the axis answer with."""
        return self.angles(u, OUTPUT_DRAWS)

    def nats(self, u: FloatArray) -> float:
        """Half the fall of the log-determinant of the covariance of the effects' parameters."""
        after, before = self._covariances(u)
        return 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])

    def narrowing(self, u: FloatArray) -> float:
        """Geometric mean of the effects' standard deviations after over before."""
        after, before = self._covariances(u)
        return float(np.exp(0.5 * np.mean(np.log(np.diag(after) / np.diag(before)))))

    @cached_property
    def _known(self) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of the coordinates and the inverse of their correlation, ridged."""
        deviation = self.draws.std(axis=0)
        deviation[deviation == 0] = 1.0
        scaled = (self.draws - self.location) / deviation
        correlation = scaled.T @ scaled / len(scaled)
        return deviation, np.linalg.inv(correlation + RIDGE * np.eye(len(correlation)))

    def _covariances(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        deviation, precision = self._known
        rows = np.nan_to_num(self.tangents(u) * deviation[:, None] / self.sigma)
        after, before = np.linalg.inv(precision + rows @ rows.T), np.linalg.inv(precision)
        first = self.first if self.first < len(deviation) else 0
        small = RIDGE * np.eye(len(deviation) - first)
        return after[first:, first:] + small, before[first:, first:] + small


@dataclass(frozen=True, eq=False)
class AxisWithEffects(ABC):
    """Draws of `posterior`, and the effects of every draw in the same order; `answer`, `probability` and
    `next_experiment` as in the verdict; `motion` is what its records did."""

    posterior: Posterior
    answer: tuple[str, ...]
    probability: Mapping[str, float]
    motion: Mapping[str, Any]
    next_experiment: str

    @property
    @abstractmethod
    def simulated(self) -> bool:
        """Whether any effect of the answer changes the response."""

    @abstractmethod
    def loop_of(self, values: FloatArray) -> EffectInLoop:
        """The effects of the draws whose parameter vectors are `values` (draws, parameters)."""

    @abstractmethod
    def nominal_loop(self) -> EffectInLoop:
        """The effects of the estimate."""

    @abstractmethod
    def expected_information(self) -> ExpectedInformation:
        """What a command is expected to tell of the effects."""

    @property
    def words(self) -> str:
        """What was missing and is in the model, with how sure that is."""
        return words_of_answer(self.answer, self.probability) or "no further effect"

    def _places(self, values: FloatArray) -> list[int]:
        """Which draws have the parameter vectors `values` (draws, parameters)."""
        flat = self.posterior.values.reshape(-1, self.posterior.values.shape[-1])
        place = {row.tobytes(): i for i, row in enumerate(flat)}
        return [place[np.ascontiguousarray(row).tobytes()] for row in values]


def said_in(
    data: Mapping[str, Any], largest: float, travel: float
) -> tuple[tuple[str, ...], dict[str, float], dict[str, Any], str]:
    """Answer, probability, motion and next experiment of the content of corrected.json; where it is silent
    the motion is up to the `largest` command and over the `travel`."""
    plain = {"velocity": largest, "acceleration": largest, "stroke": [-travel / 2, travel / 2]}
    return (
        tuple(str(label) for label in data.get("answer", ())),
        {str(k): float(v) for k, v in dict(data.get("probability", {})).items()},
        {**plain, **dict(data.get("motion", {}))},
        str(data.get("next_experiment") or ""),
    )


def as_drawn(axis: AxisParameters) -> FloatArray:
    """The parameters (parameters,) of an axis as they are: where a sampler would begin at a small dead zone,
    none."""
    values = axis.nominal.copy()
    values[axis.names.index("dead_zone.half_width")] = axis.model.dead_zone.half_width
    return values


def commanded_in(data: Mapping[str, Any]) -> tuple[float, float] | None:
    """The smallest and the largest command of the records behind a corrected.json; None where it is silent.
    Raises InputError where it says something else."""
    stored = dict(data.get("motion", {})).get("commanded")
    if stored is None:
        return None
    try:
        low, high = map(float, stored)
    except (TypeError, ValueError):
        raise InputError("motion.commanded: must be two numbers; diagnose again") from None
    return low, high


def posterior_of_draws(
    axis: AxisParameters,
    sigma: float,
    draws: FloatArray,
    estimate: FloatArray,
    commanded: tuple[float, float] | None = None,
) -> Posterior:
    """Of `draws` (draws, parameters) of an axis whose noise is white, of standard deviation `sigma`, about an
    `estimate` (parameters,); `commanded` as in `Posterior`."""
    white = noise_parameters(NoiseEstimate(sigma, np.zeros(0)), axis.model.units.output)
    columns = np.column_stack([draws, np.full(len(draws), sigma)])
    return Posterior(
        axis,
        white,
        columns[None, :, None, :],
        np.zeros((1, len(draws), 1)),
        np.append(estimate, sigma),
        converged=True,
        problems=(),
        seconds=0.0,
        commanded=commanded,
    )
