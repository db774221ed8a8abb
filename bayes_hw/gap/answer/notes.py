"""What a reader should know beside the verdict."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.repeats import repeats
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.criticism.left_out import LeftOut
from bayes_hw.gap.effects.words import label_words, parameter_words
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.phrases import with_article

CLEAR_ERRORS = 3.0
"""Standard errors by which another answer must predict left-out blocks better to be spoken of."""

SAME_COST_FACTOR, SAME_COST = 1.02, 2.0
"""Of the cost of a base fit: another start that comes so close has found the same."""

CUT_SHORT = (
    "the search had no time left to look further and answers with what it had by then: other explanations "
    "may be missing; --within gives it more"
)


def starts_disagree(attribution: Attribution) -> bool:
    """Whether no other start of the base model came near the best fit."""
    best, *others = attribution.base_costs
    return bool(others) and min(others) >= best * SAME_COST_FACTOR + SAME_COST


def notes_on(
    case: Case | SimulatorCase,
    attribution: Attribution,
    decision: Decision,
    left_out: Mapping[tuple[str, ...], LeftOut],
) -> list[str]:
    """What a reader should know beside the verdict."""
    notes = [*attribution.base.fit.hypothesis.builder.said_of_torques]
    if attribution.cut_short:
        notes.append(CUT_SHORT)
    if starts_disagree(attribution):
        notes.append(
            "only one start of the base model reached its best fit; another minimum may lie elsewhere"
        )
    repeated = repeats(case.train)
    if repeated is not None:
        whose = "had a periodic command" if repeated.periods else "had the same command"
        notes.append(
            f"{', '.join(repeated.names)} {whose}: {repeated.floor:.3g} "
            f"{case.model.units.output} rms does not repeat, of an error of {attribution.base.fit.rmse:.3g} "
            "of the simulator; the noise floor is taken to be no higher"
        )
    if decision.explanation.chaotic_response and decision.answer != (OTHER,):
        notes.append(_of_chaotic_response(decision.explanation, case.model.units.output))
    if decision.answer == (OTHER,):
        notes.append(
            "no model here holds: base parameters are given about the best explanation that failed, as far "
            "off as those lie apart"
        )
        notes += of_the_unheard_of(decision.explanation)
    else:
        notes += of_left_out(decision.explanation.labels, left_out)
    return notes


def of_the_unheard_of(explanation: Explanation) -> list[str]:
    """What the best explanation would need that no effect of its kind has."""
    found = []
    for parameter, value in zip(explanation.fit.hypothesis.parameters, explanation.fit.values, strict=True):
        if parameter.name in explanation.unheard_of:
            label = label_words(parameter.name.partition(".")[0])
            needed = with_article(parameter_words(parameter.name))
            amount = f"{value:.3g} {parameter.unit}".rstrip()
            found.append(f"{label} would need {needed} of {amount}, beyond what any has")
    return found


def of_left_out(chosen: tuple[str, ...], left_out: Mapping[tuple[str, ...], LeftOut]) -> list[str]:
    """That left-out blocks speak for another set of labels, where they clearly do."""
    own = left_out.get(chosen)
    if own is None or own.density >= -CLEAR_ERRORS * own.error:
        return []
    best = max(left_out, key=lambda labels: left_out[labels].density)
    return [
        f"blocks of the records left out are predicted better by {' and '.join(best) or 'no effect'}, by "
        f"{-own.density:.0f} ± {own.error:.0f} in log-density; the answer goes by the evidence of all"
    ]


def _of_chaotic_response(explanation: Explanation, unit: str) -> str:
    label = next(effect.label for effect in explanation.fit.hypothesis.effects if effect.rugged)
    square = np.mean(np.concatenate(explanation.fit.free_residuals) ** 2)
    lost = np.sqrt(max(float(square) - explanation.encoder_sigma**2, 0.0))
    return (
        f"the motion of this form of {label} is chaotic: {lost:.3g} {unit} rms of it cannot be predicted, "
        "which no better numbers would remove; structure in what is left is laid to that"
    )
