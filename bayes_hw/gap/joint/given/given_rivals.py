"""Explanations in place of the one found around a given model: which is better shows at their ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, highest
from bayes_hw.gap.joint.given.base_starts import with_base_anew
from bayes_hw.gap.joint.given.free_shape import free_shape
from bayes_hw.gap.joint.given.given_moves import (
    forms_of,
    further_modes,
    later,
    with_further_forms,
    with_signals,
)
from bayes_hw.gap.joint.given.given_response import DELAY, MODE, GivenFit
from bayes_hw.gap.joint.noise.slow_noise import WALK, WIND
from bayes_hw.gap.joint.search.beginning import FOLLOWED_SHARE
from bayes_hw.gap.joint.search.effect_moves import effect_candidates
from bayes_hw.gap.joint.search.hidden_zone import likelier_cause
from bayes_hw.gap.joint.search.law_exchange import (
    EXCHANGED,
    PERIODIC,
    as_laws_of_the_demand,
    exchanges,
    laws_of,
    misread,
    more_of_the_command,
)
from bayes_hw.gap.joint.search.laws_of_states import every_law, kicked
from bayes_hw.gap.joint.search.sight import FRICTION, LAW_LEAD, named_by_sight, stands_for_friction
from bayes_hw.gap.joint.search.structural import finer
from bayes_hw.record import Record
from bayes_hw.time_budget import time_is_up

SLOW = (WIND, WALK)

MOST_LET_IN, LET_IN_WORSE = 12, 0.02
"""Times that more of the command is let in, and the share more that is left where it ends."""

SHAPE_LEAD = 50.0
"""Nats by which a function of position must lead to end a search."""


def instead_of(
    fit: GivenFit,
    base: GivenFit,
    nats: Mapping[str, float],
    rivals: Mapping[str, float],
    alone: Mapping[str, GivenFit],
) -> dict[str, GivenFit]:
    """The explanation and those that have another label in place of its strongest: what has no name, by every
    form and an error of the reading over position included, and labels that alone did nearly as well.

    Where no effect was found, or only noise of a cause: such an error of the reading if it explains all, else
    none. A label's laws that look at the states of G, and steps within the sample, are what the explanation
    itself was given: where it left white noise, or noise of the first order, they were begun for no other.
    Beside white noise none has more to explain, unless a law explains it that itself looks at those states:
    such a law bends to much. As far as there is time.
    """
    effects = [label for label in nats if label not in SLOW]
    if not effects:
        shape = shape_beyond(base, highest([base, fit]))
        return {} if shape is None else {OTHER: shape}
    if time_is_up():
        return {}
    strongest = max(effects, key=lambda label: nats[label])
    most = max(rivals.values(), default=0.0)
    near = {label for label, own in rivals.items() if own > FOLLOWED_SHARE * most}
    found = {strongest: fit}
    bends = fit.noise_order == 1 or any(e.looks_at_states for e in fit.values.effects)
    rest = fit.without(strongest).descended()
    for label in sorted((near | {OTHER}) - set(fit.labels) - set(SLOW)):
        end = alone.get(label)
        if rest.labels or end is None or not seen_alike(end, fit):
            trials = _of_label(rest, label)
        else:
            trials = [end, *every_law(rest, forms_of(label))] if bends else [end]
        if trials:
            found[label] = with_base_anew(finer(highest(trials)))
    may_be_other = fit.effect_labels[-1:] == (strongest,) and not time_is_up()
    for one in [*_exchanged(fit), *_led_to_the_demand(fit), *misread(fit)] if may_be_other else ():
        label = one.effect_labels[-1]
        found[label] = highest([one, found.get(label, one)])
    found |= _exchanged_back(found, strongest)
    if time_is_up():
        return found if len(found) > 1 else {}
    if strongest == OTHER and not _is_begun_anywhere(fit):
        found[OTHER] = highest([fit, *_of_label(rest, OTHER)])
    shape = highest([free_shape(one) for one in ([rest, base] if rest.labels else [base])])
    if OTHER not in found or shape.score > found[OTHER].score:
        found[OTHER] = shape
    return found if len(found) > 1 or found[strongest] is not fit else {}


def plainly_named(
    ends: Mapping[str, GivenFit], rivals: Mapping[str, float], base: GivenFit
) -> tuple[dict[str, GivenFit], dict[str, float]]:
    """Ends, and what they and other rivals explain, without those that are friction under another name, where
    friction itself explains nearly as much: through free ports they are one curve, and what it looks at tells
    which."""
    found, nats = dict(ends), {**rivals} | {label: end.score - base.score for label, end in ends.items()}
    if FRICTION not in ends:
        return found, nats
    for label, end in ends.items():
        if label != FRICTION and stands_for_friction(end, nats[label], nats[FRICTION], ends[FRICTION]):
            del found[label]
            del nats[label]
    return found, nats


def likelier(fit: GivenFit, base: GivenFit, whole: Sequence[Record]) -> tuple[GivenFit, dict[str, float]]:
    """An explanation by noise of a cause with the likelier of the two, and where no effect stands beside it
    the nats that either is worth: by its exact likelihood, and by what of the `whole` records lies inside the
    dead zone, where no torque shows."""
    found, lead, caused = likelier_cause(fit, whole)
    if found.effect_labels:
        return found, {}
    own = found.score - base.score
    return found, {one.added[-1]: own - (0.0 if one is found else lead) for one in caused}


def _exchanged_back(found: Mapping[str, GivenFit], strongest: str) -> dict[str, GivenFit]:
    """Where another label does better than the `strongest` did, that one and others begun over the motion
    which its law has found, as far as that leads further."""
    leading = max(found, key=lambda label: found[label].score)
    if leading == strongest or found[leading].effect_labels[-1:] != (leading,) or time_is_up():
        return {}
    better: dict[str, GivenFit] = {}
    for one in _exchanged(found[leading]):
        label = one.effect_labels[-1]
        if label in found:
            better[label] = highest([better.get(label, found[label]), one])
    return better


def _exchanged(fit: GivenFit) -> list[GivenFit]:
    """The explanation with its last law exchanged for one of another name that gives nearly the same torque,
    of every kind the most alike, each to its end under white noise: a gap of the drive's torque, one of its
    spring and a friction are one curve over different signals, and a descent from afar finds but one of them.
    """
    begun: dict[str, GivenFit] = {}
    last = len(fit.values.effects) - 1
    for one in exchanges(fit, last, EXCHANGED) if last in laws_of(fit) else ():
        named = named_by_sight(one)
        effect = named.values.effects[-1]
        if named.effect_labels[-1] not in fit.labels and effect.is_own_law:
            begun.setdefault(effect.form.kind, named)
    ended = [kicked(one.descended_under(0, FULL_STEPS)) for one in begun.values()]
    return [named_by_sight(one.descended()) for one in ended]


def _led_to_the_demand(fit: GivenFit) -> list[GivenFit]:
    """The explanation with its last law exchanged for one of what the loop asks for, where that explains
    clearly more: the command is let in bit by bit, since from afar descents seldom arrive. By states alone
    any law is one of the demand too, so that nearly as much is no sign of one."""
    last = len(fit.values.effects) - 1
    begun = as_laws_of_the_demand(fit, last) if last in laws_of(fit) else []
    begun = [one for one in begun if one.effect_labels[-1] not in fit.labels]
    ended = [kicked(_command_let_in(one)).descended() for one in begun]
    return [one for one in ended if one.score > fit.score + LAW_LEAD]


def _command_let_in(begun: GivenFit) -> GivenFit:
    """What leaves the least under white noise while more of the command is let in."""
    best = fit = begun.descended_under(0, FULL_STEPS)
    for _ in range(MOST_LET_IN):
        if time_is_up() or fit.point.rms > (1 + LET_IN_WORSE) * best.point.rms:
            break
        fit = more_of_the_command(fit).descended_under(0, FULL_STEPS)
        best = min(best, fit, key=lambda one: one.point.rms)
    return best


def shape_beyond(base: GivenFit, best: GivenFit) -> GivenFit | None:
    """An error of the reading over position if it explains everything, and far more than `best` does: then
    nothing more is to be sought. None else, and where the base leaves white noise: nothing is to be explained
    there."""
    if base.noise_order <= 1 and best is base:
        return None
    shape = free_shape(base)
    return shape if shape.point.whitener.order <= 1 and leads(shape, best) else None


def leads(shape: GivenFit, best: GivenFit) -> bool:
    """Whether a shape without a name explains far more than `best` does."""
    return shape.score > best.score + SHAPE_LEAD


def _is_begun_anywhere(fit: GivenFit) -> bool:
    """Whether its law without a name is of those that `every_law` begins with all others."""
    forms = [e.form for e in fit.values.effects if e.form.label == OTHER]
    return all(form.is_law and form.law not in PERIODIC for form in forms)


def seen_alike(one: GivenFit, other: GivenFit) -> bool:
    """Whether both explain the same samples under the same weights."""
    return one.response.records is other.response.records and one.response.weights is other.response.weights


def _of_label(fit: GivenFit, label: str) -> list[GivenFit]:
    """The best explanations with this label more."""
    forms = forms_of(label)
    found = effect_candidates(fit, forms)
    found += with_further_forms(found) + with_signals(found) + every_law(fit, forms)
    if label == DELAY:
        found += later(fit)
    if label == MODE:
        found += further_modes(fit)
    return found
