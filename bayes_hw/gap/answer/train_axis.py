"""The posterior that a corrected.json of a given model holds, where the drive train was read back: draws of
its linear part, and the answer's effects in a position loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.answer.axis_with_effects import (
    AxisWithEffects,
    ExpectedInformation,
    commanded_in,
    posterior_of_draws,
    said_in,
)
from bayes_hw.gap.answer.corrected_train import KEY, hypothesis_of
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.chain_batch import simulate_loops
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.controller_kernel import LoopSignals, PositionLoop
from bayes_hw.model.hammerstein_wiener import HammersteinWiener


@dataclass(frozen=True, eq=False)
class TrainLoop:
    """A hypothesis at values (draws, size), in a position loop."""

    hypothesis: Hypothesis
    values: FloatArray

    def take(self, index: IntArray) -> TrainLoop:
        """The draws of the given indices."""
        return TrainLoop(self.hypothesis, self.values[index])

    def simulate(self, loop: PositionLoop) -> LoopSignals:
        """Command, w and output without noise."""
        chains, settings = self.hypothesis.axes(self.values)
        return simulate_loops(cast(Sequence[Chain], chains), settings, loop)


@dataclass(frozen=True, eq=False)
class TrainAxis(AxisWithEffects):
    """A posterior of limits, dead zone, gain and modes; `values` (size,) are the estimate of the hypothesis,
    `draws` (draws, size) its draws."""

    hypothesis: Hypothesis
    values: FloatArray
    draws: FloatArray

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> TrainAxis:
        """Of the content of corrected.json. Raises InputError where it is not what diagnose writes."""
        hypothesis, values, draws = hypothesis_of(data, np.zeros(1))
        nominal, count = HammersteinWiener.from_dict(data[KEY]["nominal"]), hypothesis.base_count
        name, sigma = str(data.get("name", nominal.name)), float(data["noise"]["sigma"])
        axis = AxisParameters(replace(nominal, name=name, noise_sigma=sigma))
        posterior = posterior_of_draws(axis, sigma, draws[:, :count], values[:count], commanded_in(data))
        said = said_in(data, float(np.abs(values[:2]).max()), hypothesis.scale.travel)
        return cls(posterior, *said, hypothesis, values, draws)

    @property
    def simulated(self) -> bool:
        return bool(self.hypothesis.effects)

    def loop_of(self, values: FloatArray) -> TrainLoop:
        return TrainLoop(self.hypothesis, self.draws[self._places(values)])

    def nominal_loop(self) -> TrainLoop:
        return TrainLoop(self.hypothesis, self.values[None])

    def expected_information(self) -> ExpectedInformation:
        coordinates = self.hypothesis.to_coordinates(self.draws)
        first = self.hypothesis.base_count if self.hypothesis.effects else 0
        sigma = float(self.posterior.point_estimate[-1])
        return ExpectedInformation(
            coordinates, coordinates.mean(axis=0), first, sigma, self._angles, self._tangents
        )

    def _angles(self, u: FloatArray, count: int) -> FloatArray:
        (y,) = self.hypothesis.simulate_batch(self.draws[:count], [u])
        return y.T

    def _tangents(self, u: FloatArray) -> FloatArray:
        """Derivatives (size, samples) of the angle by the coordinates at the estimate."""
        steps = np.diag(self.hypothesis.derivative_steps)
        centre = self.hypothesis.to_coordinates(self.values)
        points = self.hypothesis.to_values(np.concatenate([centre + steps, centre - steps]))
        (y,) = self.hypothesis.simulate_batch(points, [u])
        more, less = np.split(y.T, 2)
        return np.asarray((more - less) / (2 * self.hypothesis.derivative_steps[:, None]))
