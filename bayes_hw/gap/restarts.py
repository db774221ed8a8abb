"""Fits begun again elsewhere: likelihoods of limits and modes have several peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit import Fit, fit
from bayes_hw.gap.hypothesis import Hypothesis
from bayes_hw.gap.parallel import Each
from bayes_hw.gap.stochastic_search import StochasticSearch
from bayes_hw.gap.whitener import Plain

DRAWS = 48
NEAR_STARTS = 5
NEAR_SPREAD = 0.3
"""Prior standard deviations about the best fit from which it is fitted again."""

STARTS = 3
ITERATIONS = 14
ITERATIONS_NEAR = 10


def square_errors(
    hypothesis: Hypothesis, measured: Sequence[FloatArray], plain: Plain, coordinates: FloatArray
) -> FloatArray:
    """Squared whitened error at each of `coordinates` (n, parameters)."""
    simulated = hypothesis.simulate_batch(hypothesis.to_values(coordinates))
    white = (
        plain.whiten(y[:, None] - s, record)
        for record, (y, s) in enumerate(zip(measured, simulated, strict=True))
    )
    return np.asarray(sum(np.sum(w**2, axis=0) for w in white))


@dataclass(frozen=True)
class Restarts:
    """Fits to `measured` from other places; the draws of `seed`."""

    base: Hypothesis
    measured: Sequence[FloatArray]
    plain: Plain
    stochastic: StochasticSearch
    each: Each
    seed: int

    def elsewhere(self, hosts: Sequence[Fit]) -> list[Fit]:
        """Every host from other limits, dead zones and gains, its modes nominal, its effect as fitted."""
        starts = [(host.hypothesis, start) for host in hosts for start in self._about(host)]
        return self.each(lambda s: fit(s[0], self.measured, s[1], self.plain, ITERATIONS), starts)

    def near(self, best: Explanation) -> list[Explanation]:
        """The response of `best` fitted again from places near its own.

        None where it has no effect, or a display, whose likelihood is another.
        """
        host, noise = best.fit, best.stochastic
        if not host.hypothesis.effects or (noise is not None and noise.display is not None):
            return []
        draws = np.random.default_rng(self.seed + 2).normal(size=(DRAWS, len(host.coordinates)))
        draws = host.coordinates + NEAR_SPREAD * host.hypothesis.prior_sds * draws
        nearest = list(self._best(host.hypothesis, draws)[:NEAR_STARTS])
        if noise is not None:
            return self.each(lambda start: self.stochastic.moved(best, host.hypothesis, start), nearest)
        fits = self.each(
            lambda start: fit(host.hypothesis, self.measured, start, self.plain, ITERATIONS_NEAR), nearest
        )
        return [with_coloured_noise(min(fits, key=lambda f: f.cost), self.measured)]

    def _about(self, host: Fit) -> FloatArray:
        count, spreads = self.base.base_count, self.base.builder.start_spreads
        own = np.concatenate([self.base.prior_means, host.coordinates[count:]])
        draws = np.repeat(own[None], DRAWS, axis=0)
        rng = np.random.default_rng(self.seed + 1)
        draws[:, : len(spreads)] += rng.normal(size=(DRAWS, len(spreads))) * spreads
        return self._best(host.hypothesis, draws)[:STARTS]

    def _best(self, hypothesis: Hypothesis, draws: FloatArray) -> FloatArray:
        """The draws (n, parameters) in order of their error."""
        errors = square_errors(hypothesis, self.measured, self.plain, draws)
        return np.asarray(draws[np.argsort(errors)])
