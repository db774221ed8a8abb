"""One more label beside those that are not the best alone: the first found may stand in for two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.given.given_moves import further_modes, later, pruned, with_signals
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_rivals import SLOW, seen_alike
from bayes_hw.gap.joint.given.settled import settled
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.search.beginning import CONTEST_SHARE
from bayes_hw.gap.joint.search.effect_moves import effect_candidates
from bayes_hw.gap.joint.search.structural import explained_slowly
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS, asked_over

SECONDS, SECONDS_FINISHED = 3, 2
"""Labels beside which one more is sought though another explains more alone; of all these pairs, those that
go on to their ends."""


def beside_each(others: Sequence[GivenFit]) -> list[GivenFit]:
    """The best explanations with one label more than any of these, the best of all to their ends."""
    found = [t for one in others for t in (*effect_candidates(one, FORMS), *further_modes(one), *later(one))]
    found.sort(key=lambda t: -t.score)
    leading = found[:SECONDS_FINISHED]
    return found + [explained_slowly(t) for t in leading + with_signals(leading)]


def second_to(fit: GivenFit, base: GivenFit, alone: Mapping[str, GivenFit]) -> list[GivenFit]:
    """Of what labels alone reached, the best few that are not of the fit's label or of slow noise, and that
    earn a share of what the fit's does: what makes up half of a pair explains some of the records alone."""
    least = CONTEST_SHARE * (fit.score - base.score)
    found = [
        one
        for label, one in alone.items()
        if label not in (*fit.labels, *SLOW) and seen_alike(one, fit) and one.score - base.score >= least
    ]
    return sorted(found, key=lambda one: -one.score)[:SECONDS]


def both_instead(
    fit: GivenFit,
    ends: Mapping[str, GivenFit],
    base: GivenFit,
    readings: Readings,
    alone: Mapping[str, GivenFit],
) -> GivenFit | None:
    """An explanation by two labels where several explain the records alike, each of which may stand in for
    both, so that none of them is a half; None where one label is told from the others, or two are not worth
    what they must be."""
    alike = {label for label, end in ends.items() if end.score > fit.score - VERIFIED_NATS}
    if len(set(fit.labels)) != 1 or len(alike) < 2:
        return None
    halves = {label: one for label, one in alone.items() if label not in alike}
    found = beside_each(second_to(fit, base, halves))
    if not found:
        return None
    best = pruned(settled(highest(found)))
    enough = len(set(best.labels)) == 2 and best.score > fit.score + asked_over(best, fit, base, readings)
    return best if enough else None
