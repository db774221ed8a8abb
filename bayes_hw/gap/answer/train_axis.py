"""The posterior that a corrected.json of a given model holds, where the drive train was read back: draws of
its linear part, the answer's effects in a position loop, and what a command would tell of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.answer.corrected_train import hypothesis_of
from bayes_hw.gap.effects.words import label_words
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate.chain import Chain, ChainBuilder
from bayes_hw.gap.simulate.chain_batch import PositionLoop, simulate_loops
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters

OUTPUT_DRAWS = 24
RIDGE = 1e-9
MOST_SURE = 0.999


@dataclass(frozen=True, eq=False)
class TrainLoop:
    """A hypothesis at values (draws, size), in a position loop."""

    hypothesis: Hypothesis
    values: FloatArray

    def take(self, index: IntArray) -> TrainLoop:
        """The draws of the given indices."""
        return TrainLoop(self.hypothesis, self.values[index])

    def simulate(
        self,
        numbers: FloatArray,
        sections: FloatArray,
        ratio: int,
        delay: int,
        reference: FloatArray,
        noise: FloatArray,
        start: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Command, w and output without noise, (draws, samples); see `bayes_hw.control.simulator`."""
        chains, settings = self.hypothesis.axes(self.values)
        loop = PositionLoop(numbers, sections, ratio, delay, reference, noise, start)
        u, w, y = simulate_loops([c for c in chains if isinstance(c, Chain)], settings, loop)
        return u.T, w.T, y.T


@dataclass(frozen=True, eq=False)
class TrainAxis:
    """A posterior of limits, dead zone, gain and modes, and of every draw the effects; `values` (size,) are
    the estimate, `draws` (draws, size) in the posterior's order. The rest as `gap.joint.corrected_axis` has.
    """

    posterior: Posterior
    hypothesis: Hypothesis
    values: FloatArray
    draws: FloatArray
    answer: tuple[str, ...]
    probability: Mapping[str, float]
    motion: Mapping[str, Any]
    next_experiment: str

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> TrainAxis:
        """Of the content of corrected.json. Raises InputError where it is not what diagnose writes."""
        hypothesis, values, draws = hypothesis_of(data, np.zeros(1))
        builder = hypothesis.builder
        assert isinstance(builder, ChainBuilder)
        nominal, count = builder.model, hypothesis.base_count
        name, sigma = str(data.get("name", nominal.name)), float(data["noise"]["sigma"])
        axis = AxisParameters(replace(nominal, name=name, noise_sigma=sigma))
        white = noise_parameters(NoiseEstimate(sigma, np.zeros(0), np.zeros(0)), nominal.units.output)
        columns = np.column_stack([draws[:, :count], np.full(len(draws), sigma)])
        posterior = Posterior(
            axis,
            white,
            columns[None, :, None, :],
            np.zeros((1, len(draws), 1)),
            np.append(values[:count], sigma),
            converged=True,
            problems=(),
            seconds=0.0,
        )
        largest = float(np.abs(values[:2]).max())
        reach = hypothesis.scale.travel
        plain = {"velocity": largest, "acceleration": largest, "stroke": [-reach / 2, reach / 2]}
        return cls(
            posterior,
            hypothesis,
            values,
            draws,
            tuple(str(label) for label in data.get("answer", ())),
            {str(k): float(v) for k, v in dict(data.get("probability", {})).items()},
            {**plain, **dict(data.get("motion", {}))},
            str(data.get("next_experiment") or ""),
        )

    @property
    def words(self) -> str:
        """What was missing and is in the model, with how sure that is."""
        said = [
            f"{label_words(label)} ({100 * min(self.probability[label], MOST_SURE):.3g} % sure)"
            if label in self.probability
            else label_words(label)
            for label in self.answer
        ]
        return " and ".join(said) or "nothing"

    @property
    def simulated(self) -> bool:
        """Whether any effect of the answer changes the response."""
        return bool(self.hypothesis.effects)

    def loop_of(self, values: FloatArray) -> TrainLoop:
        """The effects of the draws whose parameter vectors are `values` (draws, parameters)."""
        rows = self.posterior.values.reshape(-1, self.posterior.values.shape[-1])
        place = {row.tobytes(): i for i, row in enumerate(rows)}
        chosen = [place[np.ascontiguousarray(row).tobytes()] for row in values]
        return TrainLoop(self.hypothesis, self.draws[chosen])

    def nominal_loop(self) -> TrainLoop:
        """The effects of the estimate."""
        return TrainLoop(self.hypothesis, self.values[None])


@dataclass(frozen=True, eq=False)
class TrainInformation:
    """What a command is expected to tell of the effects of such an axis (Laplace approximation)."""

    axis: TrainAxis

    def outputs(self, u: FloatArray) -> FloatArray:
        """Angles (draws, samples) that draws of the axis answer with."""
        (y,) = self.axis.hypothesis.simulate_batch(self.axis.draws[:OUTPUT_DRAWS], [u])
        return y.T

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
        coordinates = self.axis.hypothesis.to_coordinates(self.axis.draws)
        deviation = coordinates.std(axis=0)
        deviation[deviation == 0] = 1.0
        scaled = (coordinates - coordinates.mean(axis=0)) / deviation
        correlation = scaled.T @ scaled / len(scaled)
        return deviation, np.linalg.inv(correlation + RIDGE * np.eye(len(correlation)))

    def _covariances(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        hypothesis = self.axis.hypothesis
        deviation, precision = self._known
        centre, steps = hypothesis.to_coordinates(self.axis.values), np.diag(hypothesis.derivative_steps)
        points = hypothesis.to_values(np.concatenate([centre + steps, centre - steps]))
        (y,) = hypothesis.simulate_batch(points, [u])
        more, less = np.split(y.T, 2)
        tangents = (more - less) / (2 * hypothesis.derivative_steps[:, None])
        rows = np.nan_to_num(tangents * deviation[:, None] / self.axis.posterior.point_estimate[-1])
        after, before = np.linalg.inv(precision + rows @ rows.T), np.linalg.inv(precision)
        first = hypothesis.base_count if hypothesis.effects else 0
        small = RIDGE * np.eye(len(centre) - first)
        return after[first:, first:] + small, before[first:, first:] + small
