"""A limit that no command reaches has no slope: descents do not go there, and one that stands there is begun
where commands reach it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import measured
from scipy import stats
from test_given_search import model

from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS
from bayes_hw.gap.joint.given.base_starts import unreached_starts
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.posterior.given_posterior import laplace_given
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Units

SAMPLES = 400
LARGEST = 0.33
"""Of the commands, beyond the upper limit 0.3 and below the nominal one."""


@pytest.fixture(scope="module")
def base() -> GivenFit:
    """The axis without effects around a model whose upper limit no command reaches."""
    records = [replace(r, u=np.minimum(r.u, LARGEST)) for r in measured((), SAMPLES, (1, 2))]
    return best_base(records, model(upper=0.36))


def unreached(base: GivenFit) -> GivenFit:
    """Its upper limit at the nominal one."""
    coordinates = base.point.coordinates.copy()
    coordinates[1] = 0.0
    return replace(base, point=evaluate(base.response, coordinates))


def test_a_limit_that_commands_reach_stays_reached(base: GivenFit) -> None:
    now, reach = base.point.coordinates, base.response.reach
    far = unreached(base).point.coordinates
    assert far[1] > reach[1] == pytest.approx(np.log(LARGEST / 0.36), abs=0.01)
    assert base.response.admissible(far, now)[1] == reach[1]
    assert base.response.admissible(far, far)[1] == far[1]


def test_a_limit_beyond_is_found_from_where_commands_reach_it(base: GivenFit) -> None:
    """Left where it is it stays there: only its prior pulls at it."""
    beyond = unreached(base)
    assert beyond.descended_under(0, 10).values.cascade.upper > LARGEST
    found = beyond.with_limits_reached().descended_under(0, FULL_STEPS)
    assert found.values.cascade.upper == pytest.approx(0.3, rel=0.01)
    assert found.values.cascade.lower == pytest.approx(base.values.cascade.lower, rel=0.002)


def test_where_all_are_reached_nothing_moves(base: GivenFit) -> None:
    assert base.with_limits_reached() is base


def test_a_limit_just_within_the_largest_command_is_begun_beyond_it(base: GivenFit) -> None:
    """One that lies deep within is not."""
    assert unreached_starts(base) == []
    coordinates = base.point.coordinates.copy()
    coordinates[1] = base.response.reach[1] - 0.002
    within = replace(base, point=evaluate(base.response, coordinates))
    (start,) = unreached_starts(within)
    assert start.point.coordinates[1] == 0.0
    assert np.array_equal(start.point.coordinates[2:], coordinates[2:])


def test_draws_of_a_limit_that_no_command_reaches_are_its_prior_beyond_them(base: GivenFit) -> None:
    """Each half of the prior that is left, by its quantiles; one that is reached is where it was."""
    drawn = laplace_given(unreached(base), Units(), np.random.default_rng(3))
    upper = np.log(np.abs(drawn.base["saturation.upper"]) / 0.36)
    reach, sd = base.response.reach[1], base.response.given.prior_sd()[1]
    assert upper.min() >= reach - 1e-9
    assert stats.kstest(upper, stats.truncnorm(reach / sd, np.inf, scale=sd).cdf).pvalue > 1e-3
    assert np.ptp(drawn.base["saturation.lower"]) < 0.1 * abs(base.values.cascade.lower)
