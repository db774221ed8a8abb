"""The period of a torque sought anew, in an explanation that is finished.

A ripple reaches the encoder through resonances, and what looks like a wave over position there need not have
its period. A scan of waves in the residual gives a search its starts; at the end every period is asked for
what its torque promises through ports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray, highest_peaks
from bayes_hw.crew import each
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit, highest, raced
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS, scanned_cycles
from bayes_hw.gap.joint.residuals.noise_screen import noise_screens
from bayes_hw.gap.joint.search.effect_moves import free_forms
from bayes_hw.gap.joint.search.effect_screen import begins_with_periods
from bayes_hw.time_budget import time_is_up

TRIED = 2
"""Peaks of the promise under each noise."""

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
    return cast(AnyFit, highest([fit, *found]))


def periodic_by_promise(fit: JointFit) -> list[JointFit]:
    """The best explanation by every periodic law of a name that the fit lacks, begun at the periods at which
    its torque promises most; none once time is up."""
    scale = fit.response.scale
    laws = [
        f for f in free_forms(fit, FORMS) if f.is_law and f.label != OTHER and begins_with_periods(f, scale)
    ]
    found: list[JointFit] = []
    for law in laws:
        if not time_is_up():
            begun = [fit.with_effect(law, values) for values in promising(fit, law)]
            found += raced([one.descended_under(1, FIRST_STEPS) for one in begun])[:1]
    return found


def promising(fit: JointFit, form: Form) -> list[tuple[float, ...]]:
    """The starts of a periodic form where its promise under each noise has its highest peaks, of all periods
    over the travel."""
    scale = fit.response.scale
    periods = scale.travel / scanned_cycles()
    every = [float(period) for period in periods if period >= scale.shortest]
    starts = [form.starts(replace(scale, periods=(one,), motor_periods=(one,))) for one in every]
    noises = noise_screens(fit)

    def best_phase(phases: Sequence[tuple[float, ...]]) -> tuple[FloatArray, IntArray]:
        gains = np.array([[noise.gain(fit.effect_tangents(form, one)) for one in phases] for noise in noises])
        return gains.max(axis=1), gains.argmax(axis=1)

    asked = each(best_phase, starts)
    found: dict[tuple[float, ...], None] = {}
    for noise in range(len(noises)):
        row = np.array([gains[noise] for gains, _ in asked])
        for i in highest_peaks(row)[:TRIED]:
            found[starts[i][asked[i][1][noise]]] = None
    return list(found)
