"""What many replicates from records alone say together: coverage by kind of parameter, width, convergence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rank_statistics import BAND_PROBABILITY, ROUNDING, SIMULATIONS, IntervalCoverage
from recovery import LEVELS
from scipy import stats

from bayes_hw.arrays import FloatArray, IntArray

KINDS = {
    "saturation.lower": "limits",
    "saturation.upper": "limits",
    "dead_zone.half_width": "dead zone",
    "velocity_gain": "velocity gain",
    "frequency_hz": "mode frequencies",
    "damping_ratio": "mode damping ratios",
    "noise.sigma": "noise",
}


def kind_of(name: str) -> str:
    """The kind of parameter that a name of posterior.json belongs to."""
    mode, _, quantity = name.partition(".")
    return KINDS[quantity if mode.startswith("mode") else name]


@dataclass(frozen=True, eq=False)
class RecoverySummary:
    """Replicates of one set of axes.

    `coverage` holds, for every kind of parameter, one entry for each of LEVELS; `band` of every kind the
    lowest and highest counts (2, levels) that all kinds and levels together keep to with BAND_PROBABILITY
    when the intervals hold as often as they say, `p_value` how often right intervals would do as badly.
    `at_best` is what `coverage` is for estimates linearised at the truth from the same records, of the kinds
    that have them; of `missed` 94 % intervals with such a companion, `missed_alone` are those whose companion
    holds. `widths` are the 94 % intervals over those at the Cramer-Rao bound (n,). `lacking` of `modes` true
    modes were not found; `refused` axes gave no posterior and count as not converged; `seconds` of processor
    time.
    """

    axes: int
    refused: int
    converged: int
    modes: int
    lacking: int
    coverage: Mapping[str, tuple[IntervalCoverage, ...]]
    band: Mapping[str, IntArray]
    p_value: float
    at_best: Mapping[str, tuple[IntervalCoverage, ...]]
    missed: int
    missed_alone: int
    widths: Mapping[str, FloatArray]
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether every count lies within its band."""
        return self.p_value >= 1 - BAND_PROBABILITY

    @property
    def all_levels(self) -> tuple[IntervalCoverage, ...]:
        """Of all kinds together, for each of LEVELS."""
        return _together(self.coverage.values())

    @property
    def all_parameters(self) -> IntervalCoverage:
        """The 94 % intervals of all kinds together."""
        return self.all_levels[-1]

    @property
    def all_at_best(self) -> tuple[IntervalCoverage, ...]:
        """As `all_levels`, at best."""
        return _together(self.at_best.values())

    @property
    def median_width(self) -> float:
        """Of the intervals of all kinds, over the Cramer-Rao bound."""
        return float(np.median(np.concatenate(list(self.widths.values()))))

    def outside(self) -> tuple[tuple[str, float], ...]:
        """Kinds and levels whose counts leave their band."""
        return tuple(
            (kind, entry.nominal)
            for kind, entries in self.coverage.items()
            for column, entry in enumerate(entries)
            if not self.band[kind][0, column] <= entry.inside <= self.band[kind][1, column]
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a results file."""
        return {
            "axes": self.axes,
            "refused": self.refused,
            "converged": self.converged,
            "modes": self.modes,
            "lacking": self.lacking,
            "holds": self.holds,
            "p_value": self.p_value,
            "seconds_per_axis": self.seconds,
            "all_94_percent": _plain(self.all_parameters),
            "all_levels": [_plain(entry) for entry in self.all_levels],
            "all_at_best": [_plain(entry) for entry in self.all_at_best],
            "missed": self.missed,
            "missed_alone": self.missed_alone,
            "median_width": self.median_width,
            "kinds": {
                kind: {
                    "coverage": [_plain(entry) for entry in entries],
                    "at_best": [_plain(entry) for entry in self.at_best.get(kind, ())],
                    "band": self.band[kind].tolist(),
                    "median_width": float(np.median(self.widths[kind])) if kind in self.widths else None,
                }
                for kind, entries in self.coverage.items()
            },
        }


def summarize_recovery(replicates: Sequence[Mapping[str, Any]], rng: np.random.Generator) -> RecoverySummary:
    """Summary of results of `recover`, each with its `facts`; one with `refused` gave no posterior."""
    done = [each for each in replicates if "refused" not in each]
    inside: dict[str, list[Sequence[bool]]] = {}
    best: dict[str, list[Sequence[bool]]] = {}
    widths: dict[str, list[float]] = {}
    pairs: list[tuple[bool, bool]] = []
    for each in done:
        for name, held in each["inside"].items():
            inside.setdefault(kind_of(name), []).append(held)
            if name in each["at_best"]:
                best.setdefault(kind_of(name), []).append(each["at_best"][name])
                pairs.append((bool(held[-1]), bool(each["at_best"][name][-1])))
        for name, width in each["width"].items():
            widths.setdefault(kind_of(name), []).append(width)
    kinds = [kind for kind in dict.fromkeys(KINDS.values()) if kind in inside]
    counts = {kind: np.sum(inside[kind], axis=0, dtype=np.int64) for kind in kinds}
    sizes = {kind: len(inside[kind]) for kind in kinds}
    band, p_value = coverage_band(counts, sizes, rng)
    return RecoverySummary(
        axes=len(replicates),
        refused=len(replicates) - len(done),
        converged=sum(bool(each["converged"]) for each in done),
        modes=sum(int(each["facts"]["true_modes"]) for each in replicates),
        lacking=sum(len(each["lacking"]) for each in done),
        coverage={kind: _coverage(inside[kind]) for kind in kinds},
        band=band,
        p_value=p_value,
        at_best={kind: _coverage(best[kind]) for kind in kinds if kind in best},
        missed=sum(not held for held, _ in pairs),
        missed_alone=sum(not held and also for held, also in pairs),
        widths={kind: np.array(widths[kind]) for kind in kinds if kind in widths},
        seconds=float(np.mean([sum(each["cpu_seconds"]) for each in done])) if done else 0.0,
    )


def _coverage(held: Sequence[Sequence[bool]]) -> tuple[IntervalCoverage, ...]:
    """For each of LEVELS how often its intervals hold."""
    return tuple(
        IntervalCoverage(level, sum(map(bool, column)), len(held))
        for level, column in zip(LEVELS, zip(*held, strict=True), strict=True)
    )


def _together(kinds: Iterable[Sequence[IntervalCoverage]]) -> tuple[IntervalCoverage, ...]:
    """All kinds as one, for each of LEVELS."""
    return tuple(
        IntervalCoverage(level, sum(c.inside for c in column), sum(c.replicates for c in column))
        for level, column in zip(LEVELS, zip(*kinds, strict=True), strict=False)
    )


def coverage_band(
    held: Mapping[str, IntArray], sizes: Mapping[str, int], rng: np.random.Generator
) -> tuple[dict[str, IntArray], float]:
    """Lowest and highest counts (2, levels) of every kind, and the p-value of the counts `held` (levels,).

    Pointwise binomial intervals of one probability, such that the nested intervals of all kinds together stay
    inside with BAND_PROBABILITY; intervals of one axis are taken as independent.
    """
    levels = np.array(LEVELS)
    smallest = np.ones(SIMULATIONS)
    worst = 1.0
    for kind, size in sizes.items():
        shares = np.diff(levels, prepend=0.0, append=1.0)
        simulated = np.cumsum(rng.multinomial(size, shares, size=SIMULATIONS), axis=1)[:, : len(levels)]
        smallest = np.minimum(smallest, _tail(simulated, size, levels).min(axis=1))
        worst = min(worst, float(_tail(held[kind][None, :], size, levels).min()))
    extremes = np.sort(smallest)
    gamma = float(np.quantile(extremes, 1 - BAND_PROBABILITY, method="lower")) * (1 - ROUNDING)
    bands = {
        kind: np.stack(
            [stats.binom.ppf(gamma / 2, size, levels), stats.binom.ppf(1 - gamma / 2, size, levels)]
        ).astype(np.int64)
        for kind, size in sizes.items()
    }
    below = int(np.searchsorted(extremes, worst * (1 + ROUNDING), side="right"))
    return bands, (1 + below) / (1 + SIMULATIONS)


def _tail(counts: IntArray, size: int, levels: FloatArray) -> FloatArray:
    """Twice the smaller binomial tail of every count (rows, levels)."""
    at_most = stats.binom.cdf(counts, size, levels)
    at_least = stats.binom.sf(counts - 1, size, levels)
    return np.minimum(1.0, 2 * np.minimum(at_most, at_least))


def _plain(coverage: IntervalCoverage) -> dict[str, Any]:
    return {
        "nominal": coverage.nominal,
        "hits": coverage.inside,
        "trials": coverage.replicates,
        "interval95": list(coverage.interval),
    }
