"""What the derivatives of a fit tell where its motion is chaotic: those of the linear cascade under it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

EXPLODED = 1e3
"""Derivatives beyond those of the linear cascade by so much are those of a chaotic motion."""


def drawn_about(fit: JointFit) -> tuple[JointFit, FloatArray]:
    """What draws are taken about, and its `factor`: the fit, or where its motion is chaotic and no observer
    follows it, the cascade alone, at the same values, on records less what the effects add to the angle; its
    coordinates are the first of the fit's. Raises FloatingPointError where derivatives overflow and no torque
    is the reason."""
    whole: FloatArray | None = None
    try:
        whole = fit.factor()
    except FloatingPointError:
        if not has_torques(fit):
            raise
    if whole is not None and (fit.observer is not None or not has_torques(fit)):
        return fit, whole
    values = JointValues(fit.values.cascade)
    plain = replace(fit.response, template=())
    records = [
        replace(record, y=record.y - fit.response.along(fit.values, i).y + plain.along(values, i).y)
        for i, record in enumerate(fit.response.records)
    ]
    plain = replace(plain, records=records)
    held = JointFit(plain, evaluate(plain, plain.coordinates(values), fit.point.whitener))
    factor, count = held.factor(), plain.size
    if whole is None:
        return held, factor
    linear = np.linalg.norm(factor[:count, :count], axis=0)
    moved = np.abs(whole[:, :count]).max(axis=0)
    if np.all(moved < EXPLODED * np.maximum(linear, 1e-300)):
        return fit, whole
    return held, factor


def has_torques(fit: JointFit) -> bool:
    """Whether an effect acts through ports."""
    return any(effect.ports is not None for effect in fit.response.template)
