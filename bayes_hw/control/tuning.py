"""PI and PID settings that do well over the whole posterior, and those that do well on its point estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from scipy import optimize

from bayes_hw.arrays import FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Margins, Requirements, loop_margins

Structure: TypeAlias = Literal["PI", "PID"]

LOWER_LEVEL = 0.05
GAIN_POINTS = 18
SEARCH_ERRORS = 2.0
GAIN_BISECTIONS = 7
LOWEST_CROSSOVER_SHARE, HIGHEST_CROSSOVER_SHARE = 1e-3, 0.35
"""Range of gains that are tried, by the crossover of the nominal axis, as shares of the controller's rate."""

INTEGRAL_RATIOS = (2.0, 4.0, 7.0, 10.0)
DERIVATIVE_PERIODS = (0.5, 1.5, 4.0)
"""Where the search starts: integral times in units of one over the crossover (rad/s, of the velocity gain
alone), derivative times in periods of the controller."""

LEAST_RATIO, LARGEST_RATIO = 1.0, 10.0
"""Range of the integral ratio. Bandwidth alone would have the integral vanish; at ten it costs 6 degrees of
phase and still removes a constant disturbance within a few times ten over the crossover."""

LONGEST_DERIVATIVE_PERIODS = 50.0
DERIVATIVE_FILTER_SHARE = 0.2
"""Time constant of the derivative's filter, as a share of the derivative time."""


@dataclass(frozen=True, eq=False)
class Tuned:
    """Settings found, and how they do on draws that the search has not seen.

    `lower_bandwidth_hz` is the 5 % quantile of the bandwidth, zero for draws that are unstable; `broken` the
    share of draws that miss a margin. `feasible` is False where no setting kept the margins.
    """

    controller: Controller
    margins: Margins
    lower_bandwidth_hz: float
    broken: float
    feasible: bool


@dataclass(frozen=True, eq=False)
class Tuning:
    """One structure tuned over the draws (`robust`) and on the point estimate alone (`point`)."""

    structure: Structure
    requirements: Requirements
    share: float
    robust: Tuned
    point: Tuned


def tune(
    structure: Structure,
    template: Controller,
    nominal: AxisDraws,
    axis: AxisDraws,
    fresh: AxisDraws,
    requirements: Requirements,
    share: float,
) -> Tuning:
    """Settings of `structure` with the rate, limits, filters and delay of `template`.

    The robust ones have the largest 5 % quantile of bandwidth over the draws of `axis` of all that keep
    `requirements` for at least `share` of them, and two binomial standard errors more, lest the search
    profits from the draws that it happens to see; the point ones the largest bandwidth of `nominal` of all
    that keep them there. Both are then judged on `fresh`.
    """
    robust, robust_found = _best(structure, template, nominal, axis, requirements, share)
    point, point_found = _best(structure, template, nominal, nominal, requirements, 1.0)
    return Tuning(
        structure,
        requirements,
        share,
        _judged(
            replace(robust, name=f"{structure} tuned over the posterior"), fresh, requirements, robust_found
        ),
        _judged(
            replace(point, name=f"{structure} tuned on the point estimate"), fresh, requirements, point_found
        ),
    )


def lower_bandwidth(margins: Margins) -> float:
    """The 5 % quantile of the bandwidth in Hz, with zero for unstable draws."""
    return float(
        np.quantile(np.where(margins.stable, margins.bandwidth_hz, 0.0), LOWER_LEVEL, method="lower")
    )


def _judged(controller: Controller, fresh: AxisDraws, requirements: Requirements, feasible: bool) -> Tuned:
    margins = loop_margins(Loop(fresh, controller))
    broken = 1 - float(np.mean(margins.meets(requirements)))
    return Tuned(controller, margins, lower_bandwidth(margins), broken, feasible)


def _best(
    structure: Structure,
    template: Controller,
    nominal: AxisDraws,
    axis: AxisDraws,
    requirements: Requirements,
    share: float,
) -> tuple[Controller, bool]:
    """Grid over integral ratio and derivative time, then Nelder-Mead on their logarithms, with the best gain
    of each."""
    period = template.period_s
    needed = min(1.0, share + SEARCH_ERRORS * np.sqrt(share * (1 - share) / axis.count))
    gains = _gain_range(nominal, template)

    speed = abs(float(nominal.velocity_gain()[0])) * nominal.loop_gain

    def controller(gain: float, times: FloatArray) -> Controller:
        ratio = float(np.clip(times[0], LEAST_RATIO, LARGEST_RATIO))
        derivative_s = 0.0
        if structure == "PID":
            derivative_s = float(np.clip(times[1], 0, LONGEST_DERIVATIVE_PERIODS * period))
        return replace(
            template,
            proportional=gain,
            integral=gain * gain * speed / ratio,
            derivative=gain * derivative_s,
            derivative_filter_s=DERIVATIVE_FILTER_SHARE * derivative_s,
        )

    def score(candidate: Controller) -> float:
        """The bandwidth where the margins hold; else below zero, and the lower the fewer draws keep them."""
        margins = loop_margins(Loop(axis, candidate))
        kept = float(np.mean(margins.meets(requirements)))
        return lower_bandwidth(margins) if kept >= needed else kept - 1

    def with_best_gain(logarithm: FloatArray) -> tuple[float, Controller]:
        times = np.exp(logarithm)
        return _best_gain(lambda gain: score(controller(gain, times)), lambda g: controller(g, times), gains)

    integrals = np.log(INTEGRAL_RATIOS)
    derivatives = np.log(np.array(DERIVATIVE_PERIODS) * period)
    starts = (
        [np.array([i]) for i in integrals]
        if structure == "PI"
        else [np.array([i, d]) for i in integrals[1:] for d in derivatives]
    )
    tried = {tuple(start): with_best_gain(start) for start in starts}
    best_start = max(tried, key=lambda start: tried[start][0])

    def cost(logarithm: FloatArray) -> float:
        found = with_best_gain(logarithm)
        tried[tuple(logarithm)] = found
        return -found[0]

    optimize.minimize(
        cost,
        np.array(best_start),
        method="Nelder-Mead",
        options={
            "maxfev": 12 if structure == "PI" else 24,
            "initial_simplex": _simplex(np.array(best_start)),
        },
    )
    value, found = max(tried.values(), key=lambda pair: pair[0])
    return found, value >= 0


def _best_gain(
    score: Callable[[float], float], controller: Callable[[float], Controller], gains: FloatArray
) -> tuple[float, Controller]:
    """The best of `gains`, then bisection towards the next larger one."""
    scores = [score(float(gain)) for gain in gains]
    best = int(np.argmax(scores))
    value, gain = scores[best], float(gains[best])
    if best + 1 < len(gains):
        high = float(gains[best + 1])
        low = gain
        for _ in range(GAIN_BISECTIONS):
            middle = float(np.sqrt(low * high))
            found = score(middle)
            if found > value:
                value, gain, low = found, middle, middle
            else:
                high = middle
    return value, controller(gain)


def _gain_range(nominal: AxisDraws, template: Controller) -> FloatArray:
    """Proportional gains whose crossovers with the nominal axis spread over the range that is tried."""
    rate = template.sample_rate_hz
    crossovers = np.geomspace(LOWEST_CROSSOVER_SHARE * rate, HIGHEST_CROSSOVER_SHARE * rate, GAIN_POINTS)
    size = np.abs(nominal.response(crossovers)[0]) * nominal.loop_gain
    return np.asarray(np.sort(1 / size), dtype=np.float64)


def _simplex(start: FloatArray) -> FloatArray:
    return np.asarray(np.vstack([start, start + 0.35 * np.eye(len(start))]), dtype=np.float64)
