"""Faults of the readings, found from the residuals of a fit, and the weights that they ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize
from scipy.stats import kurtosis

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit
from bayes_hw.gap.joint.fit.structure_moves import pruned, regrown
from bayes_hw.gap.joint.noise.reading_faults import (
    MASK,
    REPEAT_SHARE,
    glitches,
    repeats,
    rounded_motion,
    rounding_step,
)
from bayes_hw.identify.growth.descent import innovations
from bayes_hw.identify.holes import without_holes

LEAST_NATS = 60.0
LONGEST_MEMORY = 0.65
"""A held reading follows the one before by the share that is held; slow error by nearly one."""


@dataclass(frozen=True)
class SpeedNoise:
    """Noise whose variance grows with the square of the speed: nats over a constant one, the standard
    deviation of the instants in samples, and how far the part that grows follows itself from sample to
    sample."""

    nats: float
    jitter: float
    memory: float

    @property
    def present(self) -> bool:
        return self.nats > LEAST_NATS and self.memory < LONGEST_MEMORY


def speeds(fit: JointFit) -> list[FloatArray]:
    """Simulated speeds of the output, output units a sample: the root mean square of the steps to a sample
    and from it, with the sign of both together. Where the axis turns within a sample it is not at rest."""
    values = fit.values
    return [signed_speed(fit.response.along(values, i).y) for i in range(len(fit.response.records))]


def signed_speed(y: FloatArray) -> FloatArray:
    """Of every sample (samples,) of an angle."""
    before, after = np.diff(y, prepend=y[:1]), np.diff(y, append=y[-1:])
    before[0], after[-1] = after[0], before[-1]
    return np.where(before + after < 0, -1.0, 1.0) * np.sqrt((before**2 + after**2) / 2)


def less_for_tails(nats: float, white: FloatArray) -> float:
    """Nats of a variance that changes, of noise whose values (n,) divided by their deviations are `white`.

    Squares of heavy-tailed noise scatter more than those of normal noise, and the ratio of likelihoods with
    them: it is divided by one and half of the excess kurtosis (Layard, 1973, doi 10.2307/2284766).
    """
    tails = max(float(kurtosis(white)), 0.0) if len(white) > 3 and np.ptp(white) > 0 else 0.0
    return nats / (1 + tails / 2)


def speed_noise(fit: JointFit, residuals: Sequence[FloatArray]) -> SpeedNoise:
    """Of unweighted residuals; innovations under the fit's noise are taken: slow error tells nothing.

    Nats are divided by what heavy tails add to the scatter of squares (`less_for_tails`): what
    jumps now and then, and most while the axis is fast, is no error of timing.
    """
    a = np.concatenate(innovations(fit.point, residuals))
    steps = speeds(fit)
    records = fit.response.records
    residuals = [np.where(r.measured_samples, e, 0.0) for r, e in zip(records, residuals, strict=True)]
    d = np.concatenate([s[r.measured_samples] for r, s in zip(records, steps, strict=True)]) ** 2
    samples = len(a)
    unit = float(np.mean(d))
    if unit == 0:
        return SpeedNoise(-0.5 * float(np.log(samples)), 0.0, 1.0)
    d = d / unit

    def minus(x: FloatArray) -> float:
        variance = np.exp(x[0]) + np.exp(x[1]) * d
        return 0.5 * float(np.sum(np.log(variance) + a**2 / variance))

    total = float(np.mean(a**2)) or 1e-300
    found = min(
        (
            minimize(minus, np.log([total * s, total * (1 - s) + 1e-300]), method="Nelder-Mead",
                     options={"maxiter": 120, "xatol": 0.01, "fatol": 0.05})
            for s in (0.9, 0.2)
        ),
        key=lambda r: r.fun,
    )  # fmt: skip
    gained = 0.5 * samples * (np.log(total) + 1) - found.fun
    gained = less_for_tails(gained, a / np.sqrt(np.exp(found.x[0]) + np.exp(found.x[1]) * d))
    # Of differences: what is slow, whatever its cause, drops out; of a part of memory m their neighbours
    # correlate by -(1 - m) / 2.
    turned = [np.sign(s[1:]) * np.diff(e) for s, e in zip(steps, residuals, strict=True)]
    product = np.concatenate([h[1:] * h[:-1] for h in turned])
    power = np.concatenate([(h[1:] ** 2 + h[:-1] ** 2) / 2 for h in turned])
    speed = np.concatenate([s[2:] ** 2 for s in steps])
    fast, at_rest = speed > np.quantile(speed, 0.6), speed <= np.quantile(speed, 0.3)
    grown = float(np.mean(power[fast]) - np.mean(power[at_rest]))
    followed = float(np.mean(product[fast]) - np.mean(product[at_rest]))
    memory = 1.0 + 2.0 * followed / max(grown, 1e-300)
    return SpeedNoise(
        float(gained - 0.5 * np.log(samples)), float(np.sqrt(np.exp(found.x[1]) / unit)), memory
    )


ROUNDED = 1.6
"""Step over the innovations' standard deviation from which rounding is named."""


@dataclass(frozen=True, eq=False)
class Readings:
    """What the readings' own faults ask of the fit: weights of every record and the nats of each label; the
    step of rounding, whether noise was added after it, and whether what it adds was `taken_off`."""

    weights: tuple[FloatArray, ...]
    nats: dict[str, float]
    step: float | None
    parameters: dict[str, float]
    rounded_first: bool = False
    taken_off: bool = False


def read_faults(fit: JointFit) -> Readings:
    """Rounding, repeats, glitches and errors of timing, from the residuals of a fit."""
    records = fit.response.records
    values = fit.values
    angles = [fit.response.along(values, number).y for number in range(len(records))]
    residuals = [without_holes(e) for e in fit.errors]
    innovation = innovation_sigma(fit)
    weights = [np.ones(len(record)) for record in records]
    nats: dict[str, float] = {}
    parameters: dict[str, float] = {}
    step = rounding_step(records)
    if step is not None and step > ROUNDED * innovation:
        share = min(step**2 / 12 / innovation**2, 1.0)
        nats["encoder_quantization"] = 1000.0 * share
        parameters["encoder_quantization.step"] = step
        return Readings(tuple(weights), nats, step, parameters)
    hidden = rounded_motion(residuals, angles, innovation)
    if hidden is not None:
        nats["encoder_quantization"] = hidden.nats
        parameters["encoder_quantization.step"] = hidden.step
        return Readings(tuple(weights), nats, hidden.step, parameters, rounded_first=True)
    moves = speeds(fit)
    masks = [repeats(record.y_or_nan, d, innovation) for record, d in zip(records, moves, strict=True)]
    share = float(np.mean(np.concatenate(masks)))
    if share > REPEAT_SHARE:
        nats["timing_jitter"] = 1000.0
        parameters["timing_jitter.share_repeated"] = share
        weights = [np.where(m, MASK, w) for m, w in zip(masks, weights, strict=True)]
    found = glitches([e / w for e, w in zip(residuals, weights, strict=True)])
    if found.present:
        nats["outliers"] = found.nats
        total = sum(len(record) for record in records)
        parameters["outliers.rate"] = found.count / total
        sizes = np.concatenate([e[m] for e, m in zip(residuals, found.masks, strict=True)])
        parameters["outliers.size"] = float(np.sqrt(np.mean(sizes**2)))
        weights = [np.where(m, MASK, w) for m, w in zip(found.masks, weights, strict=True)]
    else:
        noise = speed_noise(fit, [np.where(w > 1, 0.0, e) for e, w in zip(residuals, weights, strict=True)])
        if noise.present:
            nats.setdefault("timing_jitter", noise.nats)
            parameters["timing_jitter.sd"] = noise.jitter / records[0].sample_rate_hz
            level = max(
                innovation**2 - noise.jitter**2 * float(np.mean(np.concatenate(moves) ** 2)),
                0.05 * innovation**2,
            )
            weights = [
                w * np.sqrt(1 + noise.jitter**2 * d**2 / level) for w, d in zip(weights, moves, strict=True)
            ]
    return Readings(tuple(weights), nats, step, parameters)


def innovation_sigma(fit: JointFit) -> float:
    """Standard deviation of the innovations, output units where the weights are one."""
    return float(np.sqrt(fit.point.sum_of_squares / fit.point.samples))


def weighted(fit: JointFit, weights: tuple[FloatArray, ...]) -> JointFit:
    """The same explanation under other weights, descended and its G grown on."""
    return regrown(pruned(fit.under(replace(fit.response, weights=weights)).descended()), 3)


def read_again(
    base: AnyFit, fit: AnyFit, readings: Readings, reweighted: Callable[[AnyFit, Readings], AnyFit]
) -> tuple[AnyFit, AnyFit, Readings]:
    """Faults that only an explanation on the way seemed to show are taken back, both fits under the weights
    that are then left; what was `taken_off` the readings is no longer there to be seen."""
    if not readings.nats or readings.taken_off:
        return base, fit, readings
    again = read_faults(fit)
    if readings.nats.keys() <= again.nats.keys():
        return base, fit, readings
    return reweighted(base, again), reweighted(fit, again), again


WINDOWS = (1, 6)
"""Samples whose innovations are summed: a jump that the axis follows goes on for several."""

NORMAL = 0.6
"""Largest excess kurtosis of such sums where nothing jumps."""

CLEAR = 3.0
"""Standard deviations of the innovations by which a sample lies beyond the dead zone."""

FEWEST = 400
"""Samples that tell a kurtosis."""


def jumps(fit: JointFit) -> bool:
    """Whether innovations of a fit, or their sums over WINDOWS, are far from normal.

    Where the dead zone holds the output they come in jumps whatever moves the axis: such samples, by what is
    simulated or by what was measured, do not count.
    """
    return max(sum_kurtosis(fit, window) for window in WINDOWS) > NORMAL


def sum_kurtosis(fit: JointFit, window: int) -> float:
    """Excess kurtosis of sums of so many innovations clear of the dead zone; zero where these are few."""
    values, margin = fit.values, CLEAR * innovation_sigma(fit)
    reach = values.cascade.half_width + margin
    found: list[FloatArray] = []
    for white, record in zip(innovations(fit.point), fit.response.records, strict=True):
        w = np.abs(fit.response.simulate(values, record.u, record.known).w)
        beyond = ((w > reach) & (np.abs(record.y) > margin))[record.measured_samples]
        if len(white) < window:
            continue
        ones = np.ones(window)
        clear = np.convolve(beyond, ones, "valid") > window - 0.5
        found.append(np.convolve(white, ones, "valid")[clear])
    a = np.concatenate([np.zeros(0), *found])
    return float(np.mean(a**4) / np.mean(a**2) ** 2 - 3) if len(a) >= FEWEST else 0.0
