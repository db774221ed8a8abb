"""Limits of a given model begun at several places: a descent leaves neither a limit's kinks nor the plain
beyond what commands reach."""

from __future__ import annotations

import itertools

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import highest, raced
from bayes_hw.gap.joint.given.given_response import LIMITS, GivenFit
from bayes_hw.identify.growth.descent import evaluate

MULTIPLES = (1.0, 0.8, 0.9, 1.1, 1.25)
"""Of the nominal limits."""

RACED = 3
"""Starts that go on."""


def limit_starts(fit: GivenFit) -> list[GivenFit]:
    """The fit with both limits at every pair of MULTIPLES of the nominal ones, not descended; the smallest
    residual first."""
    starts = []
    for pair in itertools.product(MULTIPLES, repeat=LIMITS):
        coordinates: FloatArray = fit.point.coordinates.copy()
        coordinates[:LIMITS] = np.log(pair)
        starts.append(GivenFit(fit.response, evaluate(fit.response, coordinates)))
    return sorted(starts, key=lambda start: start.point.rms)


def with_limits_anew(fit: GivenFit) -> GivenFit:
    """The best of the fit and of those begun from other limits: what was added since they were found may have
    moved them."""
    found = highest([fit, *raced(limit_starts(fit)[:RACED], fit.score)])
    assert isinstance(found, GivenFit)
    return found
