"""Limits that no command of the records reaches: the records say where they are not, and no more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.cascade_response import outermost_limits
from bayes_hw.model.axis_parameters import LIMIT_LOG_SD

LOWER, UPPER = "saturation.lower", "saturation.upper"
HALF_NORMAL_MEDIAN = 0.6745
FEW, FEW_STEPS, MOST_NATS = 0.05, 10, 500.0
"""Share of the samples; steps of the fit without a limit; nats that an exponential is taken of."""

TOUCHING = 1e-6
"""Relative distance from the outermost limit that a descent may take, within which it stands there."""


def unreached_limits(
    fit: JointFit, base: Mapping[str, Sequence[float]], rng: np.random.Generator
) -> dict[str, list[float]]:
    """Draws of limits that stand at the largest commands: beyond, as their prior where posteriors are
    sampled says (a half normal of its logarithm); of those that few commands reach, so many of the draws as
    is likely that none does."""
    outermost = dict(zip((LOWER, UPPER), outermost_limits(fit.response.records), strict=True))
    standing = standing_outermost(fit)
    found: dict[str, list[float]] = {}
    for name in (LOWER, UPPER):
        if name not in base or not (name in standing or is_hardly_reached(fit, name)):
            continue
        beyond = outermost[name] * np.exp(LIMIT_LOG_SD * np.abs(rng.standard_normal(len(base[name]))))
        if name not in standing:
            none = rng.uniform(size=len(beyond)) < chance_of_none(fit, name)
            beyond = np.where(none, beyond, base[name])
        found[name] = beyond.tolist()
    return found


def is_hardly_reached(fit: JointFit, name: str) -> bool:
    """Whether so few commands go beyond a limit that they may be none of its doing."""
    cascade, beyond, samples = fit.values.cascade, 0, 0
    for record in fit.response.records:
        past = record.u < cascade.lower if name == LOWER else record.u > cascade.upper
        beyond, samples = beyond + int(past.sum()), samples + len(past)
    return beyond < FEW * samples


def chance_of_none(fit: JointFit, name: str) -> float:
    """That a limit is beyond all commands: by the score of the fit without it, which has a number less."""
    cascade = fit.values.cascade
    if name == LOWER:
        without, free = replace(fit.structure, lower=False), replace(cascade, lower=-np.inf)
    else:
        without, free = replace(fit.structure, upper=False), replace(cascade, upper=np.inf)
    values = JointValues(free, fit.values.effects)
    lead = fit.score - fit.moved(without, values, fit.point.whitener).descended(FEW_STEPS).score
    return float(1 / (1 + np.exp(np.clip(lead, -MOST_NATS, MOST_NATS))))


def beyond_records(
    fit: JointFit, values: JointValues, commands: FloatArray, rng: np.random.Generator | None = None
) -> JointValues:
    """`values` for commands that go beyond those of the records: a limit that no command of theirs reaches is
    not at the largest of them but where `unreached_limits` has it, at the median of that or drawn."""
    cascade = values.cascade
    away = HALF_NORMAL_MEDIAN if rng is None else abs(float(rng.standard_normal()))
    factor = float(np.exp(LIMIT_LOG_SD * away))
    for name in standing_outermost(fit):
        if name == LOWER and commands.min() < min(r.u.min() for r in fit.response.records):
            cascade = replace(cascade, lower=cascade.lower * factor)
        elif name == UPPER and commands.max() > max(r.u.max() for r in fit.response.records):
            cascade = replace(cascade, upper=cascade.upper * factor)
    return replace(values, cascade=cascade)


def standing_outermost(fit: JointFit) -> list[str]:
    """Names of the limits that no command of the records reaches."""
    cascade = fit.values.cascade
    limits = ((LOWER, cascade.lower), (UPPER, cascade.upper))
    return [
        name
        for (name, limit), outermost in zip(limits, outermost_limits(fit.response.records), strict=True)
        if abs(limit) >= (1 - TOUCHING) * abs(outermost)
    ]
