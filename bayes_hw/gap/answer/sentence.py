"""The verdict in words."""

from __future__ import annotations

import math
from typing import Protocol

from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.notes import starts_disagree
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate, Verdict
from bayes_hw.gap.effects.catalogue import block_of
from bayes_hw.gap.search.attribute import Attribution

DOUBT = (
    "Starts of the base model disagree: only one reached its best fit, another may lie elsewhere, and all "
    "that follows rests on it. "
)


class Answered(Protocol):
    """The parts of a diagnosis that its sentence tells."""

    @property
    def attribution(self) -> Attribution: ...

    @property
    def decision(self) -> Decision: ...

    @property
    def verdict(self) -> Verdict: ...


def sentence(diagnosis: Answered) -> str:
    """One or two sentences: how large the gap is, what it is and how sure, how far it shrinks; before them,
    that it is all in doubt, where starts of the base model disagree."""
    return DOUBT * starts_disagree(diagnosis.attribution) + _of_the_gap(diagnosis)


def _of_the_gap(diagnosis: Answered) -> str:
    verdict = diagnosis.verdict
    gap = verdict.gap_holdout
    size = (max(gap.rmse_before**2 - gap.noise_floor**2, 0.0)) ** 0.5 / gap.noise_floor
    if not verdict.answer:
        sure = verdict.probability["none"]
        return (
            "No structural gap: the re-estimated model and coloured noise explain the records "
            f"({_percent(sure)} sure)."
        )
    if verdict.answer == ("other",):
        left = diagnosis.decision.leftovers[0]
        best = diagnosis.decision.explanation.name
        return (
            f"The gap is {size:.2g} times the noise and no entry of the catalogue explains it "
            f"({_percent(verdict.probability['other'])} sure): what stays beside the best of them ({best}) "
            f"is {left.size:.2g} times the noise ({left.kind}). {_entrance(diagnosis)}"
        )
    explanation = diagnosis.decision.explanation
    effects = explanation.fit.hypothesis.effects
    parts = []
    for label in verdict.answer:
        certain = _percent(verdict.probability[label])
        parts.append(f"{certain} sure it is {label} in the block {block_of(label, effects)}")
    found = ", ".join(f"{name} {_amount(e)}" for name, e in verdict.parameters.items())
    named = "it" if len(verdict.answer) == 1 else "them"
    gain = explanation.log_evidence - diagnosis.attribution.base.log_evidence
    return f"The gap is {size:.2g} times the noise; {' and '.join(parts)} ({found}); " + consequence(
        gap, gain, named, bool(effects)
    )


def _entrance(diagnosis: Answered) -> str:
    """Where a cause without a name enters."""
    block, best = diagnosis.verdict.where.block, diagnosis.decision.explanation
    found = f"It enters at the {block} ({_percent(diagnosis.verdict.where.share[block])} sure)"
    named = {block_of(label, best.fit.hypothesis.effects) for label in best.labels}
    return f"{found}, where {best.name} does not." if named and block not in named else f"{found}."


def consequence(gap: Closure, gain: float, named: str, tracked: bool) -> str:
    """What adding the effects, `named` so, does; `gain` is that of the log-evidence.

    Unless a response is `tracked`, the effects are random, and only what is expected of the records changes.
    """
    low, high = gap.closed_hdi94
    if tracked:
        return (
            f"adding {named} removes {_share(gap.closed)} % [{_share(low)}, {_share(high)}] of the reducible "
            "error on the record held out."
        )
    return (
        f"no simulator tracks {named}: knowing of {named} makes the training records {gain:.0f} nats "
        f"likelier, and of the reducible error on the record held out {_share(gap.closed)} % "
        f"[{_share(low)}, {_share(high)}] go with the base parameters."
    )


def _percent(probability: float) -> str:
    return f"{100 * probability:.3g} %"


def _amount(estimate: Estimate) -> str:
    """Mean and standard deviation, both to the place of the deviation's first digit."""
    unit = f" {estimate.unit}" if estimate.unit else ""
    if not estimate.sd > 0 or not math.isfinite(estimate.sd):
        return f"{estimate.mean:.3g}{unit}"
    place = math.floor(math.log10(estimate.sd))
    if -7 < place < 5:
        decimals = max(0, -place)
        return (
            f"{round(estimate.mean, -place):.{decimals}f} +- {round(estimate.sd, -place):.{decimals}f}{unit}"
        )
    scale = math.floor(math.log10(max(abs(estimate.mean), estimate.sd)))
    return f"{estimate.mean:.{max(0, scale - place)}e} +- {estimate.sd:.0e}{unit}"


def _share(fraction: float) -> str:
    """Percent that never rounds up to all of it."""
    percent = 100 * fraction
    return f"{percent:.0f}" if percent < 99 else f"{min(percent, 99.99):.4g}"
