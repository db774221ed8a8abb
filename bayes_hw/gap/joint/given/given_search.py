"""The search for effects around a given model: its base parameters are free, its structure is kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.forms.drive_forms import GIVEN_FORMS, UNNAMED_OVER_POSITION
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.given.base_starts import with_base_anew
from bayes_hw.gap.joint.given.clear_of_zone import on_records
from bayes_hw.gap.joint.given.given_base import base_and_readings, reweighted
from bayes_hw.gap.joint.given.given_moves import (
    best_of_labels,
    both_over_position,
    further_modes,
    later,
    modes_beside,
    other_laws,
    pruned,
    something_is_left,
    with_further_forms,
    with_signals,
)
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_rivals import instead_of, leads, likelier, plainly_named, shape_beyond
from bayes_hw.gap.joint.given.given_trail import Trail
from bayes_hw.gap.joint.given.given_verification import is_doubtful, verified
from bayes_hw.gap.joint.given.second_labels import beside_each, both_instead, second_to
from bayes_hw.gap.joint.given.settled import settled
from bayes_hw.gap.joint.residuals.readings import Readings, read_again
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.search.beginning import CONTEST_SHARE
from bayes_hw.gap.joint.search.effect_moves import effect_candidates, port_candidates, slow_causes
from bayes_hw.gap.joint.search.hidden_zone import LEFT_OUT
from bayes_hw.gap.joint.search.joint_search import HALFWAY, MOST_EFFECTS, SEARCHED, JointAnswer, silent
from bayes_hw.gap.joint.search.laws_of_states import every_law
from bayes_hw.gap.joint.search.period_anew import periodic_by_promise, with_period_anew
from bayes_hw.gap.joint.search.structural import explained_slowly, finer
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS, asked_over
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.phrases import log_evidence
from bayes_hw.record import Record
from bayes_hw.time_budget import at_most, seconds_left, time_is_up

MOST_STEPS = 5
RIVALS, EXCHANGES = 4, 2
LEADING = 3
"""Explanations beside wind or a walk that are tried without it: they may explain what was slow."""

OF_RIVALS = 0.6
"""Of the time left after verification, that looking for rivals may take."""


def search_given(
    records: Sequence[Record], model: HammersteinWiener, say: Callable[[str], None] | None = None
) -> JointAnswer:
    """Base, effects one after the other, pruned and verified, then other labels in place of the strongest.

    Looking further and rivals have shares of the time that a block around leaves (`at_most`), so that what
    was found by then is verified. Raises InputError where G has no ports.
    """
    told = say or silent
    base, readings = base_and_readings(records, model)
    told(f"without effects: {described(base)}")
    with at_most(SEARCHED * seconds_left()):
        trail = _extended(base, readings, told)
        cut_short = time_is_up()
    base, fit, readings = read_again(trail.base, trail.fit, trail.readings, reweighted)
    fit, nats = verified(fit, base, readings, told)
    with at_most(OF_RIVALS * seconds_left()):
        ends = instead_of(fit, base, nats, trail.rivals, trail.alone)
        two = both_instead(fit, ends, base, readings, trail.alone)
        if two is not None:
            told(f"both in its place: {described(two)}")
            fit, nats = verified(two, base, readings, told)
            ends = instead_of(fit, base, nats, trail.rivals, trail.alone)
        cut_short = cut_short or time_is_up()
    followed, (ends, rivals) = ends, plainly_named(ends, trail.rivals, base)
    best = max(ends, key=lambda label: ends[label].score, default=None)
    if best is not None and (ends[best].score > fit.score or len(ends) < len(followed)):
        fit = ends[best]
        told(f"in its place: {described(fit)}")
        if fit.response.records is base.response.records:
            fit, nats = verified(fit, base, readings, told)
        else:
            nats = {**{label: n for label, n in nats.items() if label in fit.labels}, OTHER: rivals[OTHER]}
    left, ends = remainder_of(fit), ends if nats else {}
    return JointAnswer(fit, base, nats, rivals, readings, left, ends=ends, cut_short=cut_short)


def described(fit: GivenFit) -> str:
    """One line on a fit."""
    names = " + ".join(fit.names) or "no effect"
    return f"{names}; noise of order {fit.point.whitener.order}, residual {fit.point.rms:.3g}"


def _extended(base: GivenFit, readings: Readings, say: Callable[[str], None]) -> Trail:
    """Where the search ended: its fit pruned, labels exchanged.

    Noise of a cause takes up much of what an effect does, so that the first one found beside it may be wrong:
    effects are sought without it first, and beside it only where they leave noise of higher order or such
    noise alone explains as much. Where it alone explains little of what they do, it is only added to them.
    """
    slow = slow_causes(base)
    trail = _followed(base, readings, say, slow)
    trail = replace(trail, fit=pruned(trail.fit))
    alone = max((one.score for one in slow), default=-np.inf)
    more = trail.fit.noise_order > 1 or trail.fit.score < alone
    if slow and more and trail.base is trail.whole and shape_beyond(base, trail.fit) is None:
        found = trail.fit.score - base.score
        if trail.fit.labels and alone - base.score < CONTEST_SHARE * found:
            beside = highest([trail.fit, *slow_causes(trail.fit)])
            asked = asked_over(beside, trail.fit, trail.base, trail.readings)
            if beside.score > trail.fit.score + asked:
                trail = replace(trail, fit=beside)
        else:
            say("with wind or a walk:")
            caused = _followed(base, readings, say)
            caused = replace(caused, fit=pruned(caused.fit))
            if caused.fit.score >= on_records(trail.fit, caused.fit.response.records).score:
                trail = caused
    rivals = {one.labels[0]: one.score - base.score for one in slow} | dict(trail.rivals)
    fit, base = with_period_anew(exchanged(trail.fit, rivals, say)), trail.base
    if fit.response.cause is not None:
        fit, causes = likelier(fit, base, trail.whole.response.records)
        rivals |= causes
    elif base.response.records is not trail.whole.response.records:
        base, fit = (on_records(one, trail.whole.response.records) for one in (base, fit))
        fit = _with_what_only_all_show(fit)
    return replace(trail, fit=fit, base=base, rivals=rivals)


def _with_what_only_all_show(fit: GivenFit) -> GivenFit:
    """With one more label where an explanation that was found clear of the dead zone leaves noise of higher
    order of all samples: there are more of them, and steps of a slow error at the zone's edges."""
    if fit.noise_order <= 1 or not 0 < len(set(fit.labels)) < MOST_EFFECTS:
        return fit
    return pruned(highest([fit, *(explained_slowly(t) for t in effect_candidates(fit, FORMS))]))


def _trials(begun: GivenFit, others: Sequence[GivenFit]) -> list[GivenFit]:
    """The best explanations with one label more, or with other ports and forms of those present where these
    were not tried already (`settled`)."""
    trials: list[GivenFit] = []
    if begun.noise_order <= 1:
        trials += [t.descended() for t in port_candidates(begun)]
    if len(set(begun.labels)) < MOST_EFFECTS:
        trials += _one_more(begun, others)
    if begun.response.cause is not None and trials:
        trials += [t.with_cause(None).descended() for t in best_of_labels(trials)[:LEADING]]
    return trials


def _one_more(begun: GivenFit, others: Sequence[GivenFit]) -> list[GivenFit]:
    """The best explanations with one label more, as far as there is time.

    The label found first may stand in for two, or have gone where a second one should be: where it leaves
    noise of higher order, one more is sought beside each of `others` too. Where one of all these leaves noise
    that is white or of the first order, no law is begun that looks at the states of G, nor a label with a
    mode at once: there is nothing more to be found. Nor is such a law begun beside a label where none of them
    gains what a start must.
    """
    found = effect_candidates(begun, FORMS)
    moves: tuple[Callable[[], list[GivenFit]], ...] = (
        lambda: effect_candidates(begun, UNNAMED_OVER_POSITION),
        lambda: with_further_forms(found) + with_signals(found),
        lambda: further_modes(begun) + later(begun),
        lambda: periodic_by_promise(begun) if begun.labels and something_is_left(begun, found) else [],
        lambda: beside_each(others) if something_is_left(begun, []) else [],
        lambda: every_law(begun) if something_is_left(begun, found) and _one_pays(found, begun) else [],
        lambda: other_laws(highest(found)) if found else [],
        lambda: modes_beside(found) if not begun.labels and something_is_left(begun, found) else [],
    )
    for move in moves:
        if not time_is_up():
            found += move()
    return found


def _one_pays(found: Sequence[GivenFit], begun: GivenFit) -> bool:
    """Whether a label more gains so much that a law of its own may come to what verification asks."""
    return not begun.labels or any(
        t.score >= begun.score + HALFWAY * VERIFIED_NATS for t in found if len(t.labels) > len(begun.labels)
    )


def _followed(
    base: GivenFit,
    readings: Readings,
    say: Callable[[str], None],
    instead: Sequence[GivenFit] | None = None,
) -> Trail:
    """One label after the other while the score improves. Noise has a cause beside them, unless causes that
    the base may have `instead` of any effect are given: then only where one explains more than the first
    label clear of the dead zone, or there beside it more than noise without a name. All begins again there
    where the first is so, or where noise of a cause is best; where the second is so, it goes on there.
    """
    trail = Trail.begun(base, readings, caused=instead is None)
    carried: list[GivenFit] = []
    steps = 0
    while steps < MOST_STEPS and not time_is_up():
        steps += 1
        trail, slow = trail.with_slow_causes(say)
        fit = trail.fit
        start = highest([fit, *slow])
        others = second_to(start, trail.base, trail.alone) if len(set(fit.labels)) == 1 else []
        trials = [*_trials(start, others), *slow, *carried]
        carried = []
        if not trials:
            break
        trail = trail.knowing(trials)
        best = settled(with_base_anew(explained_slowly(finer(highest(trials)))))
        shape = shape_beyond(trail.base, highest([fit, best])) if trail.is_bare else None
        if shape is not None:
            best = highest([fit, best, *both_over_position(fit)])
            if leads(shape, best):
                say("a function of position explains far more")
                return replace(trail, fit=best)
        doubtful = is_doubtful(best, fit, trail.base, trail.readings)
        if best.score <= fit.score or (doubtful and fit.labels):
            break
        say(f"{log_evidence(best.score - fit.score)}: {described(best)}")
        clear = trail.clear_of_zone(best, instead)
        if clear is not None:
            say(LEFT_OUT)
            carried = [on_records(best, clear.records)] if best.response.cause is not None else []
            trail, steps = clear, 0
            continue
        trail, read_anew = replace(trail, fit=best).with_faults()
        if (doubtful or best is start) and not read_anew:
            break
    return trail


def exchanged(fit: GivenFit, rivals: Mapping[str, float], say: Callable[[str], None]) -> GivenFit:
    """One label of several taken for another while the score improves: the one taken first may have stood in
    for it. Others are what G itself and the noise may have and the labels that did best alone."""
    near = sorted(rivals, key=lambda label: -rivals[label])[:RIVALS]
    for _ in range(EXCHANGES):
        if len(set(fit.labels)) < 2 or time_is_up():
            return fit
        trials: list[GivenFit] = []
        for label in dict.fromkeys(fit.labels):
            rest = fit.without(label).descended()
            forms = [f for f in GIVEN_FORMS if f.label in near and f.label not in (label, *rest.labels)]
            found = effect_candidates(rest, forms)
            found += with_further_forms(found) + with_signals(found)
            found += later(rest) + further_modes(rest) + slow_causes(rest)
            trials += [t for t in found if label not in t.labels]
        best = pruned(highest([fit, *trials]))
        if best.score <= fit.score:
            return fit
        say(f"{log_evidence(best.score - fit.score)} by an exchange: {described(best)}")
        fit = best
    return fit
