"""Uncertainty sets for robust design: how far the draws of G lie from the nominal one, under one weight."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from scipy import stats

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.loop import Loop, frequency_grid
from bayes_hw.control.weight import Weight, fit_weight

Kind: TypeAlias = Literal["multiplicative", "additive"]
KINDS: tuple[Kind, ...] = ("multiplicative", "additive")
ORDERS = (1, 2, 3)
LOWEST_SHARE = 1e-3
"""Lowest frequency covered, as a share of the sample rate. Draws of an integrator with different gains differ
without bound towards zero frequency, where no stable additive weight can follow them."""

SMALLEST_DISTANCE = 1e-9
ROUNDING = 1e-12
QUANTILES = (0.5, 0.95)


@dataclass(frozen=True, eq=False)
class UncertaintySet:
    """G = G0 (1 + W D) ("multiplicative") or G0 + W D ("additive") with any stable |D| <= 1.

    `distance_quantiles` (quantiles, frequencies) are those of |G / G0 - 1| or |G - G0| over the draws, and
    `floor` (frequencies,) the largest of the share of draws that the weights are to cover. `weights` are
    those of order 1, 2 and 3, `achieved` the share of fresh draws inside each at every frequency, with its 95
    % interval. Additive weights are in output units per input unit.
    """

    kind: Kind
    share: float
    frequency_hz: FloatArray
    distance_quantiles: FloatArray
    floor: FloatArray
    weights: tuple[Weight, ...]
    achieved: tuple[float, ...]
    intervals: tuple[tuple[float, float], ...]
    fresh_draws: int


def uncertainty_set(
    kind: Kind, nominal: AxisDraws, axis: AxisDraws, fresh: AxisDraws, share: float
) -> UncertaintySet:
    """The smallest set around `nominal` that holds `share` of the draws of `axis` at all frequencies at once.

    The shape of the weights follows the draws but those that most exceed the pointwise quantile of level
    `share` somewhere; their gain is then the smallest that covers the share.
    """
    rate = axis.sample_rate_hz
    frequency = frequency_grid(axis, rate, LOWEST_SHARE)
    distance = distances(kind, nominal, axis, frequency)
    typical = np.maximum(np.quantile(distance, share, axis=0), SMALLEST_DISTANCE * distance.max())
    excess = np.max(distance / typical, axis=1)
    floor = distance[excess <= np.quantile(excess, share)].max(axis=0)
    floor = np.maximum(floor, SMALLEST_DISTANCE * distance.max())
    weights = tuple(
        _shrunk(fit_weight(frequency, floor, order, rate), frequency, distance, share) for order in ORDERS
    )
    fresh_distance = distances(kind, nominal, fresh, frequency)
    inside = [int(np.count_nonzero(covers(w, frequency, fresh_distance))) for w in weights]
    return UncertaintySet(
        kind=kind,
        share=share,
        frequency_hz=frequency,
        distance_quantiles=np.quantile(distance, QUANTILES, axis=0),
        floor=floor,
        weights=weights,
        achieved=tuple(hits / fresh.count for hits in inside),
        intervals=tuple(_binomial(hits, fresh.count) for hits in inside),
        fresh_draws=fresh.count,
    )


def distances(kind: Kind, nominal: AxisDraws, axis: AxisDraws, frequency_hz: FloatArray) -> FloatArray:
    """|G / G0 - 1| or |G - G0| of every draw, shape (draws, frequencies)."""
    centre = nominal.response(frequency_hz)
    difference = np.abs(axis.response(frequency_hz) - centre)
    return difference / np.abs(centre) if kind == "multiplicative" else difference


def covers(weight: Weight, frequency_hz: FloatArray, distance: FloatArray) -> BoolArray:
    """Whether each row of `distance` (draws, frequencies) lies below |W| everywhere."""
    return np.asarray(np.all(distance <= weight.magnitude(frequency_hz), axis=1), dtype=np.bool_)


def _shrunk(weight: Weight, frequency_hz: FloatArray, distance: FloatArray, share: float) -> Weight:
    """`weight` with the smallest gain that still covers `share` of the draws, and a binomial standard error
    more: a shape of low order that touches the floor of chosen draws holds others as well."""
    reach = np.max(distance / weight.magnitude(frequency_hz), axis=1)
    level = min(1.0, share + np.sqrt(share * (1 - share) / len(reach)))
    factor = float(np.quantile(reach, level, method="higher"))
    return replace(weight, gain=weight.gain * factor * (1 + ROUNDING))


def robustness_peak(weight: Weight, nominal: Loop, frequency_hz: FloatArray) -> float:
    """Largest |W T| of the nominal loop, T = L / (1 + L): below one, the loop is stable for the whole
    multiplicative set (small gain; Skogestad and Postlethwaite, Multivariable Feedback Control, eq. 7.33).

    Only for a controller at the model's own rate.
    """
    response = nominal.response(frequency_hz)[0]
    return float(np.max(weight.magnitude(frequency_hz) * np.abs(response / (1 + response))))


def _binomial(hits: int, count: int) -> tuple[float, float]:
    interval = stats.binomtest(hits, count).proportion_ci(0.95)
    return float(interval.low), float(interval.high)
