"""Records at a lower rate that keep the commands within each longer interval.

A saturation clips every command, not their mean: at a lower rate what drives G over an interval is the mean
of the clipped commands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.record import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class LoweredRecord(Record):
    """A record whose u is the mean of the commands `within` (samples, factor) each interval."""

    within: FloatArray


def lowered(record: Record, factor: int) -> Record:
    """The record at a rate lower by `factor`, outputs taken at the start of each interval."""
    if factor == 1:
        return record
    whole = len(record) // factor * factor
    within: FloatArray = record.u[:whole].reshape(-1, factor)
    return LoweredRecord(
        name=record.name,
        t=record.t[:whole:factor],
        u=within.mean(axis=1),
        y=record.y[:whole:factor],
        sample_rate_hz=record.sample_rate_hz / factor,
        units=record.units,
        measured=None if record.measured is None else record.measured[:whole:factor],
        known={name: values[:whole:factor] for name, values in record.known.items()},
        origin=record.origin,
        level_sd=record.level_sd,
        within=within,
    )


def commands(record: Record) -> FloatArray:
    """The commands of a record, (samples,) or (samples, factor)."""
    return record.within if isinstance(record, LoweredRecord) else record.u


def clipped(u: FloatArray, lower: float, upper: float) -> FloatArray:
    """What of commands passes the limits, (samples,): the mean over each interval."""
    if u.ndim == 1:
        return np.asarray(np.clip(u, lower, upper))
    v = np.empty(len(u))
    _mean_clipped(u, lower, upper, v)
    return v


def beyond(u: FloatArray, lower: float, upper: float) -> tuple[FloatArray, FloatArray]:
    """The share of each interval (samples,) below the lower limit, and above the upper one."""
    if u.ndim == 1:
        return (u < lower).astype(float), (u > upper).astype(float)
    below, above = np.empty(len(u)), np.empty(len(u))
    _shares_beyond(u, lower, upper, below, above)
    return below, above


@compiled(nogil=True)
def _mean_clipped(u, lower, upper, mean):  # type: ignore[no-untyped-def]
    for k in range(len(u)):
        total = 0.0
        for i in range(u.shape[1]):
            total += min(max(u[k, i], lower), upper)
        mean[k] = total / u.shape[1]


@compiled(nogil=True)
def _shares_beyond(u, lower, upper, below, above):  # type: ignore[no-untyped-def]
    for k in range(len(u)):
        low = high = 0
        for i in range(u.shape[1]):
            low += u[k, i] < lower
            high += u[k, i] > upper
        below[k], above[k] = low / u.shape[1], high / u.shape[1]
