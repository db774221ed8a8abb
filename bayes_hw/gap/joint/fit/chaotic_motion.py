"""What the derivatives of a fit tell where its motion is chaotic: those under the torques that it found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.growth.descent import evaluate

EXPLODED = 1e3
"""Derivatives beyond those under held torques by so much are those of a chaotic motion."""


def drawn_about(fit: JointFit) -> tuple[JointFit, FloatArray, IntArray]:
    """What draws are taken about, its `factor`, and which of the fit's coordinates its own are (size,).

    The fit itself, or where its motion is chaotic, with the readings' corrections where an observer follows
    it, the same axis under the torques that the fit's laws gave: known inputs then, whose ports stay free and
    whose laws' own parameters are not asked for. An axis that its law alone steadies, as an observer's may
    be, overflows under held torques and not with its law: it is not chaotic. Raises FloatingPointError where
    derivatives overflow either way.
    """
    every = np.arange(fit.response.size)
    if not has_torques(fit):
        return fit, fit.factor(), every
    held, where = _under_its_torques(fit)
    try:
        factor, count = held.factor(), held.response.size
    except FloatingPointError:
        return fit, fit.factor(), every
    try:
        whole = fit.factor()
    except FloatingPointError:
        return held, factor, where
    linear = np.linalg.norm(factor[:count, :count], axis=0)
    moved = np.abs(whole[:, where]).max(axis=0)
    if np.all(moved < EXPLODED * np.maximum(linear, 1e-300)):
        return fit, whole, every
    return held, factor, where


def _under_its_torques(fit: JointFit) -> tuple[JointFit, IntArray]:
    """The fit with its laws' torques as known inputs, and which of its coordinates are left."""
    response, values = fit.response, fit.values
    base = response.size - sum(response.effect_sizes)
    where, effects, at = [*range(base)], list[Effect](), base
    for number, (effect, size) in enumerate(zip(values.effects, response.effect_sizes, strict=True)):
        kept = range(at, at + size)
        if effect.is_own_law and (ports := effect.ports) is not None:
            named = Form(
                effect.form.label,
                "as it was",
                "law",
                lambda _: (),
                lambda _: [],
                K.KNOWN,
                column=_column(number),
            )
            effects.append(Effect(named, np.empty(0), replace(ports, signal=False)))
            own = len(effect.values)
            kept = kept[own : own + ports.real.size + ports.sections.size + ports.direct.size]
        else:
            effects.append(effect)
        where += kept
        at += size
    held_values = JointValues(values.cascade, tuple(effects))
    runs = [response.along(values, i) for i in range(len(response.records))]
    known = []
    for record, run in zip(response.records, runs, strict=True):
        torques = {
            _column(number): run.torques[values.law_row(number)]
            for number, effect in enumerate(values.effects)
            if effect.is_own_law
        }
        known.append(replace(record, known={**record.known, **torques}))
    plain = replace(response, template=held_values.effects, records=known)
    records = [
        replace(record, y=record.y - run.y + plain.along(held_values, i).y)
        for i, (record, run) in enumerate(zip(known, runs, strict=True))
    ]
    plain = replace(plain, records=records)
    held = JointFit(plain, evaluate(plain, plain.coordinates(held_values), fit.point.whitener))
    return held, np.array(where)


def _column(number: int) -> str:
    """Among a record's known inputs, the torque of an effect."""
    return f"(torque {number})"


def has_torques(fit: JointFit) -> bool:
    """Whether an effect acts through ports."""
    return any(effect.ports is not None for effect in fit.response.template)
