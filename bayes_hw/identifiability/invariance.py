"""What freeing the gains does to their posterior: contraction, and agreement of the invariants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.freed_gains import FreedGains
from bayes_hw.identifiability.scaling_group import (
    GENERATORS,
    Exponents,
    Invariant,
    acting_generators,
    exponent_vector,
    invariants,
    log_monomial,
    monomial,
)
from bayes_hw.infer.convergence import effective_sample_size
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import Summary, summarize

SIGNIFICANCE = 0.01
"""Chance that runs which agree are said to differ, over all comparisons together (Bonferroni)."""


@dataclass(frozen=True)
class Contraction:
    """1 - variance / prior variance of the logarithm of one quantity under the freed run.

    `by_pooling` is what would be left of a parameter on the ridge if the records knew every invariant exactly
    and the priors alone placed it on its orbit: its contraction then only says that several priors agree.
    """

    name: str
    prior_log_sd: float
    posterior_log_sd: float
    by_pooling: float | None = None

    @property
    def contraction(self) -> float:
        return 1 - (self.posterior_log_sd / self.prior_log_sd) ** 2


@dataclass(frozen=True)
class InvariantComparison:
    """One invariant in the freed run and in the chart c1 = c2 = 1.

    `mean_score` and `sd_score` are differences of the mean and of the standard deviation of its logarithm,
    in their Monte Carlo standard errors.
    """

    invariant: Invariant
    freed: Summary
    chart: Summary
    mean_score: float
    sd_score: float


@dataclass(frozen=True)
class Agreement:
    """All invariants compared; `limit` is the largest score that chance leaves them with SIGNIFICANCE."""

    rows: tuple[InvariantComparison, ...]
    limit: float

    @property
    def largest(self) -> float:
        return max(max(abs(row.mean_score), abs(row.sd_score)) for row in self.rows)

    @property
    def agrees(self) -> bool:
        return self.largest <= self.limit

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return {
            "agrees": self.agrees,
            "largest_score": self.largest,
            "limit": self.limit,
            "invariants": {
                row.invariant.name: {
                    "freed": row.freed.to_dict(),
                    "normalized": row.chart.to_dict(),
                    "mean_score": row.mean_score,
                    "sd_score": row.sd_score,
                }
                for row in self.rows
            },
        }


def compare_invariants(freed: Posterior, chart: Posterior) -> Agreement:
    """Posteriors of every invariant in the two runs of `sample_freed`."""
    rows = []
    for invariant in invariants(freed.axis.model.units):
        exponents, unit = invariant.exponents, invariant.unit
        chains = [log_monomial(exponents, run.values, run.names) for run in (freed, chart)]
        log_freed, log_chart = (summarize(chain, "") for chain in chains)
        values_freed, values_chart = (
            summarize(monomial(exponents, run.values, run.names), unit) for run in (freed, chart)
        )
        error_of_mean = np.hypot(log_freed.mcse_mean, log_chart.mcse_mean)
        error_of_sd = np.hypot(sd_error(chains[0]), sd_error(chains[1]))
        rows.append(
            InvariantComparison(
                invariant,
                values_freed,
                values_chart,
                float((log_freed.mean - log_chart.mean) / error_of_mean),
                float((log_freed.sd - log_chart.sd) / error_of_sd),
            )
        )
    limit = float(stats.norm.ppf(1 - SIGNIFICANCE / (4 * len(rows))))
    return Agreement(tuple(rows), limit)


def sd_error(chains: FloatArray) -> float:
    """Monte Carlo standard error of the standard deviation of chains (ensembles, steps, walkers).

    By the effective samples of the squares: draws that lie opposite to each other serve means alone.
    """
    squares = (chains - chains.mean()) ** 2
    size = effective_sample_size(squares)
    return float(squares.std() / (2 * chains.std() * np.sqrt(size)))


def contractions(freed: Posterior) -> tuple[tuple[Contraction, ...], tuple[Contraction, ...]]:
    """Contraction of every raw parameter on the ridge, and of every invariant, in logarithms."""
    axis = freed.axis
    assert isinstance(axis, FreedGains)
    log_sd = {p.name: found[1] for p in axis.parameters if (found := p.prior.of_logarithm) is not None}
    group = acting_generators(axis.names)
    on_ridge = [name for name, row in zip(axis.names, group, strict=True) if np.any(row != 0)]
    pooled = _pooled_log_sd(axis.names, group, log_sd)
    raw = []
    for name in on_ridge:
        exponents: Exponents = {name: 1.0}
        sd = float(np.std(log_monomial(exponents, freed.values, freed.names)))
        raw.append(Contraction(name, log_sd[name], sd, 1 - (pooled[name] / log_sd[name]) ** 2))
    kept = []
    for invariant in invariants(axis.model.units):
        prior = float(
            np.sqrt(sum((power * log_sd[name]) ** 2 for name, power in invariant.exponents.items()))
        )
        sd = float(np.std(log_monomial(invariant.exponents, freed.values, freed.names)))
        kept.append(Contraction(invariant.name, prior, sd))
    return tuple(raw), tuple(kept)


def _pooled_log_sd(names: Sequence[str], group: FloatArray, log_sd: dict[str, float]) -> dict[str, float]:
    """Standard deviations of the logarithms when the prior is cut along one orbit.

    On the orbit x = x0 + group t the prior's precision in t is group^T S^-1 group.
    """
    precision = np.array([1 / log_sd[name] ** 2 if name in log_sd else 0.0 for name in names])
    covariance = group @ np.linalg.inv((group.T * precision) @ group) @ group.T
    return dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))


def orbit_through(freed: Posterior, steps: FloatArray, generator: int) -> FloatArray:
    """Values (steps, parameters) along one generator through the posterior's mean logarithms.

    `steps` (steps,) are logarithms of a or of b.
    """
    n_axis = len(freed.axis.parameters)
    flat = freed.values[..., :n_axis].reshape(-1, n_axis)
    names = freed.axis.names
    centre = np.sign(flat[0]) * np.exp(np.mean(np.log(np.abs(flat)), axis=0))
    return centre * np.exp(np.outer(steps, exponent_vector(GENERATORS[generator], names)))
