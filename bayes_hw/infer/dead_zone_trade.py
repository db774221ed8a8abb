"""What trades places with the dead zone: how much of its half width's variance is other parameters'.

At a reversal a dead zone takes a fixed travel, and so does a slow pole of G: its part of the velocity has not
settled when the motion turns. To first order only the sum of both can be seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.slow_poles import FASTEST_SHARE, FEWEST_SAMPLES
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import as_coordinates
from bayes_hw.record import Record

HALF_WIDTH = "dead_zone.half_width"
SLOW, FAST, PAIRS, STATIC = "slow poles", "fast real poles", "resonances and other pairs", "limits and gain"

DRAWS = 4000
RIDGE = 1e-9


@dataclass(frozen=True)
class Trade:
    """Standard deviation `sd` of the half width (output units), what is left of it where all parameters of
    a group are known (`sd_known`), and the travel that slow poles lose at each reversal of the usual command:
    `lag`, mean and standard deviation, None where there are none."""

    half_width: float
    sd: float
    sd_known: dict[str, float]
    lag: tuple[float, float] | None
    unit: str

    def share(self, group: str) -> float:
        """Of the half width's variance that knowing the group would take away."""
        return 1 - (self.sd_known[group] / self.sd) ** 2

    @property
    def sentence(self) -> str:
        """What the records can tell of the two, in words."""
        if self.lag is None or SLOW not in self.sd_known:
            return (
                "G has no slow pole: a slow lag of the axis, had it one, would have been taken for dead zone"
            )
        lag, spread = self.lag
        return (
            "dead zone and slow poles of G trade places, both lose travel at each reversal: with the slow "
            f"poles known the half width would be known to {self.sd_known[SLOW]:.2g} {self.unit} instead of "
            f"{self.sd:.2g} ({100 * self.share(SLOW):.0f} % of its variance is theirs); under the usual "
            f"command of these records they lose {lag:.2g} ± {spread:.1g} {self.unit}, the dead zone "
            f"{self.half_width:.2g} ± {self.sd:.1g} on either side"
        )

    def to_dict(self) -> dict[str, Any]:
        """The entry `dead_zone_trade` of posterior.json and identifiability.json."""
        return {
            "sd": self.sd,
            "sd_known": self.sd_known,
            "share_of_variance": {group: self.share(group) for group in self.sd_known},
            "slow_lag": None if self.lag is None else {"mean": self.lag[0], "sd": self.lag[1]},
            "unit": self.unit,
            "sentence": self.sentence,
        }


def trade_of(axis: AxisParameters, values: FloatArray, records: Sequence[Record]) -> Trade | None:
    """From draws (..., parameters) of values, those of the axis first; None where G's roots are held.

    What is left of the half width's variance given a group is that of a normal distribution with the draws'
    covariance in coordinates.
    """
    if axis.free != "all":
        return None
    flat = values.reshape(-1, values.shape[-1])
    draws = flat[:: max(1, len(flat) // DRAWS), : len(axis.parameters)]
    coordinates = as_coordinates(axis.parameters, draws.T)
    covariance = np.cov(coordinates)
    row = axis.names.index(HALF_WIDTH)
    half_width, sd = float(np.mean(draws[:, row])), float(np.std(draws[:, row]))
    groups = _groups(axis, draws.mean(axis=0), records)
    known = {
        group: sd * float(np.sqrt(_left(covariance, row, rows) / covariance[row, row]))
        for group, rows in groups.items()
        if rows
    }
    return Trade(half_width, sd, known, _lag(axis, draws, records), axis.model.units.output)


def _left(covariance: FloatArray, row: int, known: list[int]) -> float:
    """Conditional variance of one coordinate given others, computed in units of their widths."""
    variances = np.diag(covariance)
    widths = np.sqrt(np.where(variances > 0, variances, 1.0))
    correlation = covariance / np.outer(widths, widths)
    own = correlation[np.ix_(known, known)] + RIDGE * np.eye(len(known))
    cross = correlation[known, row]
    explained = float(cross @ np.linalg.solve(own, cross))
    return float(covariance[row, row] * max(1 - explained, 0.0))


def _shortest(records: Sequence[Record]) -> float:
    """The shortest time constant that is slow, in samples."""
    return max(FEWEST_SAMPLES, FASTEST_SHARE * max(len(record) for record in records))


def _groups(axis: AxisParameters, mean: FloatArray, records: Sequence[Record]) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {SLOW: [], FAST: [], PAIRS: [], STATIC: []}
    fastest = np.exp(-1 / _shortest(records))
    slowest_hz = axis.model.sample_rate_hz / (2 * np.pi * _shortest(records))
    values = dict(zip(axis.names, mean, strict=True))
    poles = axis.linear_batch(mean[:, None]).real_poles[:, 0]
    for row, name in enumerate(axis.names):
        owner = name.partition(".")[0]
        if owner.startswith("real_pole"):
            group = SLOW if poles[int(owner.removeprefix("real_pole")) - 1] > fastest else FAST
        elif owner.startswith(("mode", "pole_pair")):
            group = SLOW if values[f"{owner}.frequency_hz"] < slowest_hz else PAIRS
        elif name == HALF_WIDTH or name.startswith("start"):
            continue
        else:
            group = STATIC
        found[group].append(row)
    return found


def _lag(axis: AxisParameters, draws: FloatArray, records: Sequence[Record]) -> tuple[float, float] | None:
    """What slow components of w come to under the root mean square of the commands that pass the limits."""
    batch = axis.linear_batch(draws.T)
    real_residues, pair_residues, _ = batch.residues()
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.abs(np.log(batch.real_poles.mean(axis=1)))
        pair_speed = np.abs(np.log(batch.pair_poles.mean(axis=1)))
    limit = 1 / _shortest(records)
    real = (speed < limit) & (np.abs(batch.real_poles - 1).max(axis=1) > 0)
    pairs = pair_speed < limit
    if not np.any(real) and not np.any(pairs):
        return None
    steady = np.sum(real_residues[real] / (1 - batch.real_poles[real]), axis=0)
    steady = steady + 2 * np.sum((pair_residues[pairs] / (1 - batch.pair_poles[pairs])).real, axis=0)
    lower, upper = draws[:, 0].mean(), draws[:, 1].mean()
    passed = np.concatenate([np.clip(record.u, lower, upper) for record in records])
    usual = float(np.sqrt(np.mean(passed**2)))
    travel = -usual * steady
    return float(np.mean(travel)), float(np.std(travel))
