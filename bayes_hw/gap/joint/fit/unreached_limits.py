"""Limits that no command of the records reaches: the records say where they are not, and no more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.chaotic_motion import drawn_about
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.cascade_response import outermost_limits
from bayes_hw.model.axis_parameters import LIMIT_LOG_SD
from bayes_hw.record import Record

LOWER, UPPER = "saturation.lower", "saturation.upper"
HALF_NORMAL_MEDIAN = 0.6745
FEW, FEW_STEPS, MOST_NATS = 0.05, 10, 500.0
"""Share of the samples; steps of the fit without a limit; nats that an exponential is taken of."""

TOUCHING = 1e-6
"""Relative distance from the outermost limit that a descent may take, within which it stands there."""

RIDGE = 1e-10
"""Of a correlation matrix: what the records do not see shall not hide what they see."""

NEAR = 0.02
"""A limit farther within the largest command is not held against standing there."""


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


def unknown_reach(fit: JointFit, held_out: Record) -> tuple[float, float] | None:
    """The farthest command of a record held out beyond those of the records, where no limit that they reach
    says what becomes of it, and their farthest on that side; None where there is none."""
    standing = standing_outermost(fit)
    own = [record.u for record in fit.response.records]
    sides = (
        (LOWER, float(held_out.u.min()), min(float(u.min()) for u in own)),
        (UPPER, float(held_out.u.max()), max(float(u.max()) for u in own)),
    )
    beyond = [(there, here) for name, there, here in sides if name in standing and abs(there) > abs(here)]
    return max(beyond, key=lambda pair: abs(pair[0]), default=None)


def standing_outermost(fit: JointFit) -> list[str]:
    """Names of the limits that no command of the records reaches.

    So is a limit that lies just within the largest command by chance. By Laplace's method, with s its
    standard deviation and d how far within it is, both over the limit, it is reached only where
    d^2 / (2 s^2) is more than log(LIMIT_LOG_SD / s): the share s of the prior is there, all of it beyond the
    largest command.
    """
    cascade = fit.values.cascade
    outermost = outermost_limits(fit.response.records)
    limits = ((LOWER, cascade.lower, outermost[0]), (UPPER, cascade.upper, outermost[1]))
    found = []
    for name, limit, end in limits:
        within = 1 - abs(limit) / abs(end)
        if within <= TOUCHING or (within < NEAR and within < _farthest_by_chance(fit, name)):
            found.append(name)
    return found


@lru_cache(maxsize=4)
def _farthest_by_chance(fit: JointFit, name: str) -> float:
    """How far within the largest command, over it, a limit may lie that is not reached."""
    present = [n for n, held in ((LOWER, fit.structure.lower), (UPPER, fit.structure.upper)) if held]
    if name not in present:
        return 0.0
    row, (about, factor, _) = present.index(name), drawn_about(fit)
    size = len(factor) - 1
    variance = about.point.variance_by(factor)
    norms = np.linalg.norm(factor[:size, :size], axis=0)
    scaled = factor[:size, :size] / np.where(norms > 0, norms, 1.0)
    spread = np.linalg.inv(scaled.T @ scaled + RIDGE * np.eye(size))[row, row]
    limit = abs(float(fit.point.coordinates[row]))
    share = float(np.sqrt(variance * spread)) / (norms[row] * limit) if norms[row] > 0 else np.inf
    if not 0 < share < LIMIT_LOG_SD:
        return 0.0
    return share * float(np.sqrt(2 * np.log(LIMIT_LOG_SD / share)))
