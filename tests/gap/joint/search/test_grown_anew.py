"""G grown from nothing beside a label gives back the delay with which it stood in for that label."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, form, measured, scale

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search import grown_anew
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.grown_anew import over_grown_anew, with_leading_grown_anew
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, TOO_LONG = 700, 4
WAVE = Effect(form("encoder_eccentricity"), np.array([0.01, 0.004, 12.0]))


def _stuck() -> FollowedPath:
    """The wave explained over a G of too long a delay, where it ended under noise of high order."""
    records = measured((WAVE,), SAMPLES, (1, 2))
    structure = replace(STRUCTURE, delay_samples=STRUCTURE.delay_samples + TOO_LONG)
    fits = []
    for effects in ((WAVE,), ()):
        values = JointValues(CASCADE, effects)
        response = JointResponse(structure, effects, records, scale(SAMPLES))
        fits.append(JointFit(response, evaluate(response, response.coordinates(values))).descended())
    return FollowedPath(*fits, read_faults(fits[1]))


def test_the_delay_is_given_back() -> None:
    path = _stuck()
    found = over_grown_anew(path)
    assert found is not None and found.begun_with == "encoder_eccentricity"
    assert found.base is path.base
    assert found.fit.structure.delay_samples <= STRUCTURE.delay_samples + 1
    assert found.gained > path.gained + 100
    assert found.fit.point.rms == pytest.approx(SIGMA, rel=0.1)


def test_it_is_done_where_the_leading_path_leaves_something(monkeypatch: pytest.MonkeyPatch) -> None:
    """And kept where it gains more; a path that leaves nothing stays as it is."""
    path = _stuck()
    better = over_grown_anew(path)
    assert better is not None
    followed: list[FollowedPath] = []

    def follow(one: FollowedPath) -> FollowedPath:
        followed.append(one)
        return one

    monkeypatch.setattr(grown_anew, "over_grown_anew", lambda _: better)
    for left, expected in ((100.0, [better]), (10.0, [path])):
        monkeypatch.setattr(grown_anew, "leaves_a_cause", lambda _, left=left: left > 40)
        assert with_leading_grown_anew([path], follow) == expected
    assert followed == [better]
    assert with_leading_grown_anew([], follow) == []
