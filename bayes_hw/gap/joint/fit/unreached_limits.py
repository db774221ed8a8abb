"""Limits that no command of the records reaches: the records say where they are not, and no more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.growth.cascade_response import outermost_limits
from bayes_hw.model.axis_parameters import LIMIT_LOG_SD

LOWER, UPPER = "saturation.lower", "saturation.upper"
TOUCHING = 1e-6
"""Relative distance from the outermost limit that a descent may take, within which it stands there."""


def unreached_limits(
    fit: JointFit, base: Mapping[str, Sequence[float]], rng: np.random.Generator
) -> dict[str, list[float]]:
    """Draws of limits that stand at the largest commands: beyond, as their prior where posteriors are
    sampled says (a half normal of its logarithm)."""
    cascade = fit.values.cascade
    found: dict[str, list[float]] = {}
    for name in standing_outermost(fit):
        if name in base:
            limit = cascade.lower if name == LOWER else cascade.upper
            beyond = np.exp(LIMIT_LOG_SD * np.abs(rng.standard_normal(len(base[name]))))
            found[name] = (limit * beyond).tolist()
    return found


def standing_outermost(fit: JointFit) -> list[str]:
    """Names of the limits that no command of the records reaches."""
    cascade = fit.values.cascade
    limits = ((LOWER, cascade.lower), (UPPER, cascade.upper))
    return [
        name
        for (name, limit), outermost in zip(limits, outermost_limits(fit.response.records), strict=True)
        if abs(limit) >= (1 - TOUCHING) * abs(outermost)
    ]
