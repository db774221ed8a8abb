"""What the axis did: speed against command, error against angle, slews and tracking, reversals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bayes_hw.arrays import FloatArray, stretches_of

SPEED_BINS = 24
POSITION_BINS = 48
LEAST_COUNT = 8
SMOOTH_S = 0.2
STEADY_S = 2.0
STEADY_SHARE = 0.02
"""A command that changes over STEADY_S by no more than this share of its size there is steady."""

REST_SHARE = 1e-3
"""Below this share of the largest command the axis is at rest."""

SLEW_SHARE = 0.5
"""Steady commands above this share of the largest are slews, other moving ones tracking."""

SETTLED = 4.0


@dataclass(frozen=True, eq=False)
class SpeedMap:
    """Median speed of the axis (output unit / s) in bins of the command, while it rises and while it falls;
    NaN where few.
    """

    command: FloatArray
    rising: FloatArray
    falling: FloatArray

    @property
    def hysteresis(self) -> float:
        """Median difference of speed, falling less rising command, over their spread; NaN where no bin has
        both.
        """
        both = np.isfinite(self.rising) & np.isfinite(self.falling)
        spread = np.nanmax(np.abs([self.rising, self.falling])) if both.any() else 0.0
        return float(np.median((self.falling - self.rising)[both]) / spread) if spread > 0 else float("nan")


def speed_map(
    outputs: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float, delay_s: float
) -> SpeedMap:
    """Speeds are slopes over SMOOTH_S, of a command as much earlier as the delay."""
    width = max(1, round(SMOOTH_S * sample_rate_hz))
    lag = round(delay_s * sample_rate_hz)
    speeds, levels, slopes = [], [], []
    for y, u in zip(outputs, commands, strict=True):
        if len(y) < 2 * width + lag + 2:
            continue
        speed = (y[width:] - y[:-width]) * sample_rate_hz / width
        smooth = np.convolve(u, np.full(width, 1 / width), mode="valid")[: len(speed)]
        trend = np.gradient(smooth)
        speeds.append(speed[lag:])
        levels.append(smooth[: len(speed) - lag])
        slopes.append(trend[: len(speed) - lag])
    if not speeds:
        empty = np.full(SPEED_BINS, np.nan)
        return SpeedMap(np.zeros(SPEED_BINS), empty, empty)
    speed, level, slope = (np.concatenate(part) for part in (speeds, levels, slopes))
    edges = np.linspace(level.min(), level.max(), SPEED_BINS + 1)
    place = np.clip(np.digitize(level, edges) - 1, 0, SPEED_BINS - 1)
    medians = np.full((2, SPEED_BINS), np.nan)
    for row, chosen in enumerate((slope > 0, slope < 0)):
        for k in range(SPEED_BINS):
            here = speed[chosen & (place == k)]
            if len(here) >= LEAST_COUNT:
                medians[row, k] = np.median(here)
    return SpeedMap((edges[1:] + edges[:-1]) / 2, medians[0], medians[1])


@dataclass(frozen=True, eq=False)
class PositionError:
    """Mean error in bins of the angle, its standard error from the spread between passes; NaN where few
    samples.
    """

    angle: FloatArray
    mean: FloatArray
    standard_error: FloatArray


def position_error(
    outputs: Sequence[FloatArray], errors: Sequence[FloatArray], turn: float | None
) -> PositionError:
    """`turn` is a full turn in the output's unit where it has one: the angle then counts within it."""
    angle, error = np.concatenate(list(outputs)), np.concatenate(list(errors))
    folded = np.mod(angle, turn) if turn and np.ptp(angle) > turn else angle
    edges = np.linspace(folded.min(), folded.max(), POSITION_BINS + 1)
    place = np.clip(np.digitize(folded, edges) - 1, 0, POSITION_BINS - 1)
    passes = np.append(0, np.cumsum(np.diff(place) != 0))
    mean, spread = np.full(POSITION_BINS, np.nan), np.full(POSITION_BINS, np.nan)
    counts = np.bincount(passes)
    visit_mean = np.bincount(passes, error) / counts
    visit_place = np.zeros(len(counts), dtype=int)
    visit_place[passes] = place
    for k in range(POSITION_BINS):
        visits = visit_mean[visit_place == k]
        if len(visits) >= 2:
            mean[k] = visits.mean()
            spread[k] = visits.std(ddof=1) / np.sqrt(len(visits))
    return PositionError((edges[1:] + edges[:-1]) / 2, mean, spread)


@dataclass(frozen=True)
class Regime:
    """Stretches of one kind: how many, how long in all, rms of the error once settled, median settling
    time.
    """

    stretches: int
    seconds: float
    error_rms: float
    settling_s: float | None


def regimes(
    outputs: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float, sigma: float
) -> dict[str, Regime]:
    """ "slew", "tracking" and "rest": stretches of steady command, told apart by its size.

    Errors are from the straight line through the second half of a stretch; it has settled where the angle
    has come to stay within four of their rms, or of `sigma`.
    """
    width = max(3, round(STEADY_S * sample_rate_hz))
    largest = max(float(np.abs(u).max()) for u in commands) or 1.0
    found: dict[str, list[tuple[int, float, float | None]]] = {"slew": [], "tracking": [], "rest": []}
    for y, u in zip(outputs, commands, strict=True):
        if len(u) < 2 * width:
            continue
        ahead = ndimage.maximum_filter1d(u, width) - ndimage.minimum_filter1d(u, width)
        around = ndimage.maximum_filter1d(np.abs(u), width)
        still = ahead <= STEADY_SHARE * np.maximum(around, REST_SHARE * largest)
        steady = ndimage.binary_dilation(still, iterations=width // 2 - 1)
        for start, stop in zip(*stretches_of(steady), strict=True):
            if stop - start < width:
                continue
            kind = _kind(abs(float(np.median(u[start:stop]))) / largest)
            k = np.arange(stop - start)
            late = k >= len(k) // 2
            away = y[start:stop] - np.polynomial.Polynomial.fit(k[late], y[start:stop][late], 1)(k)
            rms = float(np.sqrt(np.mean(away[late] ** 2)))
            outside = np.flatnonzero(np.abs(away[~late]) > SETTLED * max(rms, sigma))
            settling = (outside[-1] + 1) / sample_rate_hz if len(outside) and start > 0 else None
            found[kind].append((stop - start, rms**2, settling))
    return {kind: _regime(rows, sample_rate_hz) for kind, rows in found.items()}


def _kind(share: float) -> str:
    if share < REST_SHARE:
        return "rest"
    return "slew" if share > SLEW_SHARE else "tracking"


def _regime(rows: list[tuple[int, float, float | None]], sample_rate_hz: float) -> Regime:
    if not rows:
        return Regime(0, 0.0, 0.0, None)
    lengths = np.array([row[0] for row in rows], dtype=float)
    squares = np.array([row[1] for row in rows])
    times = [row[2] for row in rows if row[2] is not None]
    rms = float(np.sqrt(lengths @ squares / lengths.sum()))
    return Regime(
        len(rows), float(lengths.sum()) / sample_rate_hz, rms, float(np.median(times)) if times else None
    )


def reversals(y: FloatArray, threshold: float) -> int:
    """Turning points of the angle that are deeper than `threshold`."""
    count, direction, extreme = 0, 0, float(y[0])
    for value in y[:: max(1, len(y) // 20_000)].tolist():
        if (direction >= 0 and value > extreme) or (direction <= 0 and value < extreme):
            if direction == 0 and abs(value - y[0]) > threshold:
                direction = 1 if value > y[0] else -1
            if direction != 0:
                extreme = value
        elif direction and abs(value - extreme) > threshold:
            direction, extreme, count = -direction, value, count + 1
    return count
