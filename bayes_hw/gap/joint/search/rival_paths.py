"""Explanations by different labels held against each other: what one has found, the others begin with."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from bayes_hw.crew import each
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import JointFit, highest
from bayes_hw.gap.joint.fit.structure_moves import pruned
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.search.bent_spring import as_it_bends
from bayes_hw.gap.joint.search.effect_moves import effect_candidates
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.law_exchange import begun_in_its_place, exchanged, misread
from bayes_hw.gap.joint.search.sight import FRICTION, is_hidden_friction, named_by_sight, stands_for_friction
from bayes_hw.gap.joint.search.structural import STRUCTURAL_NATS, structural, within_sample
from bayes_hw.phrases import log_evidence

MOST_STEPS = 10
NEAR = 0.5
"""Of what several labels gain, from which one that begins alone is followed."""

MOST_EXCHANGES = 2
"""Laws or labels of one explanation that are exchanged for others, one after another."""

LARGE_ORDER = 8
"""Of G, above which it is pruned before its effect is given what it asks for."""


def described(fit: JointFit) -> str:
    """One line on a fit."""
    names = " + ".join(fit.names) or "no effect"
    if fit.response.steps > 1:
        names += f" in {fit.response.steps} steps a sample"
    order, noise = fit.structure.order, fit.noise_order
    heavy = " with heavy tails" if fit.has_heavy_tails else ""
    return f"{names}; G of order {order}, delay {fit.structure.delay_samples}, noise of order {noise}{heavy}"


def is_simulated(fit: JointFit) -> bool:
    """Whether a simulation follows the motion, and leaves nothing that follows itself for long."""
    return fit.observer is None and fit.noise_order <= 1


def with_what_it_asks(fit: JointFit, without: JointFit, say: Callable[[str], None]) -> JointFit:
    """With the ports, forms and poles that pay; `without` is what it is said to lead over."""
    say(f"{log_evidence(fit.score - without.score)}, one of several: {described(fit)}")
    if fit.structure.order > LARGE_ORDER:
        # A G that grew to stand in for the effect is in its way.
        fit = pruned(fit)
    for _ in range(MOST_STEPS):
        larger = structural(fit)
        if larger.score < fit.score + STRUCTURAL_NATS:
            break
        fit = larger
        say(f"{log_evidence(fit.score - without.score)}, one of several: {described(fit)}")
    return fit


def begun_anew(paths: Sequence[FollowedPath], told: Callable[[str], None]) -> list[FollowedPath]:
    """The best path of every label, also of those whose label is begun anew over the G that the best of all
    ended with; again where one that is begun anew becomes the best.

    A law that began over a G without any leads G where it stands in for what the law leaves; the G of another
    explanation, which left nothing, is nearer to the axis.
    """
    present = list(paths)
    for _ in range(len(paths)):
        best = max(present, key=lambda path: path.gained)
        if best.begun_with not in best.fit.effect_labels or not is_simulated(best.fit):
            break
        anew = each(partial(_over_the_g_of, best, best.fit.without(best.begun_with), told), present)
        present = best_of_each_label([*present, *filter(None, anew)])
        if max(present, key=lambda path: path.gained) is best:
            break
    return present


def _over_the_g_of(
    best: FollowedPath, beside: JointFit, told: Callable[[str], None], path: FollowedPath
) -> FollowedPath | None:
    """The label of a path begun `beside` what is left of `best` without its own, where that is better than
    the path: by every form on its own, since over a G that is right the one that is right shows at once. What
    its law looks at there may give it another name."""
    if path is best or path.begun_with not in path.fit.effect_labels:
        return None
    trial = begun_over(beside, path.begun_with)
    if trial is None:
        return None
    fit = _with_all_it_asks(trial, best.base, told)
    if fit.log_likelihood - best.base.score <= path.gained:
        # Pruning saves no more than the price of all there is.
        return None
    fit = as_seen(pruned(fit))
    other = replace(best, fit=fit.led_by(path.begun_with))
    if other.gained <= path.gained:
        return None
    told(f"{log_evidence(other.gained)} begun anew: {described(fit)}")
    return other


def begun_over(beside: JointFit, label: str) -> JointFit | None:
    """A label begun beside a fit by every form on its own, the best of them; None where no form begins."""
    forms = [form for form in FORMS if form.label == label and not form.further]
    begun = [one for form in forms for one in effect_candidates(beside, [form])[:1]]
    return highest([within_sample(one) for one in begun]) if begun else None


def each_alone(path: FollowedPath, told: Callable[[str], None]) -> list[JointFit]:
    """Every label of an explanation by several alone, begun over the G that they ended with, where they leave
    nothing that follows itself: another form of one of them may need none beside it."""
    labels = list(dict.fromkeys(path.fit.effect_labels))
    if len(labels) < 2 or not is_simulated(path.fit):
        return []
    bare = path.fit.without_labels()
    begun = [one for one in each(partial(begun_over, bare), labels) if one is not None]
    near = [one for one in begun if one.score - path.base.score > NEAR * path.gained]
    alone = each(lambda one: as_seen(pruned(_with_all_it_asks(one, path.base, told))), near)
    for one in alone:
        told(f"{log_evidence(one.score - path.base.score)} alone: {described(one)}")
    return alone


def with_labels_exchanged(
    path: FollowedPath, told: Callable[[str], None]
) -> tuple[FollowedPath, dict[str, dict[str, float]]]:
    """The path where each label of an explanation by several has no better one in its place, and by how many
    nats it leads with another named label in the place of one, begun over the G that they ended with."""
    for exchanges in range(MOST_EXCHANGES + 1):
        stand_ins = _stand_ins(path.fit)
        best = highest([path.fit, *(one for others in stand_ins.values() for one in others)])
        if exchanges == MOST_EXCHANGES or best.score < path.fit.score + STRUCTURAL_NATS:
            break
        fit = as_seen(pruned(_with_all_it_asks(best, path.base, told)))
        told(f"{log_evidence(fit.score - path.base.score)} by another label: {described(fit)}")
        path = replace(path, fit=fit)
    score = path.fit.score
    return path, {
        label: {one.labels[-1]: score - one.score for one in others} for label, others in stand_ins.items()
    }


def with_those_followed(
    leading: FollowedPath, paths: Sequence[FollowedPath], stand_ins: Mapping[str, Mapping[str, float]]
) -> dict[str, dict[str, float]]:
    """By how many nats an explanation by several labels leads with another one in the place of each, where
    one of the `paths` that were followed to their ends is that explanation."""
    found = {label: dict(leads) for label, leads in stand_ins.items()}
    own = set(leading.fit.labels)
    for path in paths if len(own) > 1 else ():
        theirs = set(path.fit.labels)
        if len(own - theirs) == len(theirs - own) == 1:
            (label,), (other,) = own - theirs, theirs - own
            leads = found.setdefault(label, {})
            leads[other] = min(leading.gained - path.gained, leads.get(other, np.inf))
    return found


def _stand_ins(fit: JointFit) -> dict[str, list[JointFit]]:
    """For every label of an explanation by several the best ones with each other named label in its place."""
    labels = list(dict.fromkeys(fit.effect_labels))
    if len(labels) < 2 or fit.observer is not None:
        return {}

    def others(label: str) -> list[JointFit]:
        forms = [form for form in FORMS if form.label not in (label, OTHER)]
        return effect_candidates(fit.without(label), forms)

    return dict(zip(labels, each(others, labels), strict=True))


def _with_all_it_asks(fit: JointFit, base: JointFit, told: Callable[[str], None]) -> JointFit:
    return within_sample(with_what_it_asks(fit, base, told))


def with_exchanged_laws(
    paths: Sequence[FollowedPath], known: Sequence[JointFit], told: Callable[[str], None]
) -> list[FollowedPath]:
    """Of every label the best that it or an exchange of another one's law reaches, or one begun in the place
    of the leading one's, without which any of those that are `known` may be best; friction by its own name.
    A law that leads by an exchange has a G of its own, beside which another may do better still: its own is
    exchanged in turn.
    """
    begun, leading = list(paths), None
    for _ in range(MOST_EXCHANGES):
        ahead = max(begun, key=lambda path: path.gained, default=None)
        if ahead is None or ahead is leading:
            break
        exchanging = begun if leading is None else [ahead]
        leading, before = ahead, begun
        begun = _exchanged(exchanging, leading, before, known)
        for path in begun:
            if path not in before:
                told(f"{log_evidence(path.gained)} by an exchange: {described(path.fit)}")
    return plainly_named(begun)


def _exchanged(
    exchanging: Sequence[FollowedPath],
    leading: FollowedPath,
    paths: Sequence[FollowedPath],
    known: Sequence[JointFit],
) -> list[FollowedPath]:
    """Of every label the best of the `paths` and of what those that are `exchanging` reach at once."""

    def others(path: FollowedPath) -> list[JointFit]:
        return (
            exchanged(path.fit)
            + misread(path.fit)
            + (begun_in_its_place(path.fit, [path.base, *known]) if path is leading else [])
        )

    by_exchange = [
        replace(path, fit=as_seen(fit))
        for path, fits in zip(exchanging, each(others, exchanging), strict=True)
        for fit in fits
        if np.isfinite(fit.score) and not is_hidden_friction(fit)
    ]
    best = best_of_each_label([*paths, *by_exchange])
    # The others' G was pruned with their own laws.
    return each(lambda path: replace(path, fit=pruned(path.fit)) if path in by_exchange else path, best)


def best_of_each_label(paths: Sequence[FollowedPath]) -> list[FollowedPath]:
    """Of the paths that explain anything the one that gains most of every label that they begin with, in the
    order in which the labels come first."""
    explaining = [path for path in paths if path.fit.labels]
    labels = dict.fromkeys(path.begun_with for path in explaining)
    return [max((p for p in explaining if p.begun_with == label), key=lambda p: p.gained) for label in labels]


def plainly_named(paths: Sequence[FollowedPath]) -> list[FollowedPath]:
    """The paths, but for friction under another name where one of friction's own explains nearly as much."""
    most = max((path.gained for path in paths if path.begun_with == FRICTION), default=-np.inf)
    return [p for p in paths if p.begun_with == FRICTION or not stands_for_friction(p.fit, p.gained, most)]


def as_seen(fit: JointFit) -> JointFit:
    """The fit under the names of what its laws look at, and of how its spring bends."""
    return named_by_sight(as_it_bends(fit))
