"""What the replicates of a calibration say together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from prior_calibration import DRAWS, PROBABILITIES, CalibrationCase
from rank_statistics import (
    IntervalCoverage,
    SimultaneousBands,
    ecdf_bands,
    ecdf_counts,
    histogram_bands,
)

from bayes_hw.arrays import IntArray
from bayes_hw.infer.summary import INTERVAL_PROBABILITY

SIGNIFICANCE = 0.05
INTERVALS = (*(f"{100 * p:.0f} % central" for p in PROBABILITIES), f"{100 * INTERVAL_PROBABILITY:.0f} % HDI")
"""The intervals of `inside` of a replicate, in order."""


@dataclass(frozen=True, eq=False)
class CalibrationSummary:
    """Ranks, coverage and checks of one set of replicates, quantities and parameters by name.

    `ranks` (replicates,) of every quantity among `draws`; `p_values` of their distribution functions against
    `ecdf_bands`; `histogram_bands` for the counts in bins; `coverage` of every parameter, one entry an
    interval of INTERVALS. `not_converged` counts the replicates whose sampler said so (they are counted like
    all others), `not_white` those whose Ljung-Box test found correlation left in time; `seconds` is the mean
    of a replicate.
    """

    replicates: int
    draws: int
    ranks: dict[str, IntArray]
    ecdf_bands: SimultaneousBands
    histogram_bands: SimultaneousBands
    p_values: dict[str, float]
    coverage: dict[str, tuple[IntervalCoverage, ...]]
    not_converged: int
    not_white: int
    seconds: float

    @property
    def worst(self) -> str:
        """The quantity whose ranks are least like uniform ones."""
        return min(self.p_values, key=lambda name: self.p_values[name])

    @property
    def p_value(self) -> float:
        """Of all quantities together: the smallest times their number (Bonferroni), at most one."""
        return min(1.0, self.p_values[self.worst] * len(self.p_values))

    @property
    def calibrated(self) -> bool:
        return self.p_value >= SIGNIFICANCE

    @property
    def coverage_p_value(self) -> float:
        """Of all intervals together, by the exact binomial test and Bonferroni."""
        p_values = [entry.p_value for entries in self.coverage.values() for entry in entries]
        return min(1.0, min(p_values) * len(p_values))

    def axis_coverage(self) -> list[float]:
        """Share of the intervals of all parameters but the noise's that hold the truth, one entry an interval
        of INTERVALS."""
        kept = [c for name, c in self.coverage.items() if not name.startswith("noise.")]
        return [float(np.mean([entry[i].achieved for entry in kept])) for i in range(len(INTERVALS))]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a results file."""
        return {
            "replicates": self.replicates,
            "draws": self.draws,
            "calibrated": self.calibrated,
            "p_value": self.p_value,
            "coverage_p_value": self.coverage_p_value,
            "not_converged": self.not_converged,
            "not_white": self.not_white,
            "seconds_per_replicate": self.seconds,
            "p_values": self.p_values,
            "coverage": {
                name: {
                    label: {"achieved": c.achieved, "interval95": list(c.interval)}
                    for label, c in zip(INTERVALS, entries, strict=True)
                }
                for name, entries in self.coverage.items()
            },
            "axis_coverage": dict(zip(INTERVALS, self.axis_coverage(), strict=True)),
            "ranks": {name: ranks.tolist() for name, ranks in self.ranks.items()},
        }


@dataclass(frozen=True, eq=False)
class CalibrationStudy:
    """A calibration, and what shows that it could have failed.

    `right` has the likelihood of the simulated noise; `wrong` holds, by a description in words, likelihoods
    made wrong on purpose; `orders` holds, by the assumed AR order, replicates whose noise has the partial
    autocorrelations `order_noise`.
    """

    case: CalibrationCase
    right: CalibrationSummary
    wrong: dict[str, CalibrationSummary]
    orders: dict[int, CalibrationSummary]
    order_noise: tuple[float, ...]

    @property
    def passed(self) -> bool:
        """Whether the right likelihood is calibrated and every wrong one is found out."""
        return self.right.calibrated and not any(summary.calibrated for summary in self.wrong.values())


def summarize_calibration(
    replicates: Sequence[dict[str, Any]], rng: np.random.Generator
) -> CalibrationSummary:
    """Summary of the results of `calibrate_once`; `rng` draws the uniform ranks that make the bands."""
    count = len(replicates)
    ranks = {
        name: np.array([r["ranks"][name] for r in replicates], dtype=np.int64)
        for name in replicates[0]["ranks"]
    }
    bands = ecdf_bands(count, rng)
    nominal = (*PROBABILITIES, INTERVAL_PROBABILITY)
    coverage = {
        name: tuple(
            IntervalCoverage(p, sum(r["inside"][name][i] for r in replicates), count)
            for i, p in enumerate(nominal)
        )
        for name in replicates[0]["inside"]
    }
    return CalibrationSummary(
        replicates=count,
        draws=DRAWS,
        ranks=ranks,
        ecdf_bands=bands,
        histogram_bands=histogram_bands(count, rng),
        p_values={name: bands.p_value(ecdf_counts(r, DRAWS)) for name, r in ranks.items()},
        coverage=coverage,
        not_converged=sum(not r["converged"] for r in replicates),
        not_white=sum(any("white" in name for name in r["failed_tests"]) for r in replicates),
        seconds=float(np.mean([r["seconds"] for r in replicates])),
    )
