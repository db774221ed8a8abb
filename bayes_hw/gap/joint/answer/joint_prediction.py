"""How far an answer predicts: what of the avoidable error it removes, and the band about its prediction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.starts import Starts
from bayes_hw.gap.joint.posterior.joint_closure import (
    DRIFT,
    Floor,
    closure_of,
    of_axis,
    rms,
    shown_spread,
    spread,
    without_glitches,
)
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.observer import unobserved
from bayes_hw.record import Record

PREDICTED_DRAWS, FEWEST_STABLE = 40, 5


class Band(NamedTuple):
    """Predictions (samples,) of a record: the angle of the axis before and after, and the interval of what
    the encoder shows, its drift included."""

    before: FloatArray
    after: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class Predictor:
    """Predicts records from their `starts` with the `fit` of an answer and with some of its `draws`; those of
    `holdout` are not scored while they settle."""

    fit: JointFit
    draws: tuple[JointValues, ...]
    answer: Sequence[str]
    starts: Starts
    holdout: tuple[Record, ...]
    floor: Floor
    rng: np.random.Generator

    @classmethod
    def of(
        cls,
        posterior: JointPosterior,
        fit: JointFit,
        answer: Sequence[str],
        starts: Starts,
        holdout: tuple[Record, ...],
        floor: Floor,
        rng: np.random.Generator,
    ) -> Predictor:
        """With some of the draws of a posterior, of which `fit` is the middle."""
        chosen = rng.choice(len(posterior.coordinates), PREDICTED_DRAWS, replace=False)
        draws = tuple(posterior.fit.response.values(posterior.coordinates[i]) for i in chosen)
        return cls(fit, draws, answer, starts, holdout, floor, rng)

    @property
    def drifts(self) -> bool:
        """Whether the encoder drifts from the axis in the answer."""
        return DRIFT in self.fit.labels

    def closure(self, records: Sequence[Record], one: JointFit, other: JointFit) -> Closure:
        """How far the second fit closes the gap of the first on records."""
        scored = [self.starts.unscored(r) if r in self.holdout else 0 for r in records]

        def predicted(fit: JointFit, values: JointValues | None = None) -> list[FloatArray]:
            return [self.starts.predict(fit, r, values)[n:] for r, n in zip(records, scored, strict=True)]

        measured = [r.y_or_nan[n:] for r, n in zip(records, scored, strict=True)]
        before, shown = predicted(one), predicted(other)
        after = predicted(other, of_axis(other.values)) if self.drifts else shown
        kept = without_glitches(measured, shown) if "outliers" in self.answer else measured
        y = [m - (s - a) for m, s, a in zip(kept, shown, after, strict=True)]
        draws = self.draws if self.floor.hidden else ()
        drawn = [predicted(other, of_axis(values)) for values in draws]
        found = closure_of(y, before, after, drawn, self.floor, self.rng)
        return replace(found, rmse_before=rms(measured, before), rmse_after=rms(measured, shown))

    def band(self, base: JointFit, record: Record, lead: int) -> Band:
        """Of a record held out but for its first `lead` samples; `base` is what the answer is added to."""
        fit, predict = self.fit, self.starts.predict
        first, last = predict(base, record)[lead:], predict(fit, record)[lead:]
        drawn = np.array([predict(fit, record, values, self.rng)[lead:] for values in self.draws])
        # No axis leaves where it was by its whole travel: such draws are of a motion that is not stable.
        stable = np.abs(drawn - last).max(axis=1) < fit.response.scale.travel
        doubt = _middle_spread(drawn[stable]) if stable.sum() >= FEWEST_STABLE else np.zeros_like(last)
        after = predict(fit, record, of_axis(fit.values))[lead:] if self.drifts else last
        half = NORMAL_HALF_WIDTH * np.sqrt(doubt**2 + shown_spread(fit) ** 2)
        if fit.observer is not None:
            # No simulation follows the motion, whatever the parameters: as far off as on training records.
            half = np.maximum(half, NORMAL_HALF_WIDTH * spread(unobserved(fit)[0]))
        return Band(first, after, last - half, last + half)


def _middle_spread(drawn: FloatArray) -> FloatArray:
    """Standard deviation (samples,) of draws (draws, samples) by their middle two thirds: a normal in
    coordinates has a few draws whose response is far from any that the records allow."""
    low, high = np.quantile(drawn, [0.16, 0.84], axis=0)
    return np.asarray((high - low) / 2, dtype=np.float64)
