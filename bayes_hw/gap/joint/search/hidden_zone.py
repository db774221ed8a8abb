"""A slow error of the axis and the dead zone that hides it.

What moves the axis slowly shows outside the dead zone and not inside: an error that comes and goes with the
zone's edges is no stationary noise of readings, and what explains it best at the edges is wrong elsewhere.
Parameters are therefore sought on samples clear of the zone, however the slow error shifts the axis. What
lies deep inside tells causes apart: there a torque does not show, and an angle that walks shows whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit
from bayes_hw.gap.joint.noise.slow_noise import WIND
from bayes_hw.gap.joint.residuals.heavy_tails import tails_of
from bayes_hw.gap.joint.search.effect_moves import each_cause
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import residuals_at
from bayes_hw.record import Record

LEFT_OUT = "what a slow error may shift into the dead zone is left out"
"""Said where a search goes on with samples that are clear of the zone."""

CLEAR = 2.5
"""Root mean squares of the slow error by which it may shift the axis."""

LEAST_CLEAR = 0.5
"""Share of the samples that must be clear of the zone."""

SLOW = 1.3
"""Root mean square error over the innovations' standard deviation from which an error is slow."""

FEWEST_INSIDE = 20
"""Samples deep inside the zone that tell anything."""


def clear_of_zone(fit: JointFit, records: Sequence[Record]) -> tuple[Record, ...] | None:
    """`records` with what lies in reach of the dead zone taken for not measured; None where the error that
    the fit leaves is not slow, where that is none of the samples or too many, or where a record would be
    left without any."""
    return None if fit.point.rms < SLOW * fit.innovation_sigma else out_of_reach(fit, records)


def where_it_shows(fit: JointFit, records: Sequence[Record]) -> tuple[Record, ...] | None:
    """`records` clear of the dead zone where rare large innovations are those of a slow error that the zone
    takes in and lets out: none are left there. None else."""
    if tails_of(fit)[0] < VERIFIED_NATS:
        return None
    clear = clear_of_zone(fit, records)
    if clear is None or tails_of(fit, [record.measured_samples for record in clear])[0] > 0:
        return None
    return clear


def out_of_reach(fit: JointFit, records: Sequence[Record]) -> tuple[Record, ...] | None:
    """As `clear_of_zone`, of an error that is known to be slow."""
    reach = fit.values.cascade.half_width + _shift(fit)
    clear = [np.abs(w) > reach for w in _motion(fit, records)]
    found = _measured_where(records, clear)
    kept = [int(record.measured_samples.sum()) for record in found]
    whole = sum(int(record.measured_samples.sum()) for record in records)
    return found if LEAST_CLEAR * whole <= sum(kept) < whole and min(kept) > 0 else None


def deep_inside(fit: JointFit, records: Sequence[Record]) -> list[BoolArray]:
    """Which samples (samples,) of every record, of those that the fit has not seen, were measured so deep
    inside the zone that no slow error of the size that it leaves shows; none where these are too few."""
    depth = fit.values.cascade.half_width - _shift(fit)
    found = [
        (np.abs(w) < depth) & r.measured_samples & ~own.measured_samples
        for w, r, own in zip(_motion(fit, records), records, fit.response.records, strict=True)
    ]
    enough = sum(int(mask.sum()) for mask in found) >= FEWEST_INSIDE
    return found if enough else [np.zeros_like(mask) for mask in found]


def nats_inside(fit: JointFit, records: Sequence[Record], inside: Sequence[BoolArray]) -> float:
    """Log-likelihood of what `records` show `inside` the zone, given what lies clear of it, under the cause
    of the noise of a fit to the latter."""
    point, whitener, cause = fit.point, fit.slow, fit.response.cause
    if whitener is None or cause is None or not any(mask.any() for mask in inside):
        return 0.0
    clear = fit.response.told
    either = [a | b for a, b in zip(clear, inside, strict=True)]
    response = replace(fit.response, records=_measured_where(records, either))
    both = response.told
    inside = [a & b for a, b in zip(inside, both, strict=True)]
    errors = residuals_at(response, point.coordinates, whitener)
    variance = fit.innovation_sigma**2
    if cause.cause != WIND:
        every = _log_likelihood(whitener, errors, both, variance)
        return every - _log_likelihood(whitener, errors, clear, variance)
    own = Whitener.of_partial(np.array([whitener.memory]))
    return _log_likelihood(own, errors, inside, variance)


def likelier_cause(fit: AnyFit, whole: Sequence[Record]) -> tuple[AnyFit, float, list[AnyFit]]:
    """The fit with the likelier cause of its noise, by how many nats it leads, and with each: by what the
    fit's records show, and by what of the `whole` records lies inside the zone where they are less than
    those."""
    caused = each_cause(fit)
    inside = deep_inside(max(caused, key=lambda one: one.score), whole)
    worth = [one.score + nats_inside(one, whole, inside) for one in caused]
    ranked = np.argsort(worth)
    return caused[ranked[-1]], float(worth[ranked[-1]] - worth[ranked[0]]), caused


def _shift(fit: JointFit) -> float:
    return CLEAR * fit.point.rms


def _motion(fit: JointFit, records: Sequence[Record]) -> list[FloatArray]:
    """Simulated position (samples,) before the output block of every record."""
    return [fit.response.simulate(fit.values, r.u, r.known).w for r in records]


def _measured_where(records: Sequence[Record], masks: Sequence[BoolArray]) -> tuple[Record, ...]:
    return tuple(
        replace(r, measured=r.measured_samples & mask) for r, mask in zip(records, masks, strict=True)
    )


def _log_likelihood(
    whitener: Whitener, errors: Sequence[FloatArray], masks: Sequence[BoolArray], variance: float
) -> float:
    """Of the errors where `masks` say so, innovations of the full order having that variance."""
    found = 0.0
    for e, mask in zip(errors, masks, strict=True):
        count, squares, logarithms = whitener.sums(np.nan_to_num(e), mask)
        found -= 0.5 * (count * np.log(2 * np.pi * variance) + squares / variance) + logarithms
    return float(found)
