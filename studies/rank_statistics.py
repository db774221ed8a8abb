"""Are ranks uniform? Simultaneous bands for rank histograms and empirical distribution functions.

With draws that are exact, the rank of the true value among `draws` independent posterior draws is uniform on
0 ... draws (Talts et al., arXiv 1804.06788). The bands are those of Säilynoja, Bürkner and Vehtari
(doi 10.1007/s11222-022-10090-6): pointwise binomial intervals of one probability 1 - gamma, with gamma such
that uniform ranks stay inside all of them at once with the wanted probability; gamma by simulation (their
section 2.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray, IntArray

BAND_PROBABILITY = 0.95
SIMULATIONS = 10_000
HISTOGRAM_BINS = 16
ECDF_POINTS = 32
ROUNDING = 1e-9
"""Tail probabilities that differ by less, relatively, are the same count's."""


@dataclass(frozen=True, eq=False)
class SimultaneousBands:
    """Bands that hold all counts at once with BAND_PROBABILITY when the ranks are uniform.

    `probability` (points,) is the binomial probability at every point, `lower` and `upper` the bounds of the
    counts, `extremes` (simulations,) the sorted smallest two-sided tail probabilities of simulated counts.
    """

    replicates: int
    probability: FloatArray
    lower: FloatArray
    upper: FloatArray
    extremes: FloatArray

    def p_value(self, counts: IntArray) -> float:
        """Share of uniform ranks with a point at least as extreme as the worst of `counts` (points,)."""
        smallest = _smallest_tail(counts[None, :], self.replicates, self.probability)[0]
        below = int(np.searchsorted(self.extremes, smallest * (1 + ROUNDING), side="right"))
        return (1 + below) / (1 + len(self.extremes))


def histogram_bands(
    replicates: int, rng: np.random.Generator, bins: int = HISTOGRAM_BINS
) -> SimultaneousBands:
    """Bands of the counts in equal bins."""
    shares = np.full(bins, 1 / bins)
    return _bands(rng.multinomial(replicates, shares, size=SIMULATIONS), replicates, shares)


def ecdf_bands(replicates: int, rng: np.random.Generator, points: int = ECDF_POINTS) -> SimultaneousBands:
    """Bands of replicates x (empirical distribution function) at i / points, i = 1 ... points - 1."""
    increments = rng.multinomial(replicates, np.full(points, 1 / points), size=SIMULATIONS)
    shares = np.arange(1, points) / points
    return _bands(np.cumsum(increments, axis=1)[:, :-1], replicates, shares)


def histogram_counts(ranks: IntArray, draws: int, bins: int = HISTOGRAM_BINS) -> IntArray:
    """Counts (bins,) of ranks (replicates,) in 0 ... draws; draws + 1 must be a multiple of the bins."""
    return np.bincount(ranks * bins // (draws + 1), minlength=bins)


def ecdf_counts(ranks: IntArray, draws: int, points: int = ECDF_POINTS) -> IntArray:
    """Number of ranks below (draws + 1) i / points, i = 1 ... points - 1."""
    return np.cumsum(histogram_counts(ranks, draws, points))[:-1]


@dataclass(frozen=True)
class IntervalCoverage:
    """How often intervals of probability `nominal` held the truth, with a 95 % binomial interval."""

    nominal: float
    inside: int
    replicates: int

    @property
    def achieved(self) -> float:
        return self.inside / self.replicates

    @property
    def interval(self) -> tuple[float, float]:
        """Clopper-Pearson, doi 10.1093/biomet/26.4.404."""
        found = stats.binomtest(self.inside, self.replicates).proportion_ci(0.95)
        return float(found.low), float(found.high)

    @property
    def p_value(self) -> float:
        """Of the exact two-sided binomial test of the nominal probability."""
        return float(stats.binomtest(self.inside, self.replicates, self.nominal).pvalue)

    @property
    def agrees(self) -> bool:
        low, high = self.interval
        return bool(low <= self.nominal <= high)


def _bands(simulated: IntArray, replicates: int, probability: FloatArray) -> SimultaneousBands:
    extremes = np.sort(_smallest_tail(simulated, replicates, probability))
    gamma = float(np.quantile(extremes, 1 - BAND_PROBABILITY, method="lower")) * (1 - ROUNDING)
    return SimultaneousBands(
        replicates,
        probability,
        np.asarray(stats.binom.ppf(gamma / 2, replicates, probability)),
        np.asarray(stats.binom.ppf(1 - gamma / 2, replicates, probability)),
        extremes,
    )


def _smallest_tail(counts: IntArray, replicates: int, probability: FloatArray) -> FloatArray:
    """Twice the smaller binomial tail at the worst point of every row of counts (rows, points)."""
    possible = np.arange(replicates + 1)[:, None]
    at_most = stats.binom.cdf(possible, replicates, probability)
    at_least = stats.binom.sf(possible - 1, replicates, probability)
    tails = 2 * np.minimum(at_most, at_least)
    return np.min(np.take_along_axis(tails, counts, axis=0), axis=1)
