"""From the stamps of a log to uniform grids: which sample belongs where, what is missing, where a record
ends."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.log import time_stamps

LARGEST_JITTER = 1 / 3
"""Of the step: a stamp off its place by less belongs to that place without doubt."""

MOST_BRIDGED = 3
"""Samples missing one after another that stay in a record as unmeasured."""

FIRST_STAMPS = 16
STARTS = (0.0, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3)
LAWSON_ROUNDS, LEAST_WEIGHT = 30, 1e-9
MOST_NEAREST = 4096
"""Stamps up to which the nearest line is followed: over more of them least squares is as near."""

SCANNED_STAMPS = 256
RHYTHM_RANGE, RHYTHM_POINTS = 0.15, 8
"""Of the median step: how far the period may be from it; points of the scan a cycle over all stamps."""


class Grid(NamedTuple):
    """Where the rows `first` to `stop` of a log lie on a uniform grid.

    `places` are the grid's samples of these rows, the first 0; `start_s` and `rate_hz` are the grid's, and
    `jitter` is the largest distance of a stamp from its place in steps, 0 where rounding explains all.
    """

    first: int
    stop: int
    places: IntArray
    start_s: float
    rate_hz: float
    jitter: float

    @property
    def samples(self) -> int:
        return int(self.places[-1]) + 1

    @property
    def missing(self) -> int:
        """How many samples of the grid have no row."""
        return self.samples - len(self.places)


def stretches(t: FloatArray) -> list[tuple[int, int]]:
    """First and one past the last row of each stretch between gaps longer than may be bridged; t increases,
    in s, shape (rows,)."""
    steps = np.diff(t)
    ends = np.flatnonzero(steps >= (MOST_BRIDGED + 1.5) * np.median(steps)) + 1
    edges = [0, *map(int, ends), len(t)]
    return list(pairwise(edges))


def fit_grid(t: FloatArray, first: int = 0) -> Grid | None:
    """The uniform grid of increasing stamps, shape (rows,), in s, or None where some lie off every grid.

    Where rounding explains all, or stamps lie within 1 % of even steps, the rows follow each other. Otherwise
    a line is followed along the stamps, over a quarter more of them at each step, and every stamp belongs
    to the place nearest to it, from which it may be off by `LARGEST_JITTER`. Where no least-squares line from
    the first few stamps holds, that whose farthest stamp is nearest is followed, and last the rhythm of some
    hundred is sought.
    """
    rows = len(t)
    if rows < 2:
        return None
    if time_stamps.is_uniform(t):
        return Grid(first, first + rows, np.arange(rows), float(t[0]), time_stamps.mean_rate(t), 0.0)
    in_a_row = _fitted(t, np.arange(rows, dtype=np.float64))
    found = [in_a_row] if in_a_row is not None else []
    for nearest in (False, True):
        found = found or [
            line for begin in _beginnings(t) if (line := _follow(t, *begin, nearest=nearest)) is not None
        ]
    if not found and (line := _follow(t, *_rhythm(t[:SCANNED_STAMPS]), SCANNED_STAMPS)) is not None:
        found = [line]
    if not found:
        return None
    places, start_s, rate_hz, jitter = min(found, key=lambda each: each[3])
    return Grid(first, first + rows, places, start_s, rate_hz, jitter)


def _beginnings(t: FloatArray) -> list[tuple[float, float]]:
    """Period and time of a place by the first stamp, which may be off."""
    period = float(np.median(np.diff(t)))
    return [(period, float(t[0]) + start * period) for start in STARTS]


def _rhythm(t: FloatArray) -> tuple[float, float]:
    """Period and time of a place for which the phases of stamps (rows,) lie closest together: the peak of
    their periodogram as a point process (Bartlett 1963) near the median step."""
    median, span = float(np.median(np.diff(t))), float(t[-1] - t[0])
    steps = int(np.ceil(2 * RHYTHM_RANGE * span / median * RHYTHM_POINTS)) + 1
    frequencies = np.linspace(1 - RHYTHM_RANGE, 1 + RHYTHM_RANGE, steps) / median
    sums = np.exp(2j * np.pi * np.outer(frequencies, t - t[0])).sum(axis=1)
    best = int(np.argmax(np.abs(sums)))
    period = float(1 / frequencies[best])
    return period, float(t[0] + np.angle(sums[best]) / (2 * np.pi) * period)


def _follow(
    t: FloatArray, period: float, offset: float, known: int = FIRST_STAMPS, *, nearest: bool = False
) -> tuple[IntArray, float, float, float] | None:
    """The grid that a line from a period and the time of a place grows into, over `known` stamps at first.

    The line is that of least squares, or the nearest to the farthest stamp, which jitter with sharp bounds
    tells sooner.
    """
    known = min(known, len(t))
    while True:
        places = np.rint((t[:known] - offset) / period)
        if places[-1] > places[0]:
            line = _nearest_line if nearest and known <= MOST_NEAREST else _line
            period, offset = line(t[:known], places)
        if not period > 0:
            return None
        if known == len(t):
            break
        known = min(known + max(known // 4, 4), len(t))
    return _fitted(t, np.rint((t - offset) / period))


def _fitted(t: FloatArray, places: FloatArray) -> tuple[IntArray, float, float, float] | None:
    """The grid of stamps at these places; None where they do not increase, or a stamp lies too far from its
    place on the least-squares line and on the line that is nearest to the farthest."""
    if (np.diff(places) <= 0).any():
        return None
    period, offset = _line(t, places)
    off = np.abs(t - offset - period * places).max() / period
    if LARGEST_JITTER <= off < 1.5 * LARGEST_JITTER:
        period, offset = _nearest_line(t, places)
        off = np.abs(t - offset - period * places).max() / period
    if not off < LARGEST_JITTER:
        return None
    whole = (places - places[0]).astype(np.int64)
    rate = _simplified(period, float(off * period), float(t[-1] - t[0]), t)
    resolution = time_stamps.resolution(t) / period
    exact = off <= max(1.01 * resolution, time_stamps.STEP_TOLERANCE)
    start_s = float(t[0]) if exact else offset + period * float(places[0])
    return whole, start_s, rate, 0.0 if exact else float(off)


def _line(t: FloatArray, places: FloatArray, weights: FloatArray | None = None) -> tuple[float, float]:
    """Slope and value at place 0 of the least-squares line of stamps over places."""
    centre, middle = np.average(places, weights=weights), np.average(t, weights=weights)
    k = places - centre
    weighted = k if weights is None else k * weights
    slope = float(weighted @ (t - middle)) / float(weighted @ k)
    return slope, float(middle - slope * centre)


def _nearest_line(t: FloatArray, places: FloatArray) -> tuple[float, float]:
    """Slope and value at place 0 of the line whose farthest stamp is nearest, by Lawson's algorithm (Rice and
    Usow, 1968, doi:10.2307/2004760)."""
    weights = np.full(len(t), 1 / len(t))
    slope, start = _line(t, places)
    for _ in range(LAWSON_ROUNDS):
        larger = weights * np.abs(t - start - slope * places)
        # Where all stamps with any weight share a place there is nothing to turn the line by.
        bearing = places[larger > LEAST_WEIGHT * larger.max()]
        if len(bearing) == 0 or np.ptp(bearing) == 0:
            break
        weights = larger / larger.sum()
        slope, start = _line(t, places, weights)
    return slope, start


def _simplified(period: float, off: float, span: float, t: FloatArray) -> float:
    """The rate with the fewest digits that the stamps, each off by so much, cannot tell from it."""
    uncertainty = max(time_stamps.resolution(t), off) / span
    return time_stamps.fewest_digits(1 / period, uncertainty)


def parts(present: BoolArray, most_missing: int) -> list[tuple[int, int]]:
    """First and one past the last sample of each part of a grid that is left when it is cut where more than
    `most_missing` samples in a row are not `present`, shape (samples,)."""
    shown = np.flatnonzero(present)
    if len(shown) == 0:
        return []
    cuts = np.flatnonzero(np.diff(shown) > most_missing + 1)
    starts = shown[np.concatenate([[0], cuts + 1])]
    stops = shown[np.concatenate([cuts, [len(shown) - 1]])] + 1
    return [(int(a), int(b)) for a, b in zip(starts, stops, strict=True)]
