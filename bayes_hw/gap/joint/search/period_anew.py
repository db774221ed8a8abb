"""The period of a torque sought anew, in an explanation that is finished.

A ripple reaches the encoder through resonances, and what looks like a wave over position there need not have
its period. A scan of waves in the residual gives a search its starts; at the end every period is asked for
what its torque promises through ports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray, highest_peaks
from bayes_hw.crew import each
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit, highest, raced
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS, scanned_cycles
from bayes_hw.gap.joint.residuals.noise_screen import NoiseScreen, noise_screens
from bayes_hw.gap.joint.response.effect_paths import port_columns
from bayes_hw.gap.joint.response.joint_values import Effect, Ports
from bayes_hw.gap.joint.search.effect_moves import free_forms
from bayes_hw.gap.joint.search.effect_screen import begins_with_periods
from bayes_hw.time_budget import time_is_up

TRIED = 2
"""Peaks of the promise under each noise."""

LAWS_AT_ONCE = 16
"""Whose torques are worked out and projected together."""

FIRST_STEPS = 10


def with_period_anew(fit: AnyFit) -> AnyFit:
    """The fit, or where it is likelier the same with another period of its only periodic law, descended."""
    scale = fit.response.scale
    laws = [
        effect.form
        for effect in fit.values.effects
        if effect.is_own_law and not effect.form.further and begins_with_periods(effect.form, scale)
    ]
    if len(laws) != 1 or time_is_up():
        return fit
    rest = fit.without(laws[0].label).descended(FIRST_STEPS)
    order = min(fit.noise_order, 1)
    begun = [rest.with_effect(laws[0], values) for values in promising(rest, laws[0])]
    found = raced([one.descended_under(order, FIRST_STEPS) for one in begun], fit.score)
    return highest([fit, *found])


def periodic_by_promise(fit: AnyFit) -> list[AnyFit]:
    """The best explanation by every periodic law of a name that the fit lacks, begun at the periods at which
    its torque promises most; none once time is up."""
    scale = fit.response.scale
    laws = [
        f for f in free_forms(fit, FORMS) if f.is_law and f.label != OTHER and begins_with_periods(f, scale)
    ]
    found: list[AnyFit] = []
    for law in laws:
        if not time_is_up():
            begun = [fit.with_effect(law, values) for values in promising(fit, law)]
            if begun:
                found.append(highest(raced([one.descended_under(1, FIRST_STEPS) for one in begun])))
    return found


def promising(fit: JointFit, form: Form) -> list[tuple[float, ...]]:
    """The starts of a periodic form where its promise under each noise has its highest peaks, of all periods
    over the travel; none where all are shorter than may be looked for."""
    scale = fit.response.scale
    periods = scale.travel / scanned_cycles()
    every = [float(period) for period in periods if period >= scale.shortest]
    if not every:
        return []
    starts = [form.starts(replace(scale, periods=(one,), motor_periods=(one,))) for one in every]
    noises = noise_screens(fit)
    flat = [one for phases in starts for one in phases]
    parts = [flat[i : i + LAWS_AT_ONCE] for i in range(0, len(flat), LAWS_AT_ONCE)]
    asked = np.concatenate(each(lambda part: promises(fit, form, part, noises), parts), axis=1)
    by_phase = asked.reshape(len(noises), len(starts), -1)
    found: dict[tuple[float, ...], None] = {}
    for gains in by_phase:
        for i in highest_peaks(gains.max(axis=1))[:TRIED]:
            found[starts[i][int(gains[i].argmax())]] = None
    return list(found)


def promises(
    fit: JointFit, form: Form, starts: Sequence[tuple[float, ...]], noises: Sequence[NoiseScreen]
) -> FloatArray:
    """Nats (noises, starts) that the torques of a law promise through the weights of a port."""
    values, response = fit.values, fit.response
    ports = Ports.none(fit.structure.real_poles, fit.structure.sections)
    laws = [Effect(form, np.array(start), ports) for start in starts]
    tangents = []
    for number, run in enumerate(response.beside(values, laws)):
        over = 1.0 if response.weights is None else response.weights[number]
        tangents.append(port_columns(values, run.torques[-len(laws) :]) * (run.slope / over))
    return np.stack([noise.gains(tangents) for noise in noises])
