"""Noise with a slow part that has a cause: a torque that nobody recorded (wind), or an angle that walks.

Its spectrum is that of first-order noise of the readings plus that of the slow part:

    S(f) = b / |1 - phi z|^2 + a R(f) / (1 + (f / c)^2)^p

with R one, or the squared response of the poles of G (all, or the light pairs) for a torque, and
a / |1 - z|^2 for a walk. The noise is the autoregression of high order with that spectrum's
autocovariance; parameters and shape maximise its likelihood in time, begun at the Whittle likelihood of
tapered first differences (Whittle 1953, doi 10.1007/BF02590998).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.holes import without_holes


def tapered_periodograms(residuals: Sequence[FloatArray], rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies (Hz) and powers (ordinates,) of the first differences of residuals, one record after the
    other. Hann tapering ties neighbours together: every second ordinate is kept."""
    frequencies, powers = [], []
    for e in residuals:
        d = np.diff(e)
        taper = np.hanning(len(d) + 2)[1:-1]
        transform = np.fft.rfft(d * taper) / np.sqrt(np.sum(taper**2))
        keep = slice(2, len(transform) - 2, 2)
        frequencies.append(np.fft.rfftfreq(len(d), 1 / rate_hz)[keep])
        powers.append(np.abs(transform[keep]) ** 2)
    return np.concatenate(frequencies), np.concatenate(powers)


WIND, WALK = "wind", "sensor_drift"
"""Labels of the two causes."""

STEEPNESS = (0.85, 1.1, 1.5, 2.2, 3.2)
FORMS_OF_A_DRIFT = 3
"""A walk is one of the forms of its label: beside it a ramp and a settling one."""

LEVEL_AT = 40.0
"""The size is that of the slow spectrum at the sample rate over this: it stays while the corner moves."""

LONGEST, GRID = 40, 2048
"""Largest order of the autoregression, and points of the spectrum, while structure and effects are sought."""

EXACT, EXACT_GRID = 160, 8192
"""The same where causes are held against each other: a walk that is small beside the noise is remembered for
as many samples as the noise is larger than its steps."""

LONGEST_OVER_HOLES = 40
"""Where samples are missing, while parameters are sought: bridging costs the square of the order."""

LOST = 1e-4
"""Share of the innovations' variance that a lower order may cost."""

SINGLE, BAND = 40, 0.03
WHITTLE_ITERATIONS, FIRST_ITERATIONS, AGAIN_ITERATIONS, MORE_ITERATIONS, REFINED = 100, 60, 20, 8, 3

NEARLY_ONE = 0.99999
LARGEST_LOG = 40.0


@dataclass(frozen=True, eq=False)
class SlowWhitener(Whitener):
    """A whitener of such noise: `power` and the number of a set of poles choose the shape, `at` are its
    coordinates."""

    power: float
    chosen: int
    at: FloatArray

    @property
    def memory(self) -> float:
        """Of the readings' own noise from sample to sample."""
        return _phi(self.at)

    def of_readings(self, innovation: float) -> float:
        """Standard deviation of the readings' own noise, of innovations of this one."""
        return innovation / float(np.sqrt(1 - self.memory**2))

    def slow_share(self, rms: float, innovation: float) -> float:
        """Standard deviation of the slow part over that of the readings' own noise, of residuals with this
        root mean square and innovations of that standard deviation."""
        plain = self.of_readings(innovation)
        return float(np.sqrt(max(rms**2 - plain**2, 0.0)) / plain)


@dataclass(frozen=True, eq=False)
class SlowNoise:
    """Noise of one cause, WIND or WALK; a torque may pass through any of `poles`, sets of poles of G (z).
    Where it was fitted before it goes on from there (`begun`), its shape kept. An `exact` one takes EXACT
    orders."""

    cause: str
    rate_hz: float
    poles: tuple[ComplexArray, ...] = ()
    begun: SlowWhitener | None = None
    exact: bool = False

    @property
    def parameters(self) -> int:
        """Numbers that the noise costs: size, phi, and the corner of a torque's spectrum."""
        return 2 if self.cause == WALK else 3

    @property
    def choices(self) -> int:
        """Of how many shapes, each as likely before, it is one."""
        return FORMS_OF_A_DRIFT if self.cause == WALK else len(STEEPNESS) * (1 + len(self.poles))

    def of(self, residuals: Sequence[FloatArray], previous: Whitener | None = None) -> SlowWhitener:
        """Fitted to residuals, NaN where nothing was measured; from `previous` where it is of this noise."""
        masks = None
        if any(bool(np.isnan(e).any()) for e in residuals):
            masks = [~np.isnan(e) for e in residuals]

        def likelihood(whitener: SlowWhitener) -> float:
            return whitener.log_likelihood(residuals, masks)

        most = self._longest if masks is None else LONGEST_OVER_HOLES

        def refined(begun: SlowWhitener, iterations: int) -> SlowWhitener:
            """By the likelihood in time."""

            def minus(x: FloatArray) -> float:
                return -likelihood(self._whitener(begun.power, begun.chosen, x, most))

            options: Any = {"maxiter": iterations, "fatol": 0.03, "initial_simplex": _simplex(begun.at)}
            found = minimize(minus, tuple(begun.at), method="Nelder-Mead", options=options)
            ended = self._whitener(begun.power, begun.chosen, np.asarray(found.x, dtype=np.float64))
            if most == self._longest:
                return ended
            # What gains at a lower order may lose at the whole one.
            return max(ended, self._whitener(begun.power, begun.chosen, begun.at), key=likelihood)

        if isinstance(previous, SlowWhitener):
            return refined(previous, MORE_ITERATIONS)
        if self.begun is not None:
            return refined(self.begun, AGAIN_ITERATIONS)
        seen = _Ordinates.of([without_holes(e) for e in residuals], self.rate_hz)
        if self.cause == WALK:
            starts = [(0.0, -1, np.array([a, 0.3])) for a in (-8.0, -3.0)]
        else:
            starts = [
                (power, chosen, np.array([0.0, np.log(0.1), 0.3]))
                for power in STEEPNESS
                for chosen in range(-1, len(self.poles))
            ]
        found = [self._whitener(*start[:2], self._fitted(seen, *start), most) for start in starts]
        found.sort(key=likelihood, reverse=True)
        return max((refined(one, FIRST_ITERATIONS) for one in found[:REFINED]), key=likelihood)

    def _fitted(self, seen: _Ordinates, power: float, chosen: int, start: FloatArray) -> FloatArray:
        resonance = self._response(chosen, seen.frequency)

        def minus(x: FloatArray) -> float:
            return seen.minus(self._spectrum(x, power, resonance, seen.frequency, seen.differenced))

        options: Any = {"maxiter": WHITTLE_ITERATIONS, "fatol": 0.1, "initial_simplex": _simplex(start)}
        found = minimize(minus, tuple(start), method="Nelder-Mead", options=options)
        return np.asarray(found.x, dtype=np.float64)

    def spectra(self, whitener: SlowWhitener, points: int) -> tuple[FloatArray, FloatArray]:
        """Power spectra (points / 2 + 1,) of all and of the readings' own noise, up to one factor."""
        f, differenced = self._frequencies(points)
        resonance = self._response(whitener.chosen, f)
        total = self._spectrum(whitener.at, whitener.power, resonance, f, differenced)
        return total, _plain(_phi(whitener.at), differenced)

    def _frequencies(self, points: int) -> tuple[FloatArray, FloatArray]:
        """Of so many samples (Hz), and |1 - z|^2 there; the lowest is a quarter of the step."""
        f = np.arange(points // 2 + 1) * self.rate_hz / points
        f[0] = 0.25 * self.rate_hz / points
        return f, 4 * np.sin(np.pi * f / self.rate_hz) ** 2

    def _spectrum(
        self, x: FloatArray, power: float, resonance: FloatArray, f: FloatArray, differenced: FloatArray
    ) -> FloatArray:
        plain = _plain(_phi(x), differenced)
        size = np.exp(np.clip(x[0], -LARGEST_LOG, LARGEST_LOG))
        if self.cause == WALK:
            return np.asarray(plain + size / differenced)
        corner = np.exp(np.clip(x[1], np.log(1e-3 * self.rate_hz / 20), np.log(0.2 * self.rate_hz)))
        level = ((1 + (self.rate_hz / LEVEL_AT / corner) ** 2) / (1 + (f / corner) ** 2)) ** power
        return np.asarray(plain + size * resonance * level)

    def _response(self, chosen: int, f: FloatArray) -> FloatArray:
        """Squared response of a set of poles, one at rest."""
        found = np.ones_like(f)
        if chosen < 0:
            return found
        z = np.exp(2j * np.pi * f / self.rate_hz)
        for pole in self.poles[chosen]:
            found = found * np.abs((1 - pole) / (z - pole)) ** 2
        return found

    @property
    def _longest(self) -> int:
        return EXACT if self.exact else LONGEST

    def _whitener(
        self, power: float, chosen: int, at: FloatArray, longest: int | None = None
    ) -> SlowWhitener:
        """The autoregression that has the spectrum's autocovariance (Levinson's recursion)."""
        longest, grid = longest or self._longest, EXACT_GRID if self.exact else GRID
        f, differenced = self._frequencies(grid)
        resonance = self._response(chosen, f)
        covariance = np.fft.irfft(self._spectrum(at, power, resonance, f, differenced))[: longest + 1]
        partial = _partial(covariance)
        lost = np.cumsum(np.log1p(-(partial[::-1] ** 2)))[::-1]
        partial = partial[: max(int(np.sum(-lost > LOST)), 1)]
        plain = Whitener.of_partial(partial)
        return SlowWhitener(plain.coefficients, plain.scales, power, chosen, at)


@dataclass(frozen=True, eq=False)
class _Ordinates:
    """Frequencies (Hz), |1 - z|^2 there, and the periodogram by tapered differences, means of so many."""

    frequency: FloatArray
    differenced: FloatArray
    power: FloatArray
    count: FloatArray

    @classmethod
    def of(cls, residuals: Sequence[FloatArray], rate_hz: float) -> _Ordinates:
        """Means over bands of BAND of a frequency, the lowest SINGLE ordinates by themselves."""
        f, power = tapered_periodograms(residuals, rate_hz)
        order = np.argsort(f, kind="stable")
        f, power = f[order], power[order] / (4 * np.sin(np.pi * f[order] / rate_hz) ** 2)
        band = np.floor(np.log(f / f[0]) / BAND) + SINGLE
        band[:SINGLE] = np.arange(min(SINGLE, len(f)))
        _, first, count = np.unique(band, return_index=True, return_counts=True)
        mean = np.add.reduceat(f, first) / count
        return cls(
            mean,
            4 * np.sin(np.pi * mean / rate_hz) ** 2,
            np.add.reduceat(power, first) / count,
            count.astype(np.float64),
        )

    def minus(self, spectrum: FloatArray) -> float:
        """Minus the Whittle log-likelihood of a spectrum of free size, up to a constant."""
        s = np.maximum(spectrum, 1e-300)
        total = float(np.sum(self.count))
        scale = float(np.sum(self.count * self.power / s)) / total
        return float(self.count @ np.log(s)) + total * float(np.log(max(scale, 1e-300)))


def _simplex(at: FloatArray) -> FloatArray:
    """About coordinates: size and corner by half an e, phi by a tenth."""
    steps = np.full(len(at), 0.5)
    steps[-1] = 0.1
    return np.asarray(np.vstack([at, at + np.diag(steps)]))


def _plain(phi: float, differenced: FloatArray) -> FloatArray:
    """Spectrum of the readings' own noise, one at rest where its memory is positive."""
    return np.asarray((1 - abs(phi)) ** 2 / (1 - phi * (2 - differenced) + phi**2))


def _phi(at: FloatArray) -> float:
    return 0.95 * float(np.tanh(at[-1]))


def _partial(covariance: FloatArray) -> FloatArray:
    """Partial autocorrelations (p,) of autocovariances (p + 1,)."""
    partial = np.empty(len(covariance) - 1)
    _levinson(np.ascontiguousarray(covariance), NEARLY_ONE, partial)
    return partial


@compiled(nogil=True)
def _levinson(covariance, most, partial):  # type: ignore[no-untyped-def]
    order = len(partial)
    phi, before, variance = np.zeros(order), np.zeros(order), covariance[0]
    for i in range(order):
        kappa = covariance[i + 1]
        for j in range(i):
            kappa -= phi[j] * covariance[i - j]
        kappa = min(max(kappa / variance, -most), most)
        for j in range(i):
            before[j] = phi[j]
        for j in range(i):
            phi[j] -= kappa * before[i - 1 - j]
        phi[i] = partial[i] = kappa
        variance *= 1 - kappa**2
