"""Moves of the joint search that add an effect, a cause of the noise or a port, or change their form."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit, descended_each, raced
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale, Slot
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.noise.slow_noise import WALK, WIND, SlowNoise
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.gap.joint.search.effect_screen import Start, best_starts, screened
from bayes_hw.time_budget import time_is_up

STARTS_OF_A_LABEL = 3
"""Acting at one place: what a start promises there tells little of another's, such as of a play at the output
beside a gap in the drive."""

FIRST_STEPS, SECOND_STEPS = 4, 8
KEPT_STARTS, KEPT_LABELS, KEPT_AFTER = 16, 5, 2
"""Successive halving over starts and labels: steps given, and how many go on."""

LEAST_PROMISE = 2.0
"""Nats that a start must promise to be tried, where the noise is white or of the first order: there a score
test hides nothing."""

LIGHT = 0.25
"""Damping ratio of the pairs of G that a slow torque is seen to shake."""

NEARLY_INTEGRAL = 1e-3


def free_forms(fit: JointFit, forms: Sequence[Form]) -> list[Form]:
    """Those of labels that the fit lacks, whose parameters no present effect uses, further ones left out."""
    present, scale = set(fit.labels), fit.response.scale
    taken = {
        (e.form.place, t.row) for e in fit.response.template if not e.form.is_law for t in e.form.slots(scale)
    }
    return [
        f
        for f in forms
        if f.label not in present
        and not f.further
        and not taken & {(f.place, slot.row) for slot in f.slots(scale)}
    ]


def effect_candidates(fit: AnyFit, forms: Sequence[Form]) -> list[AnyFit]:
    """The best explanations with one more label, descended.

    Where the noise is of high order it may have taken up what is slow, so that a descent under it begins by
    explaining what is fast: from every start another begins under noise of the first order, and of what acts
    on the command or the reading one under white noise, under which all that is left counts. None once time
    is up.
    """
    if time_is_up():
        return []
    free = free_forms(fit, forms)
    starts = screened(fit, free)
    if fit.noise_order <= 1:
        starts = [s for s in starts if max(s.gains) > LEAST_PROMISE]
    own = [
        best_starts([s for s in starts if (s.form.label, s.form.place) == acting], STARTS_OF_A_LABEL)
        for acting in dict.fromkeys((s.form.label, s.form.place) for s in starts)
    ]
    chosen = [start for alike in own for start in alike]
    if fit.labels:
        chosen = beside_others(own)
    trials = [fit.with_effect(s.form, s.values) for s in chosen]
    first = descended_each(trials, FIRST_STEPS // 2)
    if fit.noise_order > 1:
        no_laws = [t for t in trials if not t.values.effects[-1].form.is_law]
        for order, begun in ((1, trials), (0, no_laws)):
            first += each(partial(_begun_under, order), begun)
    ranked = sorted(first, key=lambda t: -t.score)[:KEPT_STARTS]
    ranked = sorted(descended_each(ranked, FIRST_STEPS // 2), key=lambda t: -t.score)
    kept: list[AnyFit] = []
    for t in ranked:
        if (
            sum(k.labels[-1] == t.labels[-1] for k in kept) < 2
            and len({k.labels[-1] for k in kept} | {t.labels[-1]}) <= KEPT_LABELS
        ):
            kept.append(t)
    further = sorted(descended_each(kept, SECOND_STEPS), key=lambda t: -t.score)
    found: dict[str, AnyFit] = {}
    for t in further:
        found.setdefault(t.labels[-1], t)
    best = list(found.values())
    if fit.labels:
        return raced(best[: KEPT_AFTER + 1]) + best[KEPT_AFTER + 1 :]
    return descended_each(best[: KEPT_AFTER + 1]) + best[KEPT_AFTER + 1 :]


def _begun_under(order: int, trial: AnyFit) -> AnyFit:
    """After some steps under noise of this order and some under its own."""
    return trial.descended_under(order, FIRST_STEPS).descended(FIRST_STEPS // 2)


def beside_others(own: Sequence[Sequence[Start]]) -> list[Start]:
    """Of the starts of every label at a place the first, and those that promise most of all under either
    noise."""
    every = [start for alike in own for start in alike]
    kept = {id(alike[0]) for alike in own}
    for noise in range(min((len(start.gains) for start in every), default=0)):
        ranked = sorted(every, key=lambda s: -s.gains[noise])
        kept |= {id(start) for start in ranked[: KEPT_STARTS // 2]}
    return [start for start in every if id(start) in kept]


def slow_causes(fit: AnyFit) -> list[AnyFit]:
    """The fit with noise that wind or a walking angle explains; none where it has one, or noise that is
    white or of the first order, where the readings correct it, or where time is up."""
    if fit.noise_order <= 1 or fit.observer is not None or time_is_up():
        return []
    causes = [cause for cause in (WIND, WALK) if cause not in fit.labels]
    return each(lambda cause: with_slow_noise(fit, cause).descended().with_noise_kept(), causes)


def each_cause(fit: AnyFit) -> list[AnyFit]:
    """With either cause of the noise, all else free, through the poles that G now has, exact."""
    causes = [cause for cause in (WIND, WALK) if cause not in fit.effect_labels]
    return each(lambda cause: with_slow_noise(fit, cause, exact=True).descended().with_noise_kept(), causes)


def with_slow_noise(fit: AnyFit, cause: str, exact: bool = False) -> AnyFit:
    """With noise of this cause, fitted to what the fit leaves; a torque may shake G's light pairs of poles or
    all of its poles."""
    sections, real = fit.values.cascade.sections, fit.values.cascade.real[0]
    pairs = np.array([np.roots([1.0, -a1, a2]) for a1, a2 in sections[:2].T], dtype=np.complex128).ravel()
    slow = real[np.abs(real - 1) > NEARLY_INTEGRAL].astype(np.complex128)
    damping = -np.log(pairs).real / np.abs(np.log(pairs))
    sets = (pairs[damping < LIGHT], np.concatenate([pairs, slow]))
    return fit.with_cause(SlowNoise(cause, fit.response.scale.rate_hz, sets, exact=exact))


def port_candidates(fit: AnyFit) -> list[AnyFit]:
    """Signal ports of the torques present, and other forms of the effects present."""
    found = []
    for i, effect in enumerate(fit.values.effects):
        if effect.form.column:
            continue
        ports = effect.ports
        if ports is not None and not ports.signal and fit.structure.sections + fit.structure.real_poles > 0:
            found.append(fit.with_signal(i))
        found += [fit.with_form(i, form, start) for form, start in other_forms(effect, fit.response.scale)]
    return found


def other_forms(effect: Effect, scale: JointScale) -> list[tuple[Form, tuple[float, ...]]]:
    """Forms of the same label that act at the same place and look at the same signal, with a start:
    parameters of one name keep their values. Of what is no law every form begins at no strength."""
    own = {slot.name: float(x) for slot, x in zip(effect.form.slots(scale), effect.values, strict=True)}
    found = []
    for form in FORMS:
        present = effect.form
        if form is present or (form.label, form.place, form.base) != (
            present.label,
            present.place,
            present.base,
        ):
            continue
        slots, start = form.slots(scale), form.starts(scale)[0]
        names = [slot.name for slot in slots]
        extends = form.law == present.law and names[: len(own)] == list(own)
        if extends or not form.further:
            kept = [own.get(slot.name, x) for slot, x in zip(slots, start, strict=True)]
            found.append((form, tuple(within(kept, slots))))
        if extends and form.otherwise is not None:
            named = form.otherwise(own)
            begun = [named[name] for name in names]
            if begun == within(begun, slots):
                found.append((form, tuple(begun)))
    return found


def within(values: Sequence[float], slots: Sequence[Slot]) -> list[float]:
    """Values (slots,) within the bounds of their slots."""
    return [float(np.clip(x, slot.lower, slot.upper)) for x, slot in zip(values, slots, strict=True)]
