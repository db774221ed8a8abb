"""Effects in forms of more parameters, where the simple form leaves structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, fit, fitted_on
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

SCREENED_STARTS = 2
FIRST_ITERATIONS = 5


@dataclass(frozen=True)
class Refinement:
    """Refits explanations of `measured` with the forms that `Effect.refined` names in the place of an effect.

    `screen` is that of the base model with its modes as given; forms are screened for starts against it.
    """

    screen: Screen
    measured: Sequence[FloatArray]
    plain: Plain
    stochastic: StochasticSearch
    each: Each

    def of(self, explanations: Sequence[Explanation]) -> list[Explanation]:
        """Every explanation with each effect in turn in each richer form; none for other simulators."""
        if not self.screen.base.hypothesis.builder.has_drive_train:
            return []
        tasks = [
            (explanation, row, form, start)
            for explanation in explanations
            for row, (effect, values) in enumerate(_effects_of(explanation.fit))
            for form, start in effect.refined(values)
        ]
        return self.each(lambda task: self._refined(*task), tasks)

    def _refined(
        self, explanation: Explanation, row: int, form: Effect, start: tuple[float, ...]
    ) -> Explanation:
        begun = [
            self._start(explanation.fit, row, form, values)
            for values in self._starts(explanation, form, start)
        ]
        if explanation.stochastic is not None:
            return self.stochastic.moved(explanation, *begun[0])
        fits = [fit(h, self.measured, at, self.plain, FIRST_ITERATIONS) for h, at in begun]
        best = min(fits, key=lambda f: f.cost)
        done = fitted_on(best, self.measured, self.plain)
        return with_coloured_noise(done, self.measured)

    def _starts(
        self, explanation: Explanation, form: Effect, start: tuple[float, ...]
    ) -> list[tuple[float, ...]]:
        """The given start, and for an effect alone the best of the form's own."""
        own = form.starts(self.screen.base.hypothesis.scale)
        if explanation.stochastic is not None or len(explanation.fit.hypothesis.effects) > 1 or not len(own):
            return [start]
        ranked = sorted(self.screen.tried(form, own), key=lambda candidate: -candidate.reduction)
        return [start, *(candidate.values for candidate in ranked[:SCREENED_STARTS])]

    def _start(
        self, host: Fit, row: int, form: Effect, start: tuple[float, ...]
    ) -> tuple[Hypothesis, FloatArray]:
        """The hypothesis of `host` with `form` in the place of effect `row`, and where to start."""
        hypothesis = self.screen.base.hypothesis
        values = [host.values[: hypothesis.base_count]]
        for i, (effect, own) in enumerate(_effects_of(host)):
            hypothesis = hypothesis.with_effect(form if i == row else effect)
            values.append(np.asarray(start) if i == row else own)
        return hypothesis, hypothesis.to_coordinates(np.fromiter(chain.from_iterable(values), np.float64))


def _effects_of(host: Fit) -> list[tuple[Effect, FloatArray]]:
    """The effects of a fit with their parameter values."""
    hypothesis, values = host.hypothesis, host.values
    return [(e, values[rows]) for e, rows in zip(hypothesis.effects, hypothesis.effect_rows, strict=True)]
