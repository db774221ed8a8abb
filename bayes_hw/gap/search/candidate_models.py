"""Candidate models: which of the explanations found so far matter for what is tried next."""

from __future__ import annotations

from collections.abc import Sequence

from bayes_hw.gap.fit.explanation import Explanation, best_of_each

REFINED_PAIRS = 2
"""Explanations by name, and pairs by label, whose effects are tried in forms of more parameters."""

SLIGHT = 40.0
"""Log-evidence by which an effect and slow noise must be ahead of either alone before a second cause is
sought: one of a fifth of the noise is worth 70 in 3,600 samples."""

CLOSE_PART = 200.0
"""Log-evidence by which one effect alone may fall short of two and yet be fitted again: a second effect may
only make up for a fit that stopped half way."""


def with_parts(found: Sequence[Explanation]) -> list[Explanation]:
    """The best explanation, and where it is of two effects the best of each alone that comes close."""
    best, by_labels = best_of(found), close_to_the_best(found)
    parts = [by_labels.get((label,)) for label in best.labels]
    return [best, *(e for e in parts if e is not None and e is not best)]


def close_to_the_best(found: Sequence[Explanation]) -> dict[tuple[str, ...], Explanation]:
    """Of every set of labels the best explanation, where it comes close to the best of all."""
    least = best_of(found).log_evidence - CLOSE_PART
    return best_of_each((e for e in found if e.log_evidence > least), lambda e: e.labels)


def may_hide_a_cause(found: Sequence[Explanation]) -> bool:
    """Whether the best explanation is an effect beside slow noise, which takes up any second slow effect.

    Effect and noise must both be worth a label: slow noise that adds little to the effect hides nothing.
    """
    best = best_of(found)
    parts = [e for e in found if set(e.labels) < set(best.labels)]
    return hides(best) and all(best.log_evidence > e.log_evidence + SLIGHT for e in parts)


def hides(explanation: Explanation) -> bool:
    cause = explanation.cause_of_noise
    return cause is not None and cause.drifts and bool(explanation.fit.hypothesis.effects)


def is_coloured(explanation: Explanation) -> bool:
    return explanation.stochastic is None


def worth_refining(found: Sequence[Explanation]) -> list[Explanation]:
    """The best by name, and the best by labels of two effects that can be followed."""
    named = list(best_of_each(found, lambda e: e.name).values())[:REFINED_PAIRS]
    followed = (e for e in found if e.stochastic is None and len(e.labels) == 2)
    pairs = list(best_of_each(followed, lambda e: e.labels).values())[:REFINED_PAIRS]
    return named + [e for e in pairs if not any(e is other for other in named)]


def leaders(singles: Sequence[Explanation]) -> list[Explanation]:
    """The best of every label, best first."""
    return list(best_of_each(singles, lambda e: e.labels).values())


def later(found: Sequence[Explanation], first: Sequence[Explanation]) -> list[Explanation]:
    """The best single response of every name that was found after `first`, best first."""
    known = {e.name for e in first}
    later = (e for e in found if e.stochastic is None and len(e.labels) == 1 and e.name not in known)
    return list(best_of_each(later, lambda e: e.name).values())


def best_of(found: Sequence[Explanation]) -> Explanation:
    """The explanation of most evidence; where records are rounded, which is a fact, of those that round."""
    return min([e for e in found if e.rounded] or found, key=worst_first)


def worst_first(explanation: Explanation) -> float:
    return -explanation.log_evidence
