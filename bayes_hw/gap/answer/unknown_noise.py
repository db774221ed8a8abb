"""Decisions where no noise level is given: what is left is held against the gap instead of the noise.

A model.json names its noise, so that structure above it asks for a cause. A simulator that names none is
often compared with records of little noise, where every simplification stands out of it. What matters then is
how much of the gap is accounted for: what is small beside it is called neither a second effect nor "other".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import Fit, plain_fit
from bayes_hw.gap.noise.plain_noise import CorrelatedPlain
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.gap.search.attribute import Attribution

LARGEST_WANDER = 1.3
"""Growth of the plain error under coloured noise at which plain least squares is the better estimate."""


def plain_estimate(
    explanation: Explanation, singles: Sequence[Fit], measured: Sequence[FloatArray]
) -> Explanation:
    """The explanation with the form of its effect and the parameters that plain least squares give.

    The label is chosen under coloured noise, which sees changes of the residual and little of its level;
    where that had left much of the record to the noise, or another form does better, both are those of the
    plain fit. The evidence of a form is that of its plain residuals, counted for as few independent ones as
    those of the closest form.
    """
    if explanation.stochastic is not None or explanation.followed is not None:
        return explanation
    rivals = [f for f in singles if f.hypothesis.effects and f.hypothesis.labels == explanation.labels]
    forms = [plain_fit(f, measured) for f in (explanation.fit, *rivals)]
    noise = autoregression(min(forms, key=lambda f: f.rmse))
    found = max(
        (replace(f, whitener=CorrelatedPlain.of(noise.coefficients[0], f)) for f in forms),
        key=lambda f: f.log_evidence(),
    )
    same_form = found.hypothesis.effects == explanation.fit.hypothesis.effects
    if same_form and explanation.fit.rmse < LARGEST_WANDER * found.rmse:
        return explanation
    return replace(explanation, fit=found)


def with_plain_estimates(
    attribution: Attribution, decision: Decision, measured: Sequence[FloatArray]
) -> tuple[Attribution, Decision]:
    """Base and chosen explanation as plain least squares estimate them, wherever they stand."""
    base = plain_estimate(attribution.base, (), measured)
    chosen = base
    if decision.explanation is not attribution.base:
        chosen = plain_estimate(decision.explanation, attribution.singles, measured)
    known = {id(attribution.base): base, id(decision.explanation): chosen}
    explanations = tuple(known.get(id(e), e) for e in attribution.explanations)
    return (
        replace(attribution, base=base, explanations=explanations),
        replace(decision, explanation=chosen),
    )


def without_small_seconds(attribution: Attribution, share: float) -> Attribution:
    """The attribution without pairs of which one label alone leaves less than a `share` of the error."""
    limit = share * attribution.base.fit.rmse
    enough = {e.labels for e in attribution.explanations if len(e.labels) == 1 and e.fit.rmse < limit}
    kept = tuple(
        e
        for e in attribution.explanations
        if len(e.labels) < 2 or ROUNDING in e.labels or not any((label,) in enough for label in e.labels)
    )
    return replace(attribution, explanations=kept)


def of_the_gap(
    left: Sequence[ResidualDiagnostic], explanation: Explanation, base: Explanation
) -> list[ResidualDiagnostic]:
    """Diagnostics with their sizes as shares of the base model's error, not of the noise."""
    ratio = min(explanation.encoder_sigma / base.fit.rmse, 1.0)
    return [replace(item, size=item.size * ratio) for item in left]
