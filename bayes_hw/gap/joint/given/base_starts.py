"""Base parameters of a given model begun at several places: a descent leaves neither a limit's kinks nor the
plain beyond what commands reach, nor the frequency at which a light mode, hardly excited, fits by chance."""

from __future__ import annotations

import itertools

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import highest, raced
from bayes_hw.gap.joint.fit.unreached_limits import NEAR, TOUCHING
from bayes_hw.gap.joint.given.given_model import STATIC
from bayes_hw.gap.joint.given.given_response import LIMITS, GivenFit
from bayes_hw.identify.growth.descent import evaluate

MULTIPLES = (1.0, 0.8, 0.9, 1.1, 1.25)
"""Of the nominal limits."""

DEVIATIONS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Of a mode's frequency from its nominal one, in standard deviations of its prior."""

RACED = 3
"""Limits that go on; of every mode, frequencies."""


def limit_starts(fit: GivenFit) -> list[GivenFit]:
    """The fit with both limits at every pair of MULTIPLES of the nominal ones, not descended; the smallest
    residual first."""
    return _begun(fit, slice(0, LIMITS), [np.log(p) for p in itertools.product(MULTIPLES, repeat=LIMITS)])


def mode_starts(fit: GivenFit, number: int) -> list[GivenFit]:
    """The fit with the frequency of mode `number` at DEVIATIONS from the nominal one and its damping nominal,
    not descended; the smallest residual first."""
    at = STATIC + 2 * number
    sd = fit.response.given.prior_sd()[at]
    return _begun(fit, slice(at, at + 2), [np.array([x * sd, 0.0]) for x in DEVIATIONS])


def with_nominal_modes(fit: GivenFit) -> GivenFit:
    """The fit with every mode where the model has it, not descended."""
    modes = slice(STATIC, fit.response.given.size)
    return _at(fit, modes, np.zeros(modes.stop - modes.start))


def unreached_starts(fit: GivenFit) -> list[GivenFit]:
    """The fit with limits that lie NEAR within the largest command beyond all of them, where the prior is
    largest there: each of them and both, not descended. A descent stays within, on a kink that a few samples
    make."""
    reach = fit.response.reach
    rows = [row for row in range(LIMITS) if reach[row] - NEAR < fit.theta[row] <= reach[row]]
    several = (list(some) for size in (1, 2) for some in itertools.combinations(rows, size))
    return [_at(fit, chosen, np.maximum(0.0, reach[chosen] + TOUCHING)) for chosen in several]


def with_base_anew(fit: GivenFit) -> GivenFit:
    """The best of the fit and of those begun from other limits and other frequencies: what was added since
    they were found may have moved them."""
    starts = limit_starts(fit)[:RACED]
    for number in range(len(fit.response.given.modes)):
        starts += mode_starts(fit, number)[:RACED]
    return highest([fit, *raced([*starts, *unreached_starts(fit)], fit.score)])


def _begun(fit: GivenFit, which: slice, values: list[FloatArray]) -> list[GivenFit]:
    return sorted((_at(fit, which, own) for own in values), key=lambda start: start.point.rms)


def _at(fit: GivenFit, which: slice | list[int], own: FloatArray) -> GivenFit:
    coordinates = fit.point.coordinates.copy()
    coordinates[which] = own
    return GivenFit(fit.response, evaluate(fit.response, coordinates))
