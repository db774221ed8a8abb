"""Whether noise of a cause is what it is said to be, by the disturbances that it says there were.

Wind and an angle that walks are normal, and neither knows how the axis is used. What disturbed the axis from
sample to sample is smoothed from the residuals (the auxiliary residuals of Harvey and Koopman 1992, doi
10.1080/07474938.1992.10510119), and held against smoothed disturbances of noise drawn from the fit: were
there a few great ones, did they come while the axis was fast, accelerated, turned, met a limit or left one?
How strong a cause is may differ from record to record, in what is drawn as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.effect_paths import limited_and_gain

STRENGTH_LOG_SD = 0.25
"""Of how strong a cause is from record to record: campaigns take hours, not seasons."""

DRAWS, SEED = 200, 1
LEAST_SLOW = 1e-12
"""Power of the slow part, over that of all, below which it counts as no more."""


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Power spectra (frequencies,) of `points` samples, square output units: of all, of the readings' own
    noise, and the response of the slow part to its disturbances."""

    points: int
    total: FloatArray
    plain: FloatArray
    slow: ComplexArray

    @classmethod
    def of(cls, fit: JointFit, longest: int) -> _Spectra | None:
        """Of a fit whose noise has a cause, for records of up to so many samples; None for any other."""
        cause, whitener = fit.response.cause, fit.slow
        if cause is None or whitener is None:
            return None
        points = 1 << int(np.ceil(np.log2(2 * longest)))
        total, plain = cause.spectra(whitener, points)
        first = np.fft.irfft(_least_phase(total))[0]
        unit = (fit.innovation_sigma / first) ** 2
        slow = np.maximum(total - plain, LEAST_SLOW * total)
        return cls(points, unit * total, unit * plain, np.sqrt(unit) * _least_phase(slow))

    def smoothed(self, errors: FloatArray) -> FloatArray:
        """The disturbances (samples,) that errors tell, up to one factor."""
        seen = np.fft.rfft(errors, self.points) * self.slow.conj() / self.total
        return np.asarray(np.fft.irfft(seen)[: len(errors)])

    def drawn(self, samples: int, rng: np.random.Generator) -> FloatArray:
        """Noise (samples,) of this kind, its cause of a strength of its own."""
        white = rng.standard_normal((2, self.points))
        readings, disturbances = np.fft.rfft(white, axis=1)
        strength = np.exp(STRENGTH_LOG_SD * rng.standard_normal())
        drawn = np.sqrt(self.plain) * readings + strength * self.slow * disturbances
        return np.asarray(np.fft.irfft(drawn)[:samples])

    @property
    def memory(self) -> int:
        """Samples over which smoothed disturbances follow each other."""
        covariance = np.fft.irfft(np.abs(self.slow) ** 2 / self.total)[: self.points // 2]
        return max(round(2 * float(np.sum((covariance / covariance[0]) ** 2))), 1)


def refuting_nats(fit: JointFit) -> float:
    """Nats against the cause of a fit's noise by what was least to be expected of its disturbances, less the
    price of what was asked; zero for noise of no cause."""
    longest = max(len(e) for e in fit.point.residuals)
    spectra = _Spectra.of(fit, longest)
    if spectra is None:
        return 0.0
    measured = [~np.isnan(e) for e in fit.point.residuals]
    uses = [_uses(fit, number) for number in range(len(measured))]
    window = np.full(min(spectra.memory, min(len(e) for e in measured)), 1.0)
    during = np.concatenate([[np.convolve(row, window, "same") for row in rows] for rows in uses], axis=1)

    def told(errors: Sequence[FloatArray]) -> FloatArray:
        seen = [spectra.smoothed(np.where(m, e, 0.0)) for e, m in zip(errors, measured, strict=True)]
        return _told(np.concatenate(seen), during)

    rng = np.random.default_rng(SEED)
    drawn = np.array([told([spectra.drawn(len(m), rng) for m in measured]) for _ in range(DRAWS)])
    spread = drawn.std(axis=0)
    surprise = (told(fit.point.residuals) - drawn.mean(axis=0)) / np.where(spread > 0, spread, np.inf)
    return float(0.5 * max(surprise.max(), 0.0) ** 2 - np.log(len(surprise)))


def _told(disturbances: FloatArray, during: FloatArray) -> FloatArray:
    """Logarithms of: the fourth moment over the square of the second; the power while the axis was used in
    each way, over that of all."""
    power = disturbances**2 / np.mean(disturbances**2)
    used = during.sum(axis=1)
    shares = during @ power / np.where(used > 0, used, 1.0)
    return np.log(np.concatenate([[np.mean(power**2)], np.where(used > 0, shares, 1.0)]))


def _uses(fit: JointFit, number: int) -> FloatArray:
    """How one record uses the axis (ways, samples), none below zero: squares of speed and acceleration,
    turns, limits met and left, how far what is asked changes."""
    record, run = fit.response.records[number], fit.response.along(fit.values, number)
    late = fit.structure.delay_samples
    asked = np.concatenate([np.zeros(late), record.u[: len(record) - late]])
    limited, _ = limited_and_gain(fit.response.packed(fit.values), asked, run.w)
    speed = np.gradient(run.w)
    met = (limited != asked).astype(np.float64)
    turned = np.diff(np.sign(speed), prepend=np.sign(speed[0])) != 0
    left = np.diff(met, prepend=0.0) < 0
    changed = np.abs(np.diff(limited, prepend=0.0))
    return np.stack([speed**2, np.gradient(speed) ** 2, turned, met, left, changed]).astype(np.float64)


def _least_phase(power: FloatArray) -> ComplexArray:
    """The causal response (frequencies,) with this power spectrum (Kolmogorov's factor, by the cepstrum)."""
    points = 2 * (len(power) - 1)
    cepstrum = np.fft.irfft(np.log(power))
    cepstrum[1 : points // 2] *= 2
    cepstrum[points // 2 + 1 :] = 0.0
    return np.asarray(np.exp(0.5 * np.fft.rfft(cepstrum)))
