"""Base parameters averaged over what may be wrong with the model, each explanation by its probability.

Within the chosen explanation they are its posterior. Were another right, or none, they would be elsewhere
(Bayesian model averaging: Hoeting et al. 1999, doi 10.1214/ss/1009212519). No explanation is quite right,
so that a share of the draws lies farther off than its posterior has it, as far and as often as simulated
cases of known parameters ask for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.decide import Decision, best_of_sets
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.hypothesis import Hypothesis, held_within_prior
from bayes_hw.gap.search.attribute import Attribution

DRAWS = 2048
LEAST_DRAWS = 10

DEGREES_ASTRAY = 2
"""Of freedom, of the t distribution that errors of a wrong explanation follow."""

FAILED = 8
"""Best sets of effects whose scatter tells how far off the base parameters of a failed explanation are."""


def averaged_base(
    attribution: Attribution,
    decision: Decision,
    chosen: FloatArray | None,
    nominal_sigma: float,
    floor: float,
    calibration: Calibration,
    rng: np.random.Generator,
) -> FloatArray:
    """Draws (draws, base parameters + 1) of the base parameters and, last, the encoder's noise.

    `chosen` (n, base parameters + 1) are posterior draws within the decision's explanation, if any were made;
    of other explanations their normal approximations are drawn. The encoder's noise is known as
    `nominal_sigma` with a standard deviation of its logarithm of `calibration.sigma_log_sd`, and to be at
    most `floor`.
    """
    hypothesis = attribution.base.fit.hypothesis
    best = best_of_sets(attribution)
    best[decision.explanation.labels] = decision.explanation
    parts = []
    for labels, probability in decision.sets.items():
        count = round(probability * DRAWS)
        if labels == decision.explanation.labels and chosen is not None:
            parts.append(chosen[rng.integers(len(chosen), size=max(count, 1))])
        elif count >= LEAST_DRAWS:
            parts.append(_laplace_draws(best[labels], count, rng))
    count = round(decision.probability[OTHER] * DRAWS)
    if count >= LEAST_DRAWS:
        ranked = sorted(best.values(), key=lambda e: -e.log_evidence)
        failed = [*ranked[:FAILED], attribution.base]
        base = _scattered(decision.explanation, failed, calibration.failed_scale, count, rng)
        sigma, doubt = noise_beside(decision.explanation, nominal_sigma, floor, calibration)
        spread = np.exp(max(doubt, calibration.sigma_log_sd) * rng.standard_normal(count))
        parts.append(np.column_stack([base, sigma * spread]))
    for part in parts:
        part[:, :-1] = with_tails(part[:, :-1], hypothesis, calibration, rng)
    return np.concatenate(parts)


def with_tails(
    drawn: FloatArray, hypothesis: Hypothesis, calibration: Calibration, rng: np.random.Generator
) -> FloatArray:
    """Draws (n, base parameters), a share of them moved away from their mean.

    Those are of a posterior `astray_scale` as wide whose variance is known by DEGREES_ASTRAY of freedom only,
    in the coordinates of `hypothesis`; no farther from the nominal model than that can be off.
    """
    if not calibration.astray_share:
        return drawn
    coordinates = hypothesis.to_coordinates(drawn)
    centre = coordinates.mean(axis=0)
    wide = calibration.astray_scale * np.sqrt(DEGREES_ASTRAY / rng.chisquare(DEGREES_ASTRAY, len(drawn)))
    factors = np.where(rng.random(len(drawn)) < calibration.astray_share, wide, 1.0)
    spread = centre + (coordinates - centre) * factors[:, None]
    return np.asarray(hypothesis.to_values(held_within_prior(hypothesis, spread, centre)))


def _laplace_draws(explanation: Explanation, count: int, rng: np.random.Generator) -> FloatArray:
    """Draws (count, base parameters + 1) of the normal approximation of an explanation's posterior."""
    fit = explanation.fit
    drawn = rng.multivariate_normal(fit.coordinates, fit.covariance(), count, method="eigh")
    base = fit.hypothesis.to_values(drawn)[:, : fit.hypothesis.base_count]
    samples = fit.readings
    sigma = explanation.encoder_sigma * (1 + rng.standard_normal(count) / np.sqrt(2 * samples))
    return np.column_stack([base, sigma])


def _scattered(
    best: Explanation, failed: Sequence[Explanation], scale: float, count: int, rng: np.random.Generator
) -> FloatArray:
    """Base parameters (count, base parameters) about those of `best`, `scale` times as far as `failed` ones
    lie, no farther from the nominal model than that can be off."""
    hypothesis = failed[-1].fit.hypothesis
    rows = slice(hypothesis.base_count)
    apart = np.array([e.fit.coordinates[rows] - best.fit.coordinates[rows] for e in failed])
    spread = scale**2 * apart.T @ apart / len(failed) + best.fit.covariance()[rows, rows]
    centre = best.fit.coordinates[rows]
    drawn = rng.multivariate_normal(centre, spread, count, method="eigh")
    return np.asarray(hypothesis.to_values(held_within_prior(hypothesis, drawn, centre)))


def noise_beside(
    best: Explanation, nominal_sigma: float, floor: float, calibration: Calibration
) -> tuple[float, float]:
    """The encoder's noise where no explanation holds, and how far it may be off, as a logarithm.

    Half way between what is known of it and what `best` leaves, which holds the gap too; of what is left
    no more than `calibration.largest_doubt` counts, nor more than the `floor` of what repeats do not share.
    What is left alone where nothing is known.
    """
    left = min(best.encoder_sigma, floor)
    if not nominal_sigma > 0:
        return left, 0.0
    apart = np.log(left / nominal_sigma)
    most = calibration.largest_doubt
    half = 0.5 * float(np.clip(apart, -most, most))
    return nominal_sigma * float(np.exp(half)), abs(half)


@dataclass(frozen=True)
class BaseShift:
    """A base parameter: as given, fitted without effects, and estimated jointly with the answer's effects."""

    name: str
    nominal: float
    alone: float
    joint: Estimate

    @property
    def pushed(self) -> float:
        """Fit alone less joint estimate, in standard deviations of the joint estimate."""
        return (self.alone - self.joint.mean) / self.joint.sd if self.joint.sd > 0 else float("nan")


def base_shifts(
    base: Explanation, nominal_sigma: float, estimates: Mapping[str, Estimate]
) -> list[BaseShift]:
    """Every base parameter of `estimates`, those of a verdict.

    `base` is the base model fitted alone, `nominal_sigma` the encoder's noise as given, output units.
    """
    hypothesis = base.fit.hypothesis
    nominal = {p.name: p.nominal for p in hypothesis.parameters}
    alone = {p.name: float(v) for p, v in zip(hypothesis.parameters, base.fit.values, strict=True)}
    nominal[NOISE_SIGMA] = nominal_sigma
    alone[NOISE_SIGMA] = base.encoder_sigma
    return [BaseShift(name, nominal[name], alone[name], joint) for name, joint in estimates.items()]
