"""The best cascade without any effect: where the joint search begins."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from bayes_hw.arrays import spanned
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import JointScale
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.experiment import SMALLEST_COMMAND
from bayes_hw.identify.growth.delay import at_delay, coarse_delay, safe_delay, too_long, with_longer_delay
from bayes_hw.identify.growth.lowered import lowered
from bayes_hw.identify.growth.search import (
    Grown,
    absorbed,
    beyond_all_commands,
    grow,
    likeliest,
    smallest_cascade,
)
from bayes_hw.identify.growth.slow_poles import with_real_poles
from bayes_hw.identify.long_records import descended_on, slow_factor, with_own_delay
from bayes_hw.identify.noise import MAX_ORDER
from bayes_hw.identify.whole_cascade import SMALL_ORDER
from bayes_hw.record import Record

LARGEST_ORDER = 14
LOWERED_SAMPLES, LEAST_FACTOR = 6000, 3
"""Samples that a slow axis keeps at a lower rate, at least, and by how much that is lower."""

NOISE_LEVELS = (1.0, 4.0)
"""Multiples of the white noise's level from which half widths start: a start may end in a poor minimum."""


def grown_base(records: Sequence[Record], noise_level: float) -> JointFit:
    """The best cascade without effects; of several starts the best at a small order is grown on.

    Where the noise has taken up what a cascade could explain, one grown on plain residuals goes on under it
    too, and the likelier is taken.
    """
    commands = np.concatenate([record.u for record in records])
    largest = float(np.abs(commands).max())
    structure = Structure(
        0, True, 0, 0,
        lower=bool(commands.min() < -SMALLEST_COMMAND * largest),
        upper=bool(commands.max() > SMALLEST_COMMAND * largest),
        dead_zone=True,
    )  # fmt: skip
    best = _grown(records, structure, noise_level, MAX_ORDER)
    if absorbed(best):
        plain = _grown(records, structure, noise_level, 0)
        best = _least([best, *grow(plain.under_noise(MAX_ORDER), LARGEST_ORDER).values()])
    values = best.values
    sigma = best.point.rms
    white = float(np.sqrt(best.point.sum_of_squares / best.point.samples))
    scale = natural_scale(records, (values.lower, values.upper), values.integrator_residue, min(sigma, white))
    return JointFit.of_grown(best, scale).descended()


def _grown(records: Sequence[Record], structure: Structure, noise_level: float, most_noise: int) -> Grown:
    """Of the least criterion where the noise is of orders up to `most_noise`, with its delay; of many samples
    of a slow axis, all of them measured, at a lower rate first, at which zeros and delays do not stand in for
    each other."""
    factor = _lower_by(records)
    if factor == 1:
        return _grown_at_rate(records, structure, noise_level, most_noise)
    slower = [lowered(record, factor) for record in records]
    found = _grown_at_rate(slower, structure, noise_level, most_noise)
    return with_own_delay(with_real_poles(descended_on(found, records, factor, most_noise)), factor)


def _lower_by(records: Sequence[Record]) -> int:
    """The factor of the lower rate, 1 where it is not worth it."""
    most = sum(len(record) for record in records) // LOWERED_SAMPLES
    if most < LEAST_FACTOR or any(record.measured is not None for record in records):
        return 1
    factor = min(most, slow_factor(records))
    return factor if factor >= LEAST_FACTOR else 1


def _grown_at_rate(
    records: Sequence[Record], structure: Structure, noise_level: float, most_noise: int
) -> Grown:
    small = [
        _largest(grow(smallest_cascade(records, structure, level * noise_level, most_noise), SMALL_ORDER))
        for level in NOISE_LEVELS
    ]
    at = coarse_delay(beyond_all_commands(likeliest(small)))
    while True:
        best = _least(grow(at, LARGEST_ORDER).values())
        if not too_long(best):
            return with_longer_delay(best)
        at = at_delay(at, safe_delay(best)).descended()


def _least(items: Iterable[Grown]) -> Grown:
    """The one of the least criterion."""
    return min(items, key=lambda item: item.criterion)


def _largest(pool: Mapping[int, Grown]) -> Grown:
    return pool[max(pool)]


def natural_scale(
    records: Sequence[Record], limits: tuple[float, float], gain: float, sigma: float
) -> JointScale:
    """Sizes of the records, which all begin at the same angle: their travel is that of all together."""
    largest = max(float(np.abs(record.u).max()) for record in records)
    return JointScale(
        speed=min(abs(limits[0]), abs(limits[1]), largest),
        gain=abs(gain),
        travel=spanned([record.y for record in records]),
        sigma=sigma,
        samples=max(len(record) for record in records),
        rate_hz=records[0].sample_rate_hz,
    )
