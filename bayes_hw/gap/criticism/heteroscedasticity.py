"""Heteroscedasticity: whether slow noise is as strong whatever the axis does, as wind or a walk would be.

Slow noise takes up what no effect of the catalogue explains. What comes of the command then looks like gusts
that are stronger after certain commands or motions. The variance of the disturbance's increments is
multiplied in one regime and divided elsewhere; the likelihood ratio to the same strength everywhere is, where
the noise is what it is said to be, that of one parameter (chi-squared of one degree).

A force that never changes passes for a very slow wind. Beside a random walk, what a constant added to the
command takes of the residuals is held against what a torque that changes in time still takes beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.criticism.free_functions import Motion, free_functions, knots_in_time, responses_of
from bayes_hw.gap.criticism.negative_log_p import chi_squared_negative_log_p
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.slow_noise import wandering_background
from bayes_hw.gap.noise.state_noise import StateNoise, View

LOG_STRENGTHS = (-1.0, -0.5, 0.5, 1.0)
"""Of the variance in a regime, tried for the largest likelihood."""

FREED_S = 1.5
CHANGED_S = 0.3
LARGE_CHANGE = 0.8
"""Seconds after a limit was left and after a large change of the command, one above this quantile."""

RAREST = 0.02
"""A regime that holds for a smaller share of a record, or of whose rest that is true, tells nothing there."""


class Unevenness(NamedTuple):
    """The regime in which slow noise differs most: minus the log of a tail probability, and the share of the
    variance that is missing where it is weaker."""

    regime: str
    negative_log_p: float
    share: float


class Steadiness(NamedTuple):
    """By how many nats a constant negative_log_p more than what changes beside it, and the mean square,
    output units, of what it takes."""

    negative_log_p: float
    square: float


def steadiness(fit: Fit, found: Sequence[Motion]) -> Steadiness:
    """Whether the residuals of `fit`, its motion `found`, show a constant command rather than a wind."""
    chain = fit.hypothesis.chain(fit.values)
    lengths = [len(m.w) for m in found]
    constant = responses_of(found, chain, "command", [np.ones((length, 1)) for length in lengths])
    changing = responses_of(found, chain, "load_torque", knots_in_time(lengths))
    both = [np.concatenate(columns, axis=1) for columns in zip(constant, changing, strict=True)]
    noise = wandering_background(fit)
    shown = {"constant": constant, "both": both}
    alone, together = free_functions(shown, fit.residuals, fit.jacobians, noise)
    beside = chi_squared_negative_log_p(2 * (together.gain - alone.gain), together.shapes - alone.shapes)
    negative_log_p = chi_squared_negative_log_p(2 * alone.gain, alone.shapes) - beside
    return Steadiness(max(negative_log_p, 0.0), alone.size**2)


def regimes_of(found: Sequence[Motion], rate: float) -> dict[str, list[BoolArray]]:
    """What the axis does, by name: masks (samples,), a record each."""
    limited = [m.limited != m.command for m in found]
    left = [np.concatenate([[False], at[:-1] & ~at[1:]]) for at in limited]
    changes = [np.abs(np.diff(m.command, prepend=m.command[0])) for m in found]
    large = float(np.quantile(np.concatenate(changes), LARGE_CHANGE))
    usual = float(np.median(np.abs(np.concatenate([m.speed for m in found]))))
    return {
        "at a limit": limited,
        "after a limit": [_within(at, FREED_S * rate) for at in left],
        "after a change of the command": [_within(c > large, CHANGED_S * rate) for c in changes],
        "at speed": [np.abs(m.speed) > usual for m in found],
    }


def unevenness(
    noise: StateNoise, residuals: Sequence[FloatArray], regimes: dict[str, list[BoolArray]]
) -> Unevenness:
    """The regime, of all `regimes`, in which the `noise` of `residuals` (samples,) a record differs most."""
    views = noise.views or tuple(View.everywhere(len(e)) for e in residuals)
    even = replace(noise, views=views).fitted_to(residuals).log_likelihood
    best, told = Unevenness("", 0.0, 0.0), 0
    for name, masks in regimes.items():
        if not any(RAREST < mask.mean() < 1 - RAREST for mask in masks):
            continue
        told += 1
        for log_strength in LOG_STRENGTHS:
            changes = [_log_strengths(mask, log_strength) for mask in masks]
            uneven = tuple(v._replace(strength=np.exp(c)) for v, c in zip(views, changes, strict=True))
            gain = replace(noise, views=uneven).fitted_to(residuals).log_likelihood - even
            negative_log_p = chi_squared_negative_log_p(2 * gain, 1)
            if negative_log_p > best.negative_log_p:
                most = max(float(np.ptp(c)) for c in changes)
                best = Unevenness(name, negative_log_p, 1 - float(np.exp(-most)))
    return best._replace(negative_log_p=max(best.negative_log_p - float(np.log(max(told, 1))), 0.0))


def _log_strengths(mask: BoolArray, inside: float) -> FloatArray:
    """`inside` the `mask`, outside what makes the mean zero, (samples,); zero where the record tells nothing.

    Of every record its own: that one record is windier than another says nothing of the command.
    """
    share = float(mask.mean())
    if not RAREST < share < 1 - RAREST:
        return np.zeros(len(mask))
    return np.where(mask, inside, -inside * share / (1 - share))


def _within(events: BoolArray, samples: float) -> BoolArray:
    """Whether there was an event at this sample or in the last `samples` before it, (samples,)."""
    count = np.cumsum(np.concatenate([[0], events]))
    now = np.arange(len(events)) + 1
    return np.asarray(count[now] > count[np.maximum(now - 1 - int(samples), 0)])
