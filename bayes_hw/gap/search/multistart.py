"""Multistart: fits begun again elsewhere, since likelihoods of limits and modes have several peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.continuation import can_be_led, led, measured_positions
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import FARTHEST, Fit, fit, fitted_on
from bayes_hw.gap.fit.free_level import without_level
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Plain, Whitener
from bayes_hw.gap.search.screen import LARGEST_RESPONSE
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

DRAWS = 48
FAR_STARTS = 2
NEAR_SPREAD = 0.3
"""Prior standard deviations about the best fit from which it is fitted again."""

FAR_OFF = 2.0
"""Prior standard deviations from which on a mode is begun again as given."""

OWN_STARTS = 2
OWN_SPREAD = (0.01, 0.3)
"""The same for draws in which the effects' own parameters move alone."""

CLOSE_STARTS = 3
CLOSE_DRAWS = 96
CLOSE_SPREAD = (3.0, 60.0)
"""Standard deviations of the estimate about the best fit: short periods make a rugged likelihood."""

SAME = 0.1
"""Log-evidence by which two fits of the same response may differ and yet be the same."""

GENERATIONS = 10
PATIENCE = 2
WORTH_ANOTHER = 10.0
"""Log-likelihood that one in PATIENCE generations must gain for another to follow."""

STARTS = 3
ITERATIONS = 14
ITERATIONS_NEAR = 10

FINISHED = 3
"""Starts beside a stochastic effect, which costs more, that are not given up after a few iterations."""


def drawn_about(centre: FloatArray, spreads: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Coordinates (count, parameters): `centre` (parameters,), its first ones spread by `spreads`."""
    draws = np.repeat(centre[None], count, axis=0)
    draws[:, : len(spreads)] += rng.normal(size=(count, len(spreads))) * spreads
    return draws


def square_errors(
    hypothesis: Hypothesis, measured: Sequence[FloatArray], whitener: Whitener, values: FloatArray
) -> FloatArray:
    """Squared whitened error (n,) at each of `values` (n, parameters)."""
    errors = np.zeros(len(values))
    for record, (y, s) in enumerate(zip(measured, hypothesis.simulate_batch(values), strict=True)):
        error = np.clip(y[:, None] - s, -LARGEST_RESPONSE, LARGEST_RESPONSE)
        white = without_level(hypothesis, whitener, whitener.whiten(error, record), record)
        errors += np.sum(white**2, axis=0)
    return errors


def nearest(
    hypothesis: Hypothesis, measured: Sequence[FloatArray], plain: Plain, draws: FloatArray
) -> FloatArray:
    """Coordinates (n, parameters) in order of their error."""
    errors = square_errors(hypothesis, measured, plain, hypothesis.to_values(draws))
    return np.asarray(draws[np.argsort(errors)])


@dataclass(frozen=True)
class Restarts:
    """Fits to `measured` from other places; the draws of `seed`."""

    base: Hypothesis
    measured: Sequence[FloatArray]
    plain: Plain
    stochastic: StochasticSearch
    each: Each
    seed: int
    settled: dict[str, list[float]] = field(default_factory=dict)
    """Log-evidences, by name, near which there is nothing better."""

    def elsewhere(self, hosts: Sequence[Fit]) -> list[Fit]:
        """Every host from other limits, dead zones and gains, its modes nominal, its effect as fitted."""
        starts = [(host.hypothesis, start) for host in hosts for start in self._about(host)]
        return self.each(lambda s: fit(s[0], self.measured, s[1], self.plain, ITERATIONS), starts)

    def near(self, best: Explanation) -> list[Explanation]:
        """The response of `best` fitted again from places near its own, and from near the best of those.

        None where it has no effect or has run away, or a display, whose likelihood is another.
        """
        host = best.fit
        if not host.hypothesis.effects or best.display is not None or host.ran_away:
            return []
        settled = self.settled.setdefault(best.name, [])
        if any(abs(best.log_evidence - known) < SAME for known in settled):
            return []
        found = self._near(best)
        settled += [best.log_evidence, max(e.log_evidence for e in found)]
        return found

    def _near(self, best: Explanation) -> list[Explanation]:
        """The same, whatever is known."""
        host, noise = best.fit, best.stochastic
        rng = np.random.default_rng(self.seed + 2)
        spreads = NEAR_SPREAD * host.hypothesis.prior_sds
        far = self._ranked(host, drawn_about(host.coordinates, spreads, DRAWS, rng))[:FAR_STARTS]
        starts = [*far, *self._own(host, rng), *self._close(host, rng)]
        again = self._modes_as_given(host)
        if can_be_led(host.hypothesis):
            start, positions = host.coordinates, measured_positions(host)
            starts.append(led(host.hypothesis, start, positions, self.measured, self.plain).coordinates)
        if noise is not None:
            begun = [(host.hypothesis, start) for start in starts]
            under_noise = self.stochastic.moved_from(best, begun, FINISHED)
            return under_noise + [self.stochastic.moved(best, host.hypothesis, start) for start in again]
        plain = fitted_on(host, self.measured, self.plain, ITERATIONS_NEAR)
        starts += [*again, *self._without_a_record(host)]
        failed = 0
        for _ in range(GENERATIONS):
            found = min(self._fitted(host.hypothesis, starts), key=lambda f: f.cost)
            failed = 0 if found.cost < plain.cost - WORTH_ANOTHER else failed + 1
            plain = min(plain, found, key=lambda f: f.cost)
            if failed == PATIENCE or plain.ran_away:
                break
            starts = self._close(plain, rng)
        return [with_coloured_noise(plain, self.measured)]

    def _modes_as_given(self, host: Fit) -> list[FloatArray]:
        """A start with the modes that ended far from the nominal model as they are given, all else as fitted;
        none where all are near."""
        rows = slice(len(self.base.builder.start_spreads), self.base.base_count)
        deviations = host.hypothesis.prior_deviations(host.coordinates)[rows]
        far = np.abs(deviations) > FAR_OFF
        if not far.any():
            return []
        start = host.coordinates.copy()
        start[rows] = np.where(far, host.hypothesis.prior_means[rows], start[rows])
        return [start]

    def _own(self, host: Fit, rng: np.random.Generator) -> list[FloatArray]:
        """Starts with the effects' parameters elsewhere and the base as fitted, the best of many."""
        moves = rng.normal(size=(DRAWS, len(host.coordinates))) * host.hypothesis.prior_sds
        moves[:, : self.base.base_count] = 0.0
        low, high = np.log(OWN_SPREAD)
        moves *= np.exp(rng.uniform(low, high, DRAWS))[:, None]
        return list(self._ranked(host, host.coordinates + moves)[:OWN_STARTS])

    def _close(self, host: Fit, rng: np.random.Generator) -> list[FloatArray]:
        """Starts some standard deviations of the estimate from a fit, the best of many."""
        low, high = np.log(CLOSE_SPREAD)
        factors = np.exp(rng.uniform(low, high, CLOSE_DRAWS))[:, None]
        centred = rng.multivariate_normal(
            0 * host.coordinates, host.covariance(), CLOSE_DRAWS, "ignore", method="eigh"
        )
        return list(self._ranked(host, host.coordinates + factors * centred)[:CLOSE_STARTS])

    def _without_a_record(self, host: Fit) -> list[FloatArray]:
        """Starts fitted to all records but one: a single record can make the likelihood rugged, as where a
        stiffening spring jumps between two amplitudes."""
        if len(self.measured) < 2:
            return []

        def fitted(left_out: int) -> FloatArray:
            noise = self.plain.without(
                [np.full(len(y), record == left_out) for record, y in enumerate(self.measured)]
            )
            return fitted_on(host, self.measured, noise, ITERATIONS_NEAR).coordinates

        return self.each(fitted, range(len(self.measured)))

    def _ranked(self, host: Fit, draws: FloatArray) -> FloatArray:
        """Draws in order of their error, none farther from the prior mean than a fit may move."""
        hypothesis = host.hypothesis
        reach = FARTHEST * hypothesis.prior_sds
        within = np.clip(draws, hypothesis.prior_means - reach, hypothesis.prior_means + reach)
        return nearest(hypothesis, self.measured, self.plain, within)

    def _fitted(self, hypothesis: Hypothesis, starts: Sequence[FloatArray]) -> list[Fit]:
        return self.each(
            lambda start: fit(hypothesis, self.measured, start, self.plain, ITERATIONS_NEAR), starts
        )

    def _about(self, host: Fit) -> FloatArray:
        count, spreads = self.base.base_count, self.base.builder.start_spreads
        own = np.concatenate([self.base.prior_means, host.coordinates[count:]])
        draws = drawn_about(own, spreads, DRAWS, np.random.default_rng(self.seed + 1))
        return nearest(host.hypothesis, self.measured, self.plain, draws)[:STARTS]
