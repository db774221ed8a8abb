"""Laws that look at the states of G from the first step on, begun under several noises: which it is shows at
their ends."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.crew import each
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, AnyFit, descended_each, highest
from bayes_hw.gap.joint.forms.drive_forms import GIVEN_FORMS, OF_DEMAND
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.effect_moves import FIRST_STEPS, SECOND_STEPS
from bayes_hw.gap.joint.search.law_exchange import PERIODIC
from bayes_hw.gap.joint.search.structural import explained_slowly, finer
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.time_budget import time_is_up

STARTS_KEPT, KINDS_GONE_ON, KINDS_FINISHED = 4, 7, 4
"""Of every kind of law the starts that go on; kinds that go on, and to their end."""

CLOSEST_KEPT, CLOSEST_OF_A_KIND = 4, 2
"""Starts that go on since they leave the least under white noise, of all kinds and of one."""

KICKS, KICK_ROUNDS, LITTLE_SHARE = (0.5, 0.7, 1.4, 2.0), 3, 0.01
"""Factors on every size of a law from which its descent begins again, rounds of them, and the share of the
residual that a round must take away for another."""

BEGUN_SAMPLES = 5000
"""Of all records together, on which laws are begun."""


def every_law(fit: AnyFit, forms: Sequence[Form] = GIVEN_FORMS) -> list[AnyFit]:
    """Of every label that the fit lacks, and of every form without a name, the best law through ports of its
    own, looking at the states of G.

    All of its starts are begun, and where the noise is of higher order, which may have taken up what they
    explain, under noise of the first as well, and under white noise, under which all that a law leaves
    counts: neither what a start promises nor a few steps without the states tell which law it is. They are
    begun on the beginnings of long records. Which start leaves the least under white noise is asked where a
    law explains something, and not all. Laws that are periodic in position are left out, their starts are too
    many. None once time is up.
    """
    if time_is_up():
        return []
    seen = _beginning(fit)
    starts: dict[str, list[AnyFit]] = {}
    for form in forms:
        if form.is_law and not form.further and form.law not in PERIODIC and form.label not in fit.labels:
            starts.setdefault(form.kind, []).extend(_law_starts(seen, form))
    begun = {kind: _begun(own) for kind, own in starts.items()}
    kinds = sorted(begun, key=lambda kind: -begun[kind][0].score)
    for kind in kinds[:KINDS_GONE_ON]:
        begun[kind] = _gone_on(begun[kind], 2)
    found = {kind: [t.on_records_of(fit) for t in begun[kind]] for kind in kinds}
    kinds.sort(key=lambda kind: -max(t.score for t in found[kind]))
    for kind in kinds[:KINDS_FINISHED]:
        found[kind] = _gone_on(found[kind], 2, FULL_STEPS)
    best = highest([fit, *(t for own in found.values() for t in own)])
    explains_some = best.score > fit.score + VERIFIED_NATS and best.noise_order > 1
    for kind, closest in _closest(starts) if explains_some else ():
        found[kind].append(finer(explained_slowly(closest.on_records_of(fit).descended())))
    return [highest(found[kind]) for kind in kinds]


def _closest(starts: Mapping[str, Sequence[AnyFit]]) -> list[tuple[str, AnyFit]]:
    """By kind, the starts that leave the least after some steps under white noise, after more and after
    kicks; none where the noise is white or of the first order."""
    begun = [
        (kind, t.descended_under(0, SECOND_STEPS))
        for kind, own in starts.items()
        for t in own
        if t.point.whitener.order > 1
    ]
    kept: list[tuple[str, AnyFit]] = []
    for kind, t in sorted(begun, key=lambda one: one[1].point.rms):
        if len(kept) < CLOSEST_KEPT and sum(kind == other for other, _ in kept) < CLOSEST_OF_A_KIND:
            kept.append((kind, t))
    return [(kind, kicked(t.descended_under(0, FULL_STEPS))) for kind, t in kept]


def kicked(fit: AnyFit) -> AnyFit:
    """The last law's sizes made larger and smaller, descended again under white noise, while less is left:
    where a law is now reached and now not, descents end short of the least."""
    response = fit.response
    law = fit.values.effects[-1].form
    first = response.size - response.effect_sizes[-1]
    sizes = [first + i for i, slot in enumerate(law.slots(response.scale)) if slot.logarithmic]
    for _ in range(KICK_ROUNDS):
        before = fit.point.rms
        for i, factor in itertools.product(sizes, KICKS):
            if not time_is_up():
                moved = fit.point.coordinates.copy()
                moved[i] += np.log(factor)
                begun = evaluate(response, response.admissible(moved, fit.point.coordinates))
                other = replace(fit, point=begun).descended_under(0, FULL_STEPS)
                fit = min(fit, other, key=lambda one: one.point.rms)
        if fit.point.rms > (1 - LITTLE_SHARE) * before:
            break
    return fit


def _beginning(fit: AnyFit) -> AnyFit:
    """The same explanation of the first BEGUN_SAMPLES of all records, of each in proportion."""
    response = fit.response
    share = BEGUN_SAMPLES / sum(len(record) for record in response.records)
    if share >= 1:
        return fit
    records = tuple(record.split(share)[0] for record in response.records)
    weights = response.weights
    if weights is not None:
        weights = tuple(w[: len(record)] for w, record in zip(weights, records, strict=True))
    return fit.under(replace(response, records=records, weights=weights))


def _law_starts(fit: AnyFit, form: Form) -> list[AnyFit]:
    """With one more law that looks at the states of G: from nothing seen of them, and where it is a law of
    the command, from what the loop lacks of it. What has no name also looking at its own signal alone:
    elsewhere such forms share the few starts of one label."""
    last = len(fit.values.effects)
    plain = [fit.with_effect(form, s) for s in form.starts(fit.response.scale)]
    starts = [s.with_signal(last) for s in plain]
    if form in OF_DEMAND:
        return starts + [_lacking(s) for s in starts]
    return starts + (plain if form.label == OTHER else [])


def _lacking(fit: AnyFit) -> AnyFit:
    """The last law begun from the command less the axis' own speed in units of the command."""
    values, scale = fit.values, fit.response.scale
    sections = values.cascade.sections
    last = values.effects[-1]
    assert last.ports is not None
    seen = np.stack([1 - sections[0], -np.ones(sections.shape[1])])
    ports = replace(
        last.ports, signal_real=(1 - values.cascade.real[0]) / scale.gain, signal_sections=seen / scale.gain
    )
    effects = (*values.effects[:-1], replace(last, ports=ports))
    return fit.moved(fit.structure, JointValues(values.cascade, effects), fit.point.whitener)


def _begun(starts: Sequence[AnyFit]) -> list[AnyFit]:
    """A few steps from every start, best first."""
    begun = descended_each(starts, FIRST_STEPS)
    if starts[0].point.whitener.order > 1:
        begun += each(lambda s: s.descended_under(1, FIRST_STEPS), starts)
    return _gone_on(sorted(begun, key=lambda t: -t.score), STARTS_KEPT)


def _gone_on(fits: Sequence[AnyFit], count: int, steps: int = SECOND_STEPS) -> list[AnyFit]:
    """The best `count` of some that are in order, after more steps, best first."""
    return sorted(descended_each(fits[:count], steps), key=lambda t: -t.score)
