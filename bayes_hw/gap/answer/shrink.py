"""The explained fraction of the reducible error: predictions before and after the effects are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import truncnorm

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.noise.glitches import find_glitches

LOWER_TAIL = 0.03
"""Below the interval of a closed fraction, whose density piles up at its largest value: there it ends."""

SIGNIFICANT = 3.0
"""Standard deviations of the noise's mean square that make what is left count as measured."""

DRAWS_SIMULATED = 64

DIGITS = 3
"""Of a closed fraction: its interval is rounded outward to the digits that anyone reads."""

RESAMPLED = 400
LEAST_REDUCIBLE = 0.01
"""Of the squared error before: the noise is not taken for more than the rest."""


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


def without_glitches(
    explanation: Explanation, measured: Sequence[FloatArray], shown: Sequence[FloatArray]
) -> list[FloatArray]:
    """Records with glitches, where they are the effect, put to where the encoder is expected.

    A glitch says nothing of the motion.
    """
    if explanation.stochastic is None or not explanation.stochastic.isolates:
        return list(measured)
    masks = find_glitches([y - s for y, s in zip(measured, shown, strict=True)])
    return [np.where(m, s, y) for y, s, m in zip(measured, shown, masks, strict=True)]


def predicted(
    explanation: Explanation, values: FloatArray, inputs: Sequence[FloatArray], drift: bool = True
) -> list[FloatArray]:
    """Expected outputs of `inputs` at parameter values, as the encoder shows them.

    Without `drift` it is the angle of the axis, which a drifting encoder does not show.
    """
    simulated = explanation.fit.hypothesis.simulate(values, inputs, drift)
    stochastic = explanation.stochastic
    if stochastic is None or stochastic.display is None:
        return simulated
    return stochastic.display.expected(simulated)


def closure(
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    draws: Sequence[Sequence[FloatArray]],
    measured: Sequence[FloatArray],
    shown: Sequence[FloatArray],
    noise_sigma: float,
    correlation: float,
    rng: np.random.Generator,
    hidden: bool = False,
) -> Closure:
    """The closed fraction with parameters and the finite record both counted.

    `before`, `after` and `draws` are angles of the axis, `shown` what the encoder is expected to show of
    `after`.

    Each of `draws` (predictions at a posterior draw) is taken for the truth in turn: the squared errors of
    `before` and `after` against it, plus what is left on the record beyond the noise, whose own scatter over
    a record of this length and `correlation` of the noise is drawn. What hides in that scatter counts for the
    lower end. Where what is left is much, it need not be at right angles to what was removed, and the error
    before is taken from the record as well. Where errors of the readings are larger than the motion left
    (`hidden`), the record does not tell: parameters count alone, and the interval has a lower end only.
    """
    y = np.concatenate(measured)
    b, a = np.concatenate(list(before)), np.concatenate(list(after))
    scatter_share = np.sqrt(2 / (len(y) * (1 - correlation**2) / (1 + correlation**2)))
    square_before = float(np.mean((y - b) ** 2))
    drifting = any(np.any(x != z) for x, z in zip(shown, after, strict=True))
    square_after = float(np.mean((y - np.concatenate(list(shown))) ** 2))
    scatter = square_after * scatter_share
    fractions: list[float] = []
    lowest: list[float] = []
    for draw in draws:
        truth = np.concatenate(list(draw))
        reducible = float(np.mean((b - truth) ** 2))
        remaining = float(np.mean((a - truth) ** 2))
        beyond = square_after - remaining - noise_sigma**2
        left = 0.0 if hidden else max(0.0, beyond + rng.normal() * scatter)
        some = 0.0 if hidden else _positive_normal(beyond, scatter, rng)
        total = reducible
        if beyond > SIGNIFICANT * scatter and not drifting and not hidden:
            measured_total = square_before - noise_sigma**2 + rng.normal() * scatter
            total = max(measured_total, 1e-3 * (reducible + left)) - left
        for kept, unseen in ((fractions, left), (lowest, max(left, some))):
            kept.append(1 - (remaining + unseen) / (total + unseen) if total + unseen > 0 else 0.0)
    return Closure(
        float(np.sqrt(square_before)),
        float(np.sqrt(square_after)),
        noise_sigma,
        float(np.median(fractions)),
        rounded_outward(np.quantile(lowest, LOWER_TAIL), 1.0 if hidden else np.max(fractions)),
    )


def rounded_outward(low: float, high: float) -> tuple[float, float]:
    """The narrowest interval with ends of DIGITS decimal digits that holds [low, high]."""
    steps = 10.0**DIGITS
    return float(np.floor(low * steps) / steps), float(np.ceil(high * steps) / steps)


def _positive_normal(mean: float, sd: float, rng: np.random.Generator) -> float:
    """A draw from the normal distribution cut off below zero."""
    return float(truncnorm.rvs(-mean / sd, np.inf, loc=mean, scale=sd, random_state=rng)) if sd > 0 else 0.0


def measured_closure(
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    noise_sigma: float,
    noise_error: float,
    correlation: float,
    rng: np.random.Generator,
    drifts: Sequence[Sequence[FloatArray]] = (),
) -> Closure:
    """The closed fraction 1 - (A - sigma^2) / (B - sigma^2) from mean squared errors of the records alone.

    A and B are those of `after` and `before`. Measured, they hold the noise's own mean square over a record
    of this length and its products with the errors of the two predictions, which are drawn with the
    covariance that they have, as is the noise with its standard error `noise_error`; `correlation` is that
    of the noise from sample to sample. `drifts` are posterior draws of what a drifting encoder adds to the
    readings `measured` beyond the drift that was taken off them.
    """
    y = np.concatenate(list(measured))
    error_before, error_after = (y - np.concatenate(list(p)) for p in (before, after))
    square_before, square_after = float(np.mean(error_before**2)), float(np.mean(error_after**2))
    samples, variance = len(y), noise_sigma**2
    shared = float(np.mean(error_before * error_after)) - variance
    least = LEAST_REDUCIBLE * square_before
    errors = np.array(
        [[max(square_before - variance, least), shared], [shared, max(square_after - variance, 0)]]
    )
    memory = (1 + correlation) / (1 - correlation)
    products = _normal(4 * variance * memory / samples * errors, rng)
    longer = (1 + correlation**2) / (1 - correlation**2)
    own = variance * np.sqrt(2 * longer / samples) * rng.standard_normal(RESAMPLED)
    noise = (noise_sigma + noise_error * rng.standard_normal(RESAMPLED)) ** 2 + own
    drift_before, drift_after = _changes_by_drift((error_before, error_after), drifts, rng)
    left = square_after - noise + products[1] + drift_after
    reducible = square_before - noise + products[0] + drift_before
    fractions = np.minimum(1 - left / np.maximum(reducible, least), 1.0)
    low, high = np.quantile(fractions, [LOWER_TAIL, 1 - LOWER_TAIL])
    closed = 1 - (square_after - variance) / errors[0, 0]
    return Closure(
        float(np.sqrt(square_before)),
        float(np.sqrt(square_after)),
        noise_sigma,
        float(np.clip(closed, low, high)),
        rounded_outward(low, high),
    )


def _changes_by_drift(
    errors: Sequence[FloatArray], drifts: Sequence[Sequence[FloatArray]], rng: np.random.Generator
) -> list[FloatArray]:
    """What to add to the mean square of each of `errors`, (RESAMPLED,) each, for the error of the drift that
    was taken off: like noise it adds its own mean square and its products with them."""
    if not drifts:
        return [np.zeros(RESAMPLED) for _ in errors]
    every = np.array([np.concatenate(list(drift)) for drift in drifts])
    chosen = rng.integers(len(every), size=RESAMPLED)
    return [-np.mean(every * (every + 2 * error), axis=1)[chosen] for error in errors]


def _normal(covariance: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draws (2, RESAMPLED) of a normal distribution whose covariance may be short of positive definite."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ rng.standard_normal((2, RESAMPLED)))
