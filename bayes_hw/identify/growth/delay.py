"""The delay of G: a coarse scan at a small order, then sample by sample at full order.

A delay that is too short costs a pole or two, one that is too long cannot be made good. A small cascade may
ask for too long a one, since it has few poles for the lag: where a sample less is worth its parameter to the
grown cascade, growth begins again below. The chosen cascade then takes up delay for as long as that costs
less. Fewer poles ask for less delay: every smaller cascade is tried at the delay that suits it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.growth.extension import advanced
from bayes_hw.identify.growth.search import Grown, likeliest, with_least_squares
from bayes_hw.record import Record

LONGEST_S = 5.0
LONGEST_SHARE = 0.1
"""Of the longest record: no longer delay is looked for."""

SCAN_RATIO = 1.35
SCAN_STEPS = 2
SAFE_SHARE = 0.75
"""Of a delay that is too long."""

APPARENT_TAPS = 6

DELAYS_TRIED = 4
CLEAR = 3.0
"""Errors that an output must be away from zero to have left the dead zone."""

WORTHWHILE_NATS = 1.0
"""A neighbouring delay that gains less is the last."""

SAME_NATS = 0.5
"""Delays that differ by less are as likely as each other."""


def longest_delay(records: Sequence[Record]) -> int:
    """The longest delay looked for, in samples."""
    longest = max(records, key=len)
    return max(4, int(min(LONGEST_S * longest.sample_rate_hz, LONGEST_SHARE * len(longest))))


def apparent_delay(records: Sequence[Record]) -> int:
    """The delay behind which the increments of the output follow APPARENT_TAPS commands in a row best, by
    least squares without any limit, dead zone or pole."""
    longest = longest_delay(records)
    products = np.zeros((longest + 1, APPARENT_TAPS + 1, APPARENT_TAPS + 1))
    for record in records:
        increments = np.diff(record.y)
        first = longest + APPARENT_TAPS - 1
        known = np.flatnonzero((record.measured_samples[1:] & record.measured_samples[:-1])[first:]) + first
        for delay in range(longest + 1):
            taps = [record.u[known - delay - tap] for tap in range(APPARENT_TAPS)]
            rows = np.stack([*taps, increments[known]])
            products[delay] += rows @ rows.T
    left = []
    for matrix in products:
        weights = np.linalg.lstsq(matrix[:-1, :-1], matrix[:-1, -1], rcond=None)[0]
        left.append(matrix[-1, -1] - weights @ matrix[:-1, -1])
    return int(np.argmin(left))


def at_delay(item: Grown, delay_samples: int) -> Grown:
    """The cascade at another delay, before any descent: its impulse response is cut or moved."""
    structure, values = item.structure, item.values
    while structure.delay_samples < delay_samples:
        structure, values = advanced(structure, values)
    structure = replace(structure, delay_samples=delay_samples)
    return Grown.at(structure, values, item.response.records, item.point.most_noise)


def coarse_delay(item: Grown) -> Grown:
    """`item` at the delay that fits best after short descents: a geometric scan, then neighbours."""
    longest, delays, delay = longest_delay(item.response.records), {0}, 1.0
    while delay <= longest:
        delays.add(round(delay))
        delay = max(delay * SCAN_RATIO, delay + 1)
    best = likeliest([at_delay(item, d).descended(SCAN_STEPS) for d in sorted(delays)])
    stride = max(1, best.structure.delay_samples // 8)
    while True:
        here = best.structure.delay_samples
        near = [d for d in (here - stride, here + stride) if 0 <= d <= longest]
        found = likeliest([best, *(at_delay(best, d).descended(SCAN_STEPS) for d in near)])
        if found is not best:
            best = found
        elif stride == 1:
            return best
        else:
            stride //= 2


def at_better_delay(item: Grown, reach: int | None = None) -> Grown:
    """`item` or, where that is likelier, the same poles begun at another delay, no farther than `reach`, with
    the weights and initial states that least squares gives there.

    A likelihood has many maxima over the delay, for poles and zeros stand in for one: DELAYS_TRIED of those
    where least squares leaves locally least are descended from, and from their neighbours while that gains.
    """
    longest, here = longest_delay(item.response.records), item.structure.delay_samples
    delays = np.arange(longest + 1)
    if reach is not None:
        delays = delays[np.abs(delays - here) <= reach]
    left = np.array([np.inf, *(_solved_at(item, int(d))[0] for d in delays), np.inf])
    lowest = np.flatnonzero((left[1:-1] <= left[:-2]) & (left[1:-1] <= left[2:]))
    tried = delays[sorted(lowest, key=lambda i: left[1 + i])[:DELAYS_TRIED]]
    return likeliest([item, *(_climbed(begun_at(item, int(d)), longest) for d in tried)])


def _climbed(item: Grown, longest: int) -> Grown:
    """`item`, or what is begun from it a sample of delay up or down, again and again, while that gains
    WORTHWHILE_NATS; no delay twice."""
    seen = {item.structure.delay_samples}
    while True:
        here = item.structure.delay_samples
        near = [d for d in (here - 1, here + 1) if 0 <= d <= longest and d not in seen]
        seen.update(near)
        found = likeliest([item, *(begun_at(item, d) for d in near)])
        if found.log_likelihood < item.log_likelihood + WORTHWHILE_NATS:
            return likeliest([item, found])
        item = found


def begun_at(item: Grown, delay_samples: int) -> Grown:
    """Descended from the poles of `item` and solved weights at another delay."""
    structure = replace(item.structure, delay_samples=delay_samples)
    _, values = _solved_at(item, delay_samples)
    return Grown.at(structure, values, item.response.records, item.point.most_noise).descended()


def _solved_at(item: Grown, delay_samples: int) -> tuple[float, CascadeValues]:
    """What `item` at another delay leaves, and its values, see `with_least_squares`."""
    structure = replace(item.structure, delay_samples=delay_samples)
    return with_least_squares(structure, item.values, item.response.records, CLEAR * item.point.rms)


def sample_nats(item: Grown) -> float:
    """What a sample of the impulse response has to be worth: as much as one parameter of the criterion.

    That the response is zero for a sample longer is a hypothesis of one parameter less.
    """
    return 0.5 * float(np.log(item.point.samples))


def too_long(item: Grown) -> bool:
    """Whether a sample of delay less is worth its parameter, everything free."""
    if item.structure.delay_samples == 0:
        return False
    shorter = at_delay(item, item.structure.delay_samples - 1).descended()
    return shorter.log_likelihood > item.log_likelihood + sample_nats(item)


def safe_delay(item: Grown) -> int:
    """A delay that is short enough, in samples, where that of `item` is not."""
    return max(0, int(np.floor(SAFE_SHARE * item.structure.delay_samples)) - 1)


def with_shorter_delay(item: Grown) -> Grown:
    """`item` with less delay, sample by sample, for as long as it is likelier."""
    while item.structure.delay_samples:
        moved = at_delay(item, item.structure.delay_samples - 1).descended()
        if moved.log_likelihood <= item.log_likelihood:
            return item
        item = moved
    return item


def at_longest_delay(item: Grown) -> Grown:
    """`item` at the longest delay, a sample at a time, that costs less than SAME_NATS: where commands are
    smooth, zeros stand in for delay, and a shorter one fits as well."""
    longest, best = longest_delay(item.response.records), item
    while best.structure.delay_samples < longest:
        later = begun_at(best, best.structure.delay_samples + 1)
        if later.log_likelihood < item.log_likelihood - SAME_NATS:
            return best
        best = later
    return best


def with_longer_delay(item: Grown) -> Grown:
    """`item` with as much delay as costs no more, a sample, than `sample_nats`."""
    longest, slack = longest_delay(item.response.records), sample_nats(item)
    while item.structure.delay_samples < longest:
        moved = at_delay(item, item.structure.delay_samples + 1).descended()
        if moved.log_likelihood < item.log_likelihood - slack:
            return item
        item = moved
    return item
