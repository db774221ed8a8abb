"""The verdict in words."""

from __future__ import annotations

import math
from typing import Protocol

from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.notes import of_the_unheard_of, starts_disagree
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate, Verdict
from bayes_hw.gap.answer.words_of_answer import disagreement
from bayes_hw.gap.effects.catalogue import block_of
from bayes_hw.gap.effects.words import BLOCK_WORDS, is_said, label_words, parameter_words
from bayes_hw.gap.search.attribute import Attribution

MOST_AMOUNTS = 2
"""Parameters of one effect that the sentence tells."""

EXACT = 1e-5
"""Of a value: a smaller standard deviation is not told."""

DOUBT = (
    "In doubt: of several starts of the fit only one reached its best place, a better one may lie elsewhere, "
    "and all that follows rests on it. "
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
    that it is all in doubt, where starts of the base model or the records held out disagree."""
    doubt = DOUBT * starts_disagree(diagnosis.attribution) + disagreement(diagnosis.verdict)
    return doubt + _of_the_gap(diagnosis)


def _of_the_gap(diagnosis: Answered) -> str:
    verdict = diagnosis.verdict
    gap = verdict.gap_holdout
    size = (max(gap.rmse_before**2 - gap.noise_floor**2, 0.0)) ** 0.5 / gap.noise_floor
    if not verdict.answer:
        sure = verdict.probability["none"]
        return (
            "Nothing is missing from the model that these records show: with its numbers estimated again, "
            f"what is left is noise ({_percent(sure)} sure)."
        )
    differ = f"Model and records differ by {size:.2g} times the noise"
    if verdict.answer == ("other",):
        left = diagnosis.decision.leftovers[0]
        best = " and ".join(map(label_words, diagnosis.decision.explanation.labels))
        beside = f"beside the best of them ({best})" if best else "without any of them"
        why = "; ".join(of_the_unheard_of(diagnosis.decision.explanation))
        why = why or f"what stays {beside} is {left.size:.2g} times the noise ({left.kind})"
        return (
            f"{differ} and none of the known effects explains it "
            f"({_percent(verdict.probability['other'])} sure): {why}. {_entrance(diagnosis)}"
        )
    explanation = diagnosis.decision.explanation
    effects = explanation.fit.hypothesis.effects
    parts = []
    for label in verdict.answer:
        where = BLOCK_WORDS[block_of(label, effects)]
        parts.append(f"{label_words(label)} {where} ({_percent(verdict.probability[label])} sure)")
    named = "it" if len(verdict.answer) == 1 else "them"
    said = f"{differ}; what the model lacks is {' and '.join(parts)}"
    return f"{said}{_amounts(verdict)}. {consequence(gap, named, bool(effects))}"


def _amounts(verdict: Verdict) -> str:
    """The first parameters of each label, in words."""
    said: list[str] = []
    for label in verdict.answer:
        own = [
            (name, estimate)
            for name, estimate in verdict.parameters.items()
            if name.partition(".")[0] == label and is_said(name)
        ]
        said += [f"{parameter_words(name)} {_amount(estimate)}" for name, estimate in own[:MOST_AMOUNTS]]
    return f": {'; '.join(said)}" if said else ""


def _entrance(diagnosis: Answered) -> str:
    """Where a cause without a name enters."""
    block, best = diagnosis.verdict.where.block, diagnosis.decision.explanation
    found = f"It acts {BLOCK_WORDS[block]} ({_percent(diagnosis.verdict.where.share[block])} sure)"
    named = {block_of(label, best.fit.hypothesis.effects) for label in best.labels}
    others = " and ".join(map(label_words, best.labels))
    return f"{found}, where {others} does not." if named and block not in named else f"{found}."


def consequence(gap: Closure, named: str, tracked: bool) -> str:
    """What adding the effects, `named` so, does. Unless a response is `tracked`, they are random, and only
    what is expected of the records changes."""
    low, high = gap.closed_hdi94
    if tracked:
        return (
            f"With {named} in the model, {_share(gap.closed)} % [{_share(low)}, {_share(high)}] of the "
            "avoidable error on the record held out is gone."
        )
    return (
        f"No simulation follows {named}: what knowing of {named} improves is the band and the model's own "
        f"numbers, by which {_share(gap.closed)} % [{_share(low)}, {_share(high)}] of the avoidable error on "
        "the record held out are gone."
    )


def _percent(probability: float) -> str:
    return f"{100 * probability:.3g} %"


def _amount(estimate: Estimate) -> str:
    """Mean and standard deviation, both to the place of the deviation's first digit."""
    unit = f" {estimate.unit}" if estimate.unit else ""
    if not estimate.sd > 0 or not math.isfinite(estimate.sd):
        return f"{estimate.mean:.3g}{unit}"
    if estimate.sd < EXACT * abs(estimate.mean):
        return f"{estimate.mean:.5g}{unit}"
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
