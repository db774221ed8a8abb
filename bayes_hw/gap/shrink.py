"""How far the gap shrinks: prediction of records before and after the effects are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.explanation import Explanation
from bayes_hw.gap.glitches import find_glitches
from bayes_hw.gap.stochastic import MAX_AGE, HeldDisplay

PROBABILITY = 0.94
LOWER_TAIL = 0.03
"""Below the interval of a closed fraction, whose density piles up at its largest value: there it ends."""

SIGNIFICANT = 3.0
"""Standard deviations of the noise's mean square that make what is left count as measured."""

DRAWS_SIMULATED = 64


@dataclass(frozen=True)
class Closure:
    """Root mean square errors (output units) and the fraction of the reducible squared error removed."""

    rmse_before: float
    rmse_after: float
    noise_floor: float
    closed: float
    closed_hdi94: tuple[float, float]

    def with_errors_of(
        self,
        measured: Sequence[FloatArray],
        before: Sequence[FloatArray],
        after: Sequence[FloatArray],
        sigma: float,
    ) -> Closure:
        """The same fraction with the errors of these predictions of the records as measured."""
        y = np.concatenate(list(measured))
        errors = [float(np.sqrt(np.mean((y - np.concatenate(list(p))) ** 2))) for p in (before, after)]
        return replace(self, rmse_before=errors[0], rmse_after=errors[1], noise_floor=sigma)

    def to_dict(self) -> dict[str, object]:
        """As in verdict.json."""
        return {
            "rmse_before": self.rmse_before,
            "rmse_after": self.rmse_after,
            "noise_floor": self.noise_floor,
            "closed": self.closed,
            "closed_hdi94": list(self.closed_hdi94),
        }


def without_reading_errors(
    explanation: Explanation, measured: Sequence[FloatArray], shown: Sequence[FloatArray], sigma: float
) -> tuple[list[FloatArray], float]:
    """Records without the errors of single readings that an effect is, and the noise that is left in them.

    Glitches are put to where the encoder is expected; of rounded records the noise is that of training, the
    rounding in it. Neither says anything of the motion.
    """
    label = None if explanation.stochastic is None else explanation.stochastic.label
    if label == "encoder_quantization":
        return list(measured), float(np.sqrt(np.mean(np.concatenate(explanation.fit.residuals) ** 2)))
    if label != "outliers":
        return list(measured), sigma
    masks = find_glitches([y - s for y, s in zip(measured, shown, strict=True)])
    return [np.where(m, s, y) for y, s, m in zip(measured, shown, masks, strict=True)], sigma


def predicted(
    explanation: Explanation, values: FloatArray, inputs: Sequence[FloatArray], drift: bool = True
) -> list[FloatArray]:
    """Expected outputs of `inputs` at parameter values; of a display that repeats samples, its mean.

    Without `drift` it is the angle of the axis, which a drifting encoder does not show.
    """
    simulated = explanation.fit.hypothesis.simulate(values, inputs, drift)
    stochastic = explanation.stochastic
    if stochastic is None or not isinstance(stochastic.display, HeldDisplay):
        return simulated
    hold = stochastic.parameters["timing_jitter.repeated_share"][0]
    weights = (1 - hold) * hold ** np.arange(MAX_AGE + 1)
    shown = [np.tile(weights / weights.sum(), (len(y), 1)) for y in simulated]
    display = HeldDisplay(tuple(shown))
    return [display.show(y, record) for record, y in enumerate(simulated)]


def untracked_variance(explanation: Explanation, predictions: Sequence[FloatArray]) -> float:
    """Variance (output units squared) of a stochastic effect in the motion, which no one can track."""
    stochastic = explanation.stochastic
    if stochastic is None:
        return 0.0
    if stochastic.label == "wind":
        return stochastic.parameters["wind.sd"][0] ** 2
    if stochastic.form == "held samples":
        hold = stochastic.parameters["timing_jitter.repeated_share"][0]
        slopes = np.concatenate([np.diff(y) for y in predictions])
        return float(hold / (1 - hold) ** 2 * np.mean(slopes**2))
    if stochastic.form == "clock":
        rate = explanation.fit.hypothesis.scale.rate
        speeds = np.concatenate([np.gradient(y) * rate for y in predictions])
        return float(stochastic.parameters["timing_jitter.clock_sd"][0] ** 2 * np.mean(speeds**2))
    return 0.0


def closure(
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    draws: Sequence[Sequence[FloatArray]],
    measured: Sequence[FloatArray],
    shown: Sequence[FloatArray],
    untracked: float,
    noise_sigma: float,
    correlation: float,
    rng: np.random.Generator,
) -> Closure:
    """The closed fraction with parameters and the finite record both counted.

    `before`, `after` and `draws` are angles of the axis, `shown` what the encoder is expected to show of
    `after`.

    Each of `draws` (predictions at a posterior draw) is taken for the truth in turn: the squared errors of
    `before` and `after` against it, plus what is left on the record beyond the noise, whose own scatter over
    a record of this length and `correlation` of the noise is drawn. Where that is much, it need not be at
    right angles to what was removed, and the error before is taken from the record as well.
    """
    y = np.concatenate(measured)
    b, a = np.concatenate(list(before)), np.concatenate(list(after))
    effective = len(y) * (1 - correlation**2) / (1 + correlation**2)
    square_before = float(np.mean((y - b) ** 2))
    drifting = any(np.any(x != z) for x, z in zip(shown, after, strict=True))
    square_after = float(np.mean((y - np.concatenate(list(shown))) ** 2))
    fractions = []
    for draw in draws:
        truth = np.concatenate(list(draw))
        reducible = float(np.mean((b - truth) ** 2))
        remaining = float(np.mean((a - truth) ** 2))
        scatter = square_after * np.sqrt(2 / effective)
        beyond = square_after - remaining - untracked - noise_sigma**2
        left = max(0.0, beyond + rng.normal() * scatter)
        total = reducible + left + untracked
        if beyond > SIGNIFICANT * scatter and not drifting:
            measured_total = square_before - noise_sigma**2 + rng.normal() * scatter
            total = max(measured_total, 1e-3 * total)
        fractions.append(1 - (remaining + left + untracked) / total if total > 0 else 0.0)
    values = np.array(fractions)
    low, high = float(np.quantile(values, LOWER_TAIL)), float(values.max())
    return Closure(
        float(np.sqrt(square_before)),
        float(np.sqrt(square_after)),
        noise_sigma,
        float(np.median(values)),
        (low, high),
    )
