"""A record held out that goes beyond the commands of the records, where these reach no limit, says so."""

from __future__ import annotations

from dataclasses import replace

from joint_axis import CASCADE, STRUCTURE, measured, scale

from bayes_hw.gap.joint.finding import beyond_limits
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.unreached_limits import unknown_reach
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.cascade_response import outermost_limits
from bayes_hw.identify.growth.descent import evaluate


def test_what_is_held_out_beyond_limits_that_nothing_reached() -> None:
    """On the side whose limit is unknown, and not on that whose limit is known."""
    records = measured((), 600, (1,))
    _, outermost = outermost_limits(records)
    response = JointResponse(STRUCTURE, (), records, scale(600))
    values = JointValues(replace(CASCADE, upper=outermost))
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    (own,) = records
    up, down = replace(own, u=2 * own.u.clip(0)), replace(own, u=2 * own.u.clip(max=0))
    assert unknown_reach(fit, own) is None
    assert unknown_reach(fit, down) is None
    assert unknown_reach(fit, up) == (2 * own.u.max(), own.u.max())
    said = beyond_limits(up, 2.44, 1.42)
    assert "is commanded up to 2.44" in said and "trained on up to 1.42" in said
