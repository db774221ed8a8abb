"""A limit that no command reaches is beyond the commands, as its prior says; one that is reached is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, measured, scale

from bayes_hw.gap.answer.verdict import Estimate
from bayes_hw.gap.joint.answer.corrected_axis import CorrectedAxis
from bayes_hw.gap.joint.answer.corrected_model import corrected_model
from bayes_hw.gap.joint.finding import axis_words
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.starts import Starts
from bayes_hw.gap.joint.fit.unreached_limits import (
    chance_of_none,
    is_hardly_reached,
    standing_outermost,
)
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior, laplace
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.cascade_response import outermost_limits
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.infer.posterior import extremes
from bayes_hw.model.axis_parameters import LIMIT_LOG_SD
from bayes_hw.record import Units

SAMPLES = 600


@pytest.fixture(scope="module")
def posterior() -> JointPosterior:
    """The lower limit within the commands, the upper one as far out as a descent may take it."""
    records = measured((), SAMPLES, (1,))
    _, outermost = outermost_limits(records)
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    values = JointValues(replace(CASCADE, upper=outermost))
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    return laplace(fit, Units(), np.random.default_rng(1))


def test_it_lies_beyond_the_commands(posterior: JointPosterior) -> None:
    limit = posterior.fit.values.cascade.upper
    logs = np.log(posterior.base["saturation.upper"] / limit)
    assert logs.min() >= 0
    assert np.sqrt(np.mean(logs**2)) == pytest.approx(LIMIT_LOG_SD, rel=0.15)
    lower = posterior.base["saturation.lower"]
    assert np.std(lower) < 0.02 * abs(np.mean(lower))


def test_a_limit_that_hardly_cuts_is_none_and_one_that_cuts_is(posterior: JointPosterior) -> None:
    """A hair within the largest command, by less than the records tell; and a twentieth within."""
    fit = posterior.fit
    _, outermost = outermost_limits(fit.response.records)

    def named(within: float) -> list[str]:
        at = replace(fit.values, cascade=replace(fit.values.cascade, upper=(1 - within) * outermost))
        point = evaluate(fit.response, fit.response.coordinates(at))
        return standing_outermost(replace(fit, point=point))

    assert named(1e-5) == ["saturation.upper"]
    assert named(0.05) == []


def test_a_command_beyond_the_records_is_not_cut_at_their_largest(posterior: JointPosterior) -> None:
    """Held out, it is predicted with the limit where its prior has it, and the doubt of that is drawn; at
    commands as those of the records nothing changes."""
    fit = posterior.fit
    (train,) = fit.response.records
    starts = Starts.of(fit, [train], [])
    np.testing.assert_array_equal(
        starts.predict(fit, train), fit.response.simulate(fit.values, train.u, train.known).y
    )
    further = replace(train, u=np.where(train.u == train.u.max(), 1.15 * train.u, train.u))
    free = replace(fit.values, cascade=replace(fit.values.cascade, upper=np.inf))
    np.testing.assert_allclose(
        starts.predict(fit, further), fit.response.simulate(free, further.u, further.known).y
    )
    rng = np.random.default_rng(2)
    drawn = [starts.predict(fit, further, fit.values, rng)[-1] for _ in range(40)]
    assert np.ptp(drawn) > 0.5 * abs(starts.predict(fit, further)[-1] - starts.predict(fit, train)[-1])


def test_a_sentence_names_limits_that_are_reached() -> None:
    known = Estimate(-0.3, 0.001, (-0.302, -0.298), "deg/s")
    beyond = Estimate(0.7, 0.12, (0.6, 0.95), "deg/s")
    both = {"saturation.lower": known, "saturation.upper": beyond}
    assert axis_words(both) == "The axis follows commands up to -0.3 deg/s"
    assert "reaches no limit" in axis_words({"saturation.upper": beyond})


def test_what_a_corrected_model_draws_is_what_was_reported(posterior: JointPosterior) -> None:
    """Limits that are reached and not, and a dead zone that some draws do not have."""
    records = posterior.fit.response.records
    drawn = replace(posterior, coordinates=posterior.coordinates.copy())
    drawn.coordinates[::2, 2] = 0.0
    motion = {"motion": {"commanded": list(extremes(r.u for r in records))}}
    read = CorrectedAxis.of(corrected_model("axis", records, drawn, 1e-3) | motion).posterior
    assert read.unreached == ("saturation.upper",)
    upper, half_width = read.chains("saturation.upper").ravel(), read.chains("dead_zone.half_width").ravel()
    np.testing.assert_allclose(upper, posterior.base["saturation.upper"][: len(upper)])
    np.testing.assert_allclose(half_width, drawn.coordinates[: len(half_width), 2])


def test_a_limit_that_few_commands_reach_may_be_none() -> None:
    """Of an axis without an upper limit, fitted with one a little within its largest commands: most draws lie
    beyond them. A limit that many commands reach stays where it is."""
    (drawn,) = measured((), SAMPLES, (1,))
    free = replace(CASCADE, upper=np.inf)
    unlimited = JointResponse(replace(STRUCTURE, upper=False), (), [drawn], scale(SAMPLES))
    noise = SIGMA * np.random.default_rng(4).standard_normal(SAMPLES)
    y = unlimited.simulate(JointValues(free), drawn.u).y + noise
    response = JointResponse(STRUCTURE, (), [replace(drawn, y=y)], scale(SAMPLES))
    near = replace(CASCADE, upper=0.999 * float(drawn.u.max()))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(near))))
    assert is_hardly_reached(fit, "saturation.upper") != is_hardly_reached(fit, "saturation.lower")
    assert chance_of_none(fit, "saturation.upper") > 0.5
    limits = laplace(fit, Units(), np.random.default_rng(1)).base["saturation.upper"]
    assert np.mean(limits > drawn.u.max()) > 0.5
    (limited,) = measured((), SAMPLES, (1,))
    told = JointResponse(STRUCTURE, (), [limited], scale(SAMPLES))
    assert (
        chance_of_none(
            JointFit(told, evaluate(told, told.coordinates(JointValues(CASCADE)))), "saturation.upper"
        )
        < 1e-6
    )
