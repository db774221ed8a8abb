"""The limits of the command and the dead zone of the output, with no poles or zeros chosen.

    y = d(w) + noise,    w(k) - w(k-1) = b_0 v(k) + ... + b_m v(k-m),    v = min(max(u, lower), upper),

d the dead zone: w - min(max(w, -half width), half width). Taps, limits and half width together minimise the
sum of squares of the residual's increments, whitened by an autoregression: Gauss-Newton with the exact
gradient. The taps shrink to zero with their lag. A limit or a half width counts as met where it stands
clear of none, by its own standard deviation: that of the curvature, or of the scores summed over blocks of
time where that is larger, as it is where the axis does something else besides (White 1982, doi
10.2307/1912526).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import linalg, optimize

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial, burg, whitened

SLOW_RATES_HZ = (20.0, 50.0)
"""Records are averaged down to about one of these rates: the taps reach as far back at the first as a slow
axis asks, and resolve at the second what a stiff one does.
"""

SPAN_S = 1.0
"""The better rate is that at which the residual changes less over this time: limits and dead zone act in the
long run, and the noise from one sample to the next tells nothing of them.
"""

MOST_SAMPLES = 12_000
TAPS = 80
TAP_DECAY = 40.0
TAP_SIZE = 3.0
"""Prior standard deviation of a tap in units of the mean tap of the velocity gain."""

NOISE_ORDER = 6
ITERATIONS = 24
CLEAR = 4.0
"""Standard deviations that a limit lies within the command's range, a half width above zero, to be met."""

BLOCK_S = 5.0
"""Stretches of time over which scores are summed."""

STARTS = (0.0, 0.03, 0.15)
"""Half widths to start from, in units of what 95 % of the angles lie within."""

LIMIT_STARTS = (1.0, 0.7)
MOST_OF_THE_WAY, NEARLY_ALL = 0.8, 0.97
FIRST_ITERATIONS, FINALISTS = 2, 3
SHORT_TAPS = 40
ONE_SIDED = 1.555
"""Standard deviations that 94 % lie below."""

CLEAR_SHARE = 0.12
"""Angles beyond this share of `_Fit.angle` are taken to be clear of a dead zone."""


@dataclass(frozen=True, eq=False)
class Statics:
    """What the records show of the limits (command units) and of the dead zone (output units); None: not met.

    `spread` (parameters, 3) holds columns of a square root of the covariance of (lower, upper, half width).
    `undisturbed` are the angles before the dead zone, simulated, per record. `bound` is what a half width
    that is not met does not exceed, at 94 %.
    """

    lower: float | None = None
    upper: float | None = None
    half_width: float | None = None
    spread: FloatArray = field(default_factory=lambda: np.zeros((3, 0)))
    undisturbed: tuple[FloatArray, ...] = ()
    bound: float | None = None

    def sd(self, which: int) -> float:
        """Standard deviation of the lower limit (0), the upper (1) or the half width (2)."""
        return float(np.linalg.norm(self.spread[which]))

    @property
    def seen(self) -> float:
        """Share of the samples at which the angle is outside the dead zone, and so tells of the motion."""
        if self.half_width is None:
            return 1.0
        inside = sum(int(np.count_nonzero(np.abs(w) <= self.half_width)) for w in self.undisturbed)
        return max(1 - inside / sum(map(len, self.undisturbed)), 0.05)

    def predicted(self, record: int) -> FloatArray:
        """The output without noise."""
        return _dead_zone(self.undisturbed[record], self.half_width or 0.0)

    def limited(self, u: FloatArray, shift: FloatArray | None = None) -> FloatArray:
        """The command as the drive takes it; limits moved by `shift`."""
        moved = np.zeros(3) if shift is None else shift
        lower = -np.inf if self.lower is None else self.lower + moved[0]
        upper = np.inf if self.upper is None else self.upper + moved[1]
        return np.asarray(np.clip(u, lower, upper))

    def opened(self, record: int, y: FloatArray, shift: FloatArray | None = None) -> FloatArray:
        """The angle before the dead zone; `y` counts from the origin."""
        if self.half_width is None:
            return y
        half_width = max(self.half_width + (0.0 if shift is None else shift[2]), 0.0)
        return y + np.clip(self.undisturbed[record], -half_width, half_width)


@dataclass(frozen=True, eq=False)
class _Slow:
    """One record averaged down: command `u` (samples, factor), angle `y` (samples,)."""

    u: FloatArray
    y: FloatArray


def statics(outputs: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float) -> Statics:
    """Of records whose angles count from the origin; nothing where command or angle never moves."""
    input_scale = max((float(np.abs(u).max()) for u in commands), default=0.0)
    output_scale = max((float(np.abs(y).max()) for y in outputs), default=0.0)
    if input_scale == 0 or all(np.ptp(y) == 0 for y in outputs):
        return Statics()
    scaled = _scaled_statics(
        [y / output_scale for y in outputs], [u / input_scale for u in commands], sample_rate_hz
    )
    return Statics(
        None if scaled.lower is None else scaled.lower * input_scale,
        None if scaled.upper is None else scaled.upper * input_scale,
        None if scaled.half_width is None else scaled.half_width * output_scale,
        scaled.spread * np.array([[input_scale], [input_scale], [output_scale]]),
        tuple(w * output_scale for w in scaled.undisturbed),
        None if scaled.bound is None else scaled.bound * output_scale,
    )


def _scaled_statics(
    outputs: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float
) -> Statics:
    """Of commands and angles of about one."""
    factors = sorted({max(1, round(sample_rate_hz / rate)) for rate in SLOW_RATES_HZ}, reverse=True)
    tried: list[tuple[float, int, _Fit, tuple[FloatArray, FloatArray]]] = []
    for factor in factors:
        fit = _fit(outputs, commands, factor)
        if fit is None:
            continue
        best = fit.best(fit.inside(tried[0][3][0]) if tried else fit.starts())
        if best is not None:
            span = max(1, round(SPAN_S * sample_rate_hz / factor))
            tried.append((fit.misfit(best[0], span), factor, fit, best))
    if not tried:
        return Statics()
    _, factor, fit, best = min(tried, key=lambda found: found[0])
    values, covariance = fit.robust(*best, block=max(2, round(BLOCK_S * sample_rate_hz / factor)))
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    met = np.array(
        [
            values[0] - fit.smallest > CLEAR * sd[0] and fit.smallest < 0,
            fit.largest - values[1] > CLEAR * sd[1] and fit.largest > 0,
            values[2] > CLEAR * sd[2],
        ]
    )
    spread = np.zeros((3, int(met.sum())))
    if met.any():
        squares, directions = np.linalg.eigh(covariance[np.ix_(met, met)])
        spread[met] = directions * np.sqrt(np.maximum(squares, 0.0))
    lower, upper, half_width = (float(v) if m else None for v, m in zip(values, met, strict=True))
    found = Statics(lower, upper, half_width, spread)
    whole = tuple(
        fit.simulated(found.limited(u), factor, len(y)) for y, u in zip(outputs, commands, strict=True)
    )
    bound = None if met[2] else float(max(values[2], 0.0) + ONE_SIDED * sd[2])
    return Statics(lower, upper, half_width, spread, whole, bound)


def _fit(outputs: Sequence[FloatArray], commands: Sequence[FloatArray], factor: int) -> _Fit | None:
    """Of records averaged down by `factor`; None where they are too short or command nothing."""
    total = sum(len(y) // factor for y in outputs)
    share = min(1.0, MOST_SAMPLES / max(total, 1))
    records = []
    for y, u in zip(outputs, commands, strict=True):
        length = int(len(u) // factor * share)
        if length > TAPS:
            records.append(_Slow(u[: length * factor].reshape(-1, factor), y[: length * factor : factor]))
    largest = max((float(r.u.max()) for r in records), default=0.0)
    smallest = min((float(r.u.min()) for r in records), default=0.0)
    if not records or largest <= smallest:
        return None
    return _Fit(records, min(smallest, 0.0), max(largest, 0.0))


class _Fit:
    """Gauss-Newton from several starts; `taps` are those of the best."""

    def __init__(self, records: Sequence[_Slow], smallest: float, largest: float) -> None:
        self.records, self.smallest, self.largest = records, smallest, largest
        self.taps = np.zeros(TAPS)
        travelled = sum(float(np.abs(r.u).sum()) / r.u.shape[1] for r in records)
        moved = sum(float(np.abs(np.diff(r.y)).sum()) for r in records)
        size = TAP_SIZE * moved / max(travelled, 1e-300) / 4
        self.penalty = 1 / (size * np.exp(-np.arange(TAPS) / TAP_DECAY))
        self.angle = float(np.quantile(np.abs(np.concatenate([r.y for r in records])), 0.95))

    def starts(self) -> list[FloatArray]:
        """Values to descend from where nothing is known."""
        starts = [np.array([share * self.smallest, share * self.largest, 0.0]) for share in LIMIT_STARTS]
        starts = [start + np.array([0.0, 0.0, size * self.angle]) for start in starts for size in STARTS]
        limits = self._limits_clear_of_zero()
        if limits is not None:
            starts.append(np.array([*limits, self._half_width_for(limits)]))
        return starts

    def inside(self, values: FloatArray) -> list[FloatArray]:
        """Values that were found at another rate, and these with both limits met, if only just."""
        ends = NEARLY_ALL * np.array([self.smallest, self.largest])
        return [values, np.array([*ends, values[2]])]

    def best(self, starts: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray] | None:
        """Lower, upper, half width, and their covariance; None where nothing is fitted."""
        tried = [found for start in starts if (found := self._descend(start, FIRST_ITERATIONS)) is not None]
        if not tried:
            return None
        tried.sort(key=lambda found: found[0])
        finals = [self._descend(found[1], ITERATIONS, found[2]) or found for found in tried[:FINALISTS]]
        final = min(finals, key=lambda found: found[0])
        self.taps = final[2]
        return final[1], final[3]

    def misfit(self, values: FloatArray, span: int) -> float:
        """Mean square of what the residual changes by over `span` samples."""
        residuals = [
            r.y - _dead_zone(self._undisturbed(r, values, self.taps), values[2]) for r in self.records
        ]
        changes = np.concatenate([r[span:] - r[:-span] for r in residuals])
        return float(np.mean(changes**2))

    def robust(self, values: FloatArray, covariance: FloatArray, block: int) -> tuple[FloatArray, FloatArray]:
        """Values, and their covariance widened to that of their scores over blocks of so many samples where
        that is larger.
        """
        residuals, gradients = self._linearised(values, self.taps)
        noise = _autoregression(residuals)
        pairs = [(whitened(r, noise), whitened(g, noise)) for r, g in zip(residuals, gradients, strict=True)]
        rows = sum(len(white) for white, _ in pairs)
        variance = max(sum(float(white @ white) for white, _ in pairs) / rows, 1e-300)
        scores = [
            np.add.reduceat(table * white[:, None], np.arange(0, len(white), block), axis=0) / variance
            for white, table in pairs
        ]
        normal = sum((table.T @ table for _, table in pairs), np.zeros((3 + TAPS, 3 + TAPS))) / variance
        normal[3:, 3:] += np.diag(self.penalty**2)
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        inner = normal / np.outer(scale, scale) + 1e-9 * np.eye(len(scale))
        influence = linalg.solve(inner, (np.concatenate(scores) / scale).T, assume_a="pos")[:3]
        spread = np.sqrt(np.sum((influence / scale[:3, None]) ** 2, axis=1))
        own = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        wider = np.maximum(spread / own, 1.0)
        return values, covariance * np.outer(wider, wider)

    def _limits_clear_of_zero(self) -> FloatArray | None:
        """Limits from the increments of angles clear of zero, which a dead zone leaves as they are; None
        where few.
        """
        clear = [np.abs(r.y) > CLEAR_SHARE * self.angle for r in self.records]
        chosen = [
            c[1:] & c[:-1] & (np.sign(r.y[1:]) == np.sign(r.y[:-1]))
            for c, r in zip(clear, self.records, strict=True)
        ]
        if sum(int(c.sum()) for c in chosen) < 8 * SHORT_TAPS:
            return None
        z = np.concatenate([np.diff(r.y)[c] for c, r in zip(chosen, self.records, strict=True)])

        def squares(limits: FloatArray) -> float:
            if not limits[0] < 0 < limits[1]:
                return np.inf
            table = np.concatenate(
                [
                    linalg.toeplitz(_driven(r, limits), np.zeros(SHORT_TAPS))[1:][c]
                    for c, r in zip(chosen, self.records, strict=True)
                ]
            )
            normal, cross = table.T @ table, table.T @ z
            normal += 1e-8 * max(float(np.trace(normal)), 1e-300) * np.eye(SHORT_TAPS)
            return float(z @ z - cross @ linalg.solve(normal, cross, assume_a="pos"))

        edge = np.array([min(self.smallest, -1e-12), max(self.largest, 1e-12)])
        best = min((share * edge for share in (1.0, 0.85, 0.7, 0.55, 0.4)), key=squares)
        simplex = np.array([best, best * [0.9, 1.0], best * [1.0, 0.9]])
        found = optimize.minimize(
            squares,
            best,
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "maxfev": 45, "xatol": 1e-3 * float(edge[1])},
        ).x
        return np.array([max(found[0], NEARLY_ALL * edge[0]), min(found[1], NEARLY_ALL * edge[1])])

    def _half_width_for(self, limits: FloatArray) -> float:
        """The half width of least cost with the taps that increments clear of it give."""
        sizes = np.append(0.0, np.geomspace(1e-3, 0.5, 16)) * self.angle
        values = [np.array([*limits, size]) for size in sizes]
        costs = [self._cost(value, self._taps_for(value), np.zeros(0)) for value in values]
        return float(sizes[int(np.argmin(costs))])

    def simulated(self, limited: FloatArray, factor: int, samples: int) -> FloatArray:
        """w at the record's own rate, shape (samples,)."""
        slow = limited[: len(limited) // factor * factor].reshape(-1, factor).mean(axis=1)
        w = np.cumsum(np.convolve(np.append(0.0, slow)[:-1], self.taps)[: len(slow)])
        return np.interp(np.arange(samples), factor * np.arange(len(w)), w)

    def _descend(
        self, values: FloatArray, iterations: int, taps: FloatArray | None = None
    ) -> tuple[float, FloatArray, FloatArray, FloatArray] | None:
        """Cost, values, taps and covariance of the values."""
        noise = np.zeros(0)
        if taps is None:
            taps = self._taps_for(values)
        cost = self._cost(values, taps, noise)
        covariance = np.eye(3)
        for _ in range(iterations):
            residuals, gradients = self._linearised(values, taps)
            noise = _autoregression(residuals)
            cost = self._cost(values, taps, noise)
            white = np.concatenate([whitened(r, noise) for r in residuals])
            table = np.concatenate([whitened(g, noise) for g in gradients])
            variance = max(float(white @ white) / len(white), 1e-300)
            normal = table.T @ table / variance
            normal[3:, 3:] += np.diag(self.penalty**2)
            right = table.T @ white / variance
            right[3:] -= self.penalty**2 * taps
            size = np.sqrt(np.diag(normal))
            unit = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
            inner = normal * np.outer(unit, unit) + np.diag(np.where(size > 0, 1e-9, 1.0))
            covariance = linalg.inv(inner, assume_a="pos") * np.outer(unit, unit)
            step = covariance @ right
            for _half in range(6):
                tried = self._inside(values, step[:3])
                new = taps + step[3:]
                if (reached := self._cost(tried, new, noise)) <= cost:
                    values, taps, cost = tried, new, reached
                    break
                step = step / 2
            else:
                break
        return cost, values, taps, covariance[:3, :3]

    def _inside(self, values: FloatArray, step: FloatArray) -> FloatArray:
        """Values after a step. A limit goes part of the way to the end of the commands at most: there none is
        beyond it, and its gradient is zero for good.
        """
        ends = np.array([self.smallest, self.largest])
        farthest = values[:2] + MOST_OF_THE_WAY * (ends - values[:2])
        new = values + step
        return np.array(
            [
                np.clip(new[0], farthest[0], 0.02 * self.smallest),
                np.clip(new[1], 0.02 * self.largest, farthest[1]),
                max(new[2], 0.0),
            ]
        )

    def _taps_for(self, values: FloatArray) -> FloatArray:
        """Taps by least squares on the increments, where the angle's sign tells the side of the dead zone."""
        normal, right = np.zeros((TAPS, TAPS)), np.zeros(TAPS)
        scale = 0.0
        for record in self.records:
            v = _driven(record, values)
            table = linalg.toeplitz(v, np.zeros(TAPS))[1:]
            z = np.diff(record.y + values[2] * np.sign(record.y) * (np.abs(record.y) > values[2] / 2))
            keep = np.abs(z) < 8 * np.median(np.abs(z)) + 1e-300
            kept = table[keep]
            normal += kept.T @ kept
            right += kept.T @ z[keep]
            scale += float(z[keep] @ z[keep]) / len(z)
        normal += np.diag(self.penalty**2) * scale / len(self.records)
        return np.asarray(
            linalg.solve(normal + 1e-12 * np.trace(normal) * np.eye(TAPS), right, assume_a="pos")
        )

    def _cost(self, values: FloatArray, taps: FloatArray, noise: FloatArray) -> float:
        squares, rows = 0.0, 0
        for record in self.records:
            w = self._undisturbed(record, values, taps)
            white = whitened(np.diff(record.y - _dead_zone(w, values[2])), noise)
            squares += float(white @ white)
            rows += len(white)
        return rows * float(np.log(max(squares, 1e-300) / rows)) + float(np.sum((self.penalty * taps) ** 2))

    def _undisturbed(self, record: _Slow, values: FloatArray, taps: FloatArray) -> FloatArray:
        v = _driven(record, values)
        return np.cumsum(np.convolve(v, taps)[: len(v)])

    def _linearised(self, values: FloatArray, taps: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
        """Increments of the residual and their gradient (samples, 3 + TAPS), per record."""
        residuals, gradients = [], []
        for record in self.records:
            v = _driven(record, values)
            table = np.empty((len(v), 3 + TAPS))
            table[:, 3:] = linalg.toeplitz(np.cumsum(v), np.zeros(TAPS))
            w = table[:, 3:] @ taps
            moving = np.abs(w) > values[2]
            for column, beyond in ((0, record.u < values[0]), (1, record.u > values[1])):
                share = np.append(0.0, beyond.mean(axis=1))[:-1]
                table[:, column] = np.cumsum(np.convolve(share, taps)[: len(share)])
            table *= moving[:, None]
            table[:, 2] = -np.sign(w) * moving
            residuals.append(np.diff(record.y - _dead_zone(w, values[2])))
            gradients.append(np.diff(table, axis=0))
        return residuals, gradients


def _driven(record: _Slow, values: FloatArray) -> FloatArray:
    """The command within the limits, a sample late, as a drive that holds it shows it first."""
    return np.append(0.0, np.clip(record.u, values[0], values[1]).mean(axis=1))[:-1]


def _dead_zone(w: FloatArray, half_width: float) -> FloatArray:
    return w - np.clip(w, -half_width, half_width)


def _autoregression(residuals: Sequence[FloatArray]) -> FloatArray:
    partial, _ = burg(residuals, NOISE_ORDER)
    return autoregression_from_partial(partial[:, None])[:, 0]
