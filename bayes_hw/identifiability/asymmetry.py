"""The assumptions c3 = c2 and delta- = delta+ tested: Savage-Dickey density ratios.

The Bayes factor of a point hypothesis against the model that contains it is the ratio of the posterior to the
prior density at the point, where nuisance parameters have the same prior under both (Dickey,
doi 10.1214/aoms/1177693507). It depends on the width of the prior of what is tested: it is given for several.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from scipy import special, stats

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.scaling_group import Invariant, exponent_vector, invariants, log_monomial
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import Summary, summarize

Decision: TypeAlias = Literal["supported", "undecided", "contradicted"]

TESTED = ("c3/c2", "delta+/delta-")
PRIOR_LOG_SDS = (0.05, 0.2, 1.0)
"""Widths of the prior of a log ratio: deviations of some 5 %, of some 20 %, and by factors."""

REFERENCE_LOG_SD = 0.2
"""The width that the decision rests on."""

SUBSTANTIAL = 10**0.5
"""Substantial evidence on Jeffreys' scale: a Bayes factor of this, either way, decides."""

KERNEL_DRAWS = 20_000
LEAST_TAIL = 0.002
"""Share of the draws beyond the point below which the density there is that of a normal fit."""


@dataclass(frozen=True)
class AssumptionTest:
    """One ratio that the paper sets to one.

    `ratio` summarises its posterior. `log10_bayes_factor` holds log10 of the Bayes factor for equality
    against inequality, and its Monte Carlo standard error, for each width in PRIOR_LOG_SDS. `extrapolated`:
    one lies so far out that the density there rests on a normal fit to the draws.
    """

    name: str
    ratio: Summary
    log10_bayes_factor: dict[float, tuple[float, float]]
    extrapolated: bool

    @property
    def decision(self) -> Decision:
        factor, _ = self.log10_bayes_factor[REFERENCE_LOG_SD]
        if abs(factor) < np.log10(SUBSTANTIAL):
            return "undecided"
        return "supported" if factor > 0 else "contradicted"

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return {
            "ratio": self.ratio.to_dict(),
            "log10_bayes_factor_for_equality": [
                {"prior_log_sd": width, "value": value, "standard_error": error}
                for width, (value, error) in self.log10_bayes_factor.items()
            ],
            "reference_prior_log_sd": REFERENCE_LOG_SD,
            "decision": self.decision,
            "density_extrapolated": self.extrapolated,
        }


def check_assumptions(posterior: Posterior) -> tuple[AssumptionTest, ...]:
    """Tests of both ratios from a posterior of `FreedGains` with independent log-normal priors."""
    found = {invariant.name: invariant for invariant in invariants(posterior.axis.model.units)}
    return tuple(_check(posterior, found[name]) for name in TESTED)


def _check(posterior: Posterior, invariant: Invariant) -> AssumptionTest:
    chains = log_monomial(invariant.exponents, posterior.values, posterior.names)
    normal = {p.name: found for p in posterior.axis.parameters if (found := p.prior.of_logarithm) is not None}
    powers = exponent_vector(invariant.exponents, list(normal))
    means, sds = np.array(list(normal.values())).T
    prior_mean, prior_sd = float(powers @ means), float(np.sqrt(powers**2 @ sds**2))
    factors = {}
    for width in PRIOR_LOG_SDS:
        single = np.array([log_density_ratio(chain.ravel(), prior_mean, prior_sd, width) for chain in chains])
        pooled = log_density_ratio(chains.ravel(), prior_mean, prior_sd, width)
        error = float(np.std(single, ddof=1)) / np.sqrt(len(single)) if len(single) > 1 else float("nan")
        factors[width] = (pooled / np.log(10), error / float(np.log(10)))
    beyond = min(float(np.mean(chains <= 0)), float(np.mean(chains >= 0)))
    return AssumptionTest(
        invariant.name, summarize(np.exp(chains), invariant.unit), factors, beyond < LEAST_TAIL
    )


def log_density_ratio(draws: FloatArray, prior_mean: float, prior_sd: float, width: float) -> float:
    """log Bayes factor of x = 0 against x ~ N(0, width^2), from posterior `draws` (draws,) of x under the
    prior N(prior_mean, prior_sd^2).

    The draws are reweighted from one prior to the other: the factor is p(0 | y) / p(0) over the mean of
    N(x; 0, width) / N(x; prior_mean, prior_sd).
    """
    log_weights = stats.norm.logpdf(draws, 0.0, width) - stats.norm.logpdf(draws, prior_mean, prior_sd)
    log_mean_weight = float(special.logsumexp(log_weights)) - np.log(len(draws))
    at_zero = log_posterior_density(draws, 0.0) - float(stats.norm.logpdf(0.0, prior_mean, prior_sd))
    return float(at_zero - log_mean_weight)


def log_posterior_density(draws: FloatArray, point: float) -> float:
    """log of the density of `draws` (draws,) at `point`.

    A kernel estimate that starts from a normal fit, f(x) mean[K(x - x_i) / f(x_i)] (Hjort and Glad,
    doi 10.1214/aos/1176324627), free of bias where the draws are normal; the normal fit alone where fewer
    than LEAST_TAIL of the draws lie beyond the point.
    """
    mean, sd = float(np.mean(draws)), float(np.std(draws))
    beyond = min(float(np.mean(draws <= point)), float(np.mean(draws >= point)))
    fitted = float(stats.norm.logpdf(point, mean, sd))
    if beyond < LEAST_TAIL:
        return fitted
    kept = draws[:: -(-len(draws) // KERNEL_DRAWS)]
    kernel = stats.norm.logpdf(point, kept, sd * len(kept) ** -0.2)
    correction = special.logsumexp(kernel - stats.norm.logpdf(kept, mean, sd)) - np.log(len(kept))
    return fitted + float(correction)
