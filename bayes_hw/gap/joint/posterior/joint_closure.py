"""How much of the avoidable error an explanation removes: of the angle of the axis, not of its readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import highest_density_interval
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH, PROBABILITY
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.reading_faults import glitches
from bayes_hw.gap.joint.residuals.remainder import samples_of_variance
from bayes_hw.gap.joint.response.joint_values import JointValues

DRIFT, ROUNDING = "sensor_drift", "encoder_quantization"
MIMICKED = ("wind", "timing_jitter", OTHER)
"""Labels of motion, at the instants of the readings, that noise mimics; it counts as motion."""

DOUBT, PLAIN_DOUBT = 0.15, 0.02
"""How far a floor may be off, a share of it: where rounding makes it depend on the motion or where motion
mimics noise; else."""

ESTIMATED = 1.5
"""Of the standard error of a variance from finitely many samples."""

BOOTSTRAPS, BLOCKS, LEAST_REDUCIBLE = 300, 40, 0.01

ROUNDED = 1e-9
"""Of the error: predictions that differ by less are one simulation in other coordinates."""


@dataclass(frozen=True)
class Floor:
    """Root mean square, output units, of what readings are off from the angle of the axis; its standard
    error; and the least it can be, were all colour of the noise motion that is left.

    `hidden` says that readings walk away from the axis, so that a record does not tell what is left.
    """

    level: float
    error: float
    lowest: float
    hidden: bool = False

    @classmethod
    def of(cls, fit: JointFit, answer: Sequence[str], sigma: float) -> Floor:
        """Of the training records' residuals under this answer, with the encoder's noise `sigma`."""
        level = spread(fit) if ROUNDING in answer else sigma
        doubt = DOUBT if set(answer) & {ROUNDING, *MIMICKED} else PLAIN_DOUBT
        error = level * (ESTIMATED / np.sqrt(2 * samples_of_variance(fit.point.residuals)) + doubt)
        white = fit.innovation_sigma if fit.point.whitener.order > 1 else level
        return cls(level, float(error), min(level, white), walks(fit, answer))


def walks(fit: JointFit, answer: Sequence[str]) -> bool:
    """Whether the answer says that readings drift in no way that the fit describes."""
    return DRIFT in answer and not any(e.form.label == DRIFT for e in fit.response.template)


def of_axis(values: JointValues) -> JointValues:
    """Without the drift of the encoder, which the axis does not follow."""
    return replace(values, effects=tuple(e for e in values.effects if e.form.label != DRIFT))


def without_glitches(measured: Sequence[FloatArray], shown: Sequence[FloatArray]) -> list[FloatArray]:
    """Records (samples,) NaN where a glitch stands out of what the encoder is expected to show."""
    errors = [np.nan_to_num(y - s) for y, s in zip(measured, shown, strict=True)]
    masks = glitches(errors).masks
    return [np.where(m, np.nan, y) for y, m in zip(measured, masks, strict=True)]


def rms(measured: Sequence[FloatArray], predicted: Sequence[FloatArray]) -> float:
    """Root mean square of what was measured less what was predicted, where it was."""
    errors = np.concatenate([y - p for y, p in zip(measured, predicted, strict=True)])
    return float(np.sqrt(np.nanmean(errors**2)))


def spread(fit: JointFit) -> float:
    """Standard deviation of a reading about its prediction, glitches left out, output units."""
    kept = np.concatenate([e[told] for e, told in zip(fit.errors, fit.response.told, strict=True)])
    return float(np.sqrt(np.mean(kept**2)))


def shown_spread(fit: JointFit) -> float:
    """That of all readings, those that are held or far off with them: so large that a normal band of it holds
    as many of the readings trained on as it says."""
    if fit.response.weights is None:
        return spread(fit)
    errors = np.abs(np.concatenate(fit.errors))
    held = float(np.nanquantile(errors, PROBABILITY)) / NORMAL_HALF_WIDTH
    return max(spread(fit), held)


def differ(one: FloatArray, other: FloatArray, error: float) -> bool:
    """Whether two predictions, or what they leave, differ by more than one simulation in other coordinates
    does, which leaves an `error` of this size."""
    return bool(np.abs(one - other).max(initial=0.0) > ROUNDED * error)


def closure_of(
    measured: Sequence[FloatArray],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    drawn: Sequence[Sequence[FloatArray]],
    floor: Floor,
    rng: np.random.Generator,
) -> Closure:
    """Closed fraction 1 - (after^2 - floor^2) / (before^2 - floor^2) of readings without their drift.

    `measured` is NaN where nothing was measured or a glitch was, which does not count. For the interval the
    floor and the blocks of the records are drawn anew, its lower end with the colour of the noise taken for
    motion as well. Where readings walk, every one of `drawn` (predictions at a draw, record by record) is
    taken for the truth instead, and there is no upper end.
    """
    y, b, a = (np.concatenate(list(part)) for part in (measured, before, after))
    known = ~np.isnan(y)
    e0, e1 = (y - b)[known], (y - a)[known]
    rmse0, rmse1 = float(np.sqrt(np.mean(e0**2))), float(np.sqrt(np.mean(e1**2)))
    if not differ(e0, e1, rmse0):
        return Closure(rmse0, rmse1, floor.level, 0.0, (0.0, 0.0))
    if floor.hidden:
        truths = [np.concatenate(list(draw))[known] for draw in drawn]
        fractions = np.array([_closed_against(b[known], a[known], truth) for truth in truths])
        low, _ = highest_density_interval(fractions, 0.94)
        middle = float(np.median(fractions))
        return Closure(rmse0, rmse1, floor.level, middle, (min(low, middle), 1.0))
    parts0, parts1 = (np.array([np.mean(p**2) for p in np.array_split(e, BLOCKS)]) for e in (e0, e1))

    def drawn_closed(level: float) -> FloatArray:
        found = []
        for _ in range(BOOTSTRAPS):
            pick = rng.integers(0, BLOCKS, BLOCKS)
            one = level + floor.error * rng.standard_normal()
            found.append(_closed(parts0[pick].mean(), parts1[pick].mean(), one))
        return np.array(found)

    low, high = highest_density_interval(drawn_closed(floor.level), 0.94)
    if floor.lowest < floor.level:
        low = min(low, highest_density_interval(drawn_closed(floor.lowest), 0.94)[0])
    middle = _closed(rmse0**2, rmse1**2, floor.level)
    return Closure(rmse0, rmse1, floor.level, middle, (min(low, middle), max(high, middle)))


def _closed(before: float, after: float, floor: float) -> float:
    reducible = max(before - floor**2, LEAST_REDUCIBLE * before)
    return 1 - max(after - floor**2, 0.0) / reducible


def _closed_against(before: FloatArray, after: FloatArray, truth: FloatArray) -> float:
    left = float(np.mean((before - truth) ** 2))
    return 1 - float(np.mean((after - truth) ** 2)) / left if left > 0 else 0.0
