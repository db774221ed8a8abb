"""Posterior summaries of scalar quantities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from arviz_stats.base import array_stats

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import effective_sample_size, nested_r_hat

INTERVAL_PROBABILITY = 0.94


@dataclass(frozen=True)
class Summary:
    """Mean, standard deviation, median, 94 % highest-density interval and how well sampling knows them."""

    mean: float
    sd: float
    median: float
    hdi94: tuple[float, float]
    ess_bulk: float
    ess_tail: float
    r_hat: float
    mcse_mean: float
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """The entry of posterior.json; a number that is not finite becomes null."""
        plain = {key: _finite(getattr(self, key)) for key in _SCALARS}
        return {**plain, "hdi94": [_finite(bound) for bound in self.hdi94], "unit": self.unit}


_SCALARS = ("mean", "sd", "median", "ess_bulk", "ess_tail", "r_hat", "mcse_mean")


def highest_density_interval(draws: FloatArray) -> tuple[float, float]:
    """The shortest interval that holds 94 % of the draws."""
    low, high = array_stats.hdi(np.ravel(draws), prob=INTERVAL_PROBABILITY)
    return float(low), float(high)


def summarize(chains: FloatArray, unit: str) -> Summary:
    """Summary of chains (ensembles, steps, walkers) of one quantity."""
    low, high = np.quantile(chains, [0.05, 0.95])
    ess_bulk = effective_sample_size(chains)
    ess_tail = min(
        effective_sample_size((chains <= low).astype(np.float64)),
        effective_sample_size((chains >= high).astype(np.float64)),
    )
    sd = float(np.std(chains))
    return Summary(
        mean=float(np.mean(chains)),
        sd=sd,
        median=float(np.median(chains)),
        hdi94=highest_density_interval(chains),
        ess_bulk=ess_bulk,
        ess_tail=ess_tail,
        r_hat=nested_r_hat(chains),
        mcse_mean=sd / np.sqrt(ess_bulk) if ess_bulk > 0 else float("inf"),
        unit=unit,
    )


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
