"""Faults of the readings, found from the residuals of a fit, and the weights that they ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

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
from bayes_hw.gap.joint.residuals.noise_causes import speed_noise, speeds
from bayes_hw.identify.holes import without_holes

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
    """Faults of timing that only an explanation on the way seemed to show are taken back, both fits under the
    weights that are then left."""
    if "timing_jitter.sd" not in readings.parameters:
        return base, fit, readings
    again = read_faults(fit)
    if "timing_jitter" in again.nats:
        return base, fit, readings
    return reweighted(base, again), reweighted(fit, again), again
