"""One explanation of the gap: effects of the response and at most one stochastic effect, fitted."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.words import is_said
from bayes_hw.gap.fit.fit import Fit, fitted_on
from bayes_hw.gap.fit.hypothesis import LARGEST_STRAIN, Hypothesis
from bayes_hw.gap.noise.random_cause import ROUNDING, Tracking
from bayes_hw.gap.noise.stochastic_fit import Display, StochasticFit, autoregression
from bayes_hw.gap.noise.whitener import Autoregression
from bayes_hw.gap.simulate.builder import Followed

NOISE_ROUNDS = 2

LARGEST_CORRELATION = 0.95
"""Of neighbouring samples: noise that hardly forgets leaves next to no independent ones to count."""

CHAOS_MARGIN = 50.0
"""Log-evidence by which chaotic motion must be ahead of all that can be predicted before what it leaves is
laid to its being chaotic."""

REPEATS_MARGIN = 1000.0
"""Log-evidence by which repeated samples must be ahead before responses to fresh ones are sought no more."""

Kind = TypeVar("Kind", bound=Hashable)


@dataclass(frozen=True, eq=False)
class Explanation:
    """`fit` of the response effects under the noise of `stochastic`, or autoregressive noise where None."""

    fit: Fit
    stochastic: StochasticFit | None
    log_evidence: float

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the effects, sorted, none twice."""
        found = set(self.fit.hypothesis.labels)
        if self.cause_of_noise is not None:
            found.update(self.cause_of_noise.labels)
        return tuple(sorted(found))

    @property
    def name(self) -> str:
        """Labels with their forms."""
        names = [effect.name for effect in self.fit.hypothesis.effects]
        cause = self.cause_of_noise
        if cause is not None:
            names.append(cause.label + (f" ({cause.form})" if cause.form else ""))
        return " + ".join(names) or "base"

    @property
    def cause_of_noise(self) -> StochasticFit | None:
        """The stochastic effect; of noise that stands for `chaotic_response` what is beside it, if
        anything."""
        if self.stochastic is None or not self.chaotic_response:
            return self.stochastic
        return self.stochastic.second

    @property
    def display(self) -> Display | None:
        """How the encoder repeats or rounds samples, where it does."""
        return None if self.stochastic is None else self.stochastic.display

    @property
    def followed(self) -> Followed | None:
        """What the simulation is corrected by at every sample, if anything."""
        return self.fit.hypothesis.followed

    @property
    def chaotic_response(self) -> bool:
        """Whether slow noise, or what the measured output corrects, stands for motion of a chaotic effect
        that no simulation can follow."""
        if self.followed is not None:
            return True
        return self.chaotic and self.stochastic is not None and self.stochastic.cause.slow

    @property
    def encoder_sigma(self) -> float:
        """The stationary noise of the encoder alone, output units."""
        if self.stochastic is not None and self.stochastic.encoder_sigma is not None:
            return self.stochastic.encoder_sigma
        return self.fit.whitener.sigma / (1.0 if self.followed is None else self.followed.spread)

    @property
    def noise_correlation(self) -> float:
        """Of neighbouring samples of the encoder's noise, whatever else the noise of the fit describes."""
        return float(np.clip(self.fit.whitener.correlation, -LARGEST_CORRELATION, LARGEST_CORRELATION))

    @property
    def rounded(self) -> bool:
        """Whether the encoder rounds: a fact where the records lie on a lattice, no hypothesis."""
        return ROUNDING in self.labels

    @property
    def encoder_noise(self) -> Autoregression:
        """First-order noise of the encoder alone, without what a stochastic effect or coloured residuals of a
        model that lacks something add to it."""
        whitener, sigma = self.fit.whitener, self.encoder_sigma
        correlation = whitener.correlation
        gaps = whitener.glitches_in(self.fit.residuals)
        innovation = sigma * float(np.sqrt(1 - correlation**2))
        coefficients, unread = np.array([correlation]), self.fit.unread
        return Autoregression(coefficients, innovation, sigma, float("nan"), gaps, unread=unread)

    @property
    def chaotic(self) -> bool:
        """Whether an effect's motion cannot be predicted for long."""
        return any(effect.chaotic for effect in self.fit.hypothesis.effects)

    @property
    def cannot_be_predicted(self) -> bool:
        """Whether an effect is chaotic, or followed since its motion jumps."""
        return self.chaotic or self.followed is not None

    @property
    def tracking(self) -> Tracking:
        """How much of the axis's motion a record tells."""
        if self.cannot_be_predicted:
            return Tracking.MEAN_SQUARES
        if self.stochastic is None:
            return Tracking.EVERY_SAMPLE
        cause = self.stochastic.cause
        return cause.beside if self.fit.hypothesis.effects else cause.alone

    @property
    def drifts(self) -> bool:
        """Whether slow noise may hold motion that a response would otherwise have to follow."""
        return self.stochastic is not None and self.stochastic.drifts

    @property
    def bent_disturbance(self) -> float:
        """Root mean square of a random torque, output units, whose path an effect bends."""
        if self.stochastic is None or not self.stochastic.cause.through_axis:
            return 0.0
        bent = any(effect.bends_path for effect in self.fit.hypothesis.effects)
        return self.stochastic.size or 0.0 if bent else 0.0

    @property
    def at_odds_with_prior(self) -> bool:
        """Whether a base parameter is farther from the nominal model than a nominal model can be off."""
        deviations = self.fit.hypothesis.prior_deviations(self.fit.coordinates)
        return bool(np.any(np.abs(deviations[: self.fit.hypothesis.base_count]) > LARGEST_STRAIN))

    @property
    def unheard_of(self) -> tuple[str, ...]:
        """Names of the parameters of effects that are farther from what such effects have than any can be,
        but for their sizes, which may be any, and what is not said since it only rounds a corner."""
        hypothesis, found = self.fit.hypothesis, list[str]()
        deviations = np.abs(hypothesis.prior_deviations(self.fit.coordinates))
        for effect, rows in zip(hypothesis.effects, hypothesis.effect_rows, strict=True):
            sizes = np.not_equal(effect.test_values, effect.vanishing_values)
            own = zip(hypothesis.parameters[rows], deviations[rows], sizes, strict=True)
            found += [
                parameter.name
                for parameter, deviation, size in own
                if deviation > LARGEST_STRAIN and not size and is_said(parameter.name)
            ]
        return tuple(found)

    @property
    def innovations(self) -> list[FloatArray]:
        """Whitened residuals of every record: white and of unit variance where the explanation holds."""
        return [self.fit.whitener.whiten(e[:, None], r)[:, 0] for r, e in enumerate(self.fit.residuals)]


def best_of_each(
    explanations: Iterable[Explanation], key: Callable[[Explanation], Kind]
) -> dict[Kind, Explanation]:
    """The explanation of most evidence for every value of `key`, best first."""
    best: dict[Kind, Explanation] = {}
    for explanation in sorted(explanations, key=lambda e: -e.log_evidence):
        best.setdefault(key(explanation), explanation)
    return best


def is_far_ahead(explanations: Sequence[Explanation]) -> bool:
    """Whether an effect that cannot be predicted is ahead of every explanation without by CHAOS_MARGIN."""
    evidence = {
        lost: max((e.log_evidence for e in explanations if e.cannot_be_predicted == lost), default=-np.inf)
        for lost in (True, False)
    }
    return bool(evidence[True] > evidence[False] + CHAOS_MARGIN)


def repeats_far_ahead(explanations: Sequence[Explanation]) -> bool:
    """Whether an encoder that repeats samples is ahead of every one that does not by REPEATS_MARGIN."""
    repeats = [e.log_evidence for e in explanations if e.display is not None and not e.rounded]
    others = [e.log_evidence for e in explanations if e.display is None or e.rounded]
    return bool(repeats) and max(repeats) > max(others, default=-np.inf) + REPEATS_MARGIN


def with_coloured_noise(start: Fit, measured: Sequence[FloatArray], iterations: int = 12) -> Explanation:
    """The fit under autoregressive noise, in turns with the noise, from a fit on plain residuals."""
    current = start
    for _ in range(NOISE_ROUNDS):
        current = fitted_on(current, measured, autoregression(current), iterations)
    current = replace(current, whitener=autoregression(current))
    return Explanation(current, None, _finite(current.log_evidence()))


def with_stochastic(found: StochasticFit, start: Fit) -> Explanation:
    """The same response with the noise of a stochastic effect."""
    moved = replace(start, whitener=found.whitener)
    penalty = 0.5 * len(found.parameters) * np.log(start.readings)
    base = moved.log_evidence() - found.whitener.log_likelihood + found.log_likelihood
    return Explanation(moved, found, _finite(base - penalty))


def _finite(log_evidence: float) -> float:
    """Minus infinity where a fit has run away: it explains nothing."""
    return log_evidence if np.isfinite(log_evidence) else -np.inf


class ShownHypothesis(Hypothesis):
    """A hypothesis whose simulated training outputs are shown by an encoder that repeats or rounds them."""

    display: Display

    @classmethod
    def of(cls, hypothesis: Hypothesis, display: Display) -> ShownHypothesis:
        """`hypothesis` with a display of its training records."""
        shown = cls(hypothesis.builder, hypothesis.scale, hypothesis.inputs, hypothesis.effects)
        object.__setattr__(shown, "display", display)
        return shown

    def simulate_batch(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None = None, drift: bool = True
    ) -> list[FloatArray]:
        simulated = super().simulate_batch(values, inputs, drift)
        if inputs is not None:
            return simulated
        return [
            np.stack([self.display.show(y, record) for y in batch.T], axis=1)
            for record, batch in enumerate(simulated)
        ]
