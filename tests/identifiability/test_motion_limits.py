"""Commands are kept within velocity and acceleration, from rest to rest, and limits come from the records."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kept_limits import keeps_to

from bayes_hw.errors import InputError
from bayes_hw.identifiability.motion_limits import MotionLimits, kept_within, limits_for
from bayes_hw.record import Record


@given(st.lists(st.floats(-5, 5), min_size=1, max_size=60), st.floats(0.1, 4), st.floats(0.5, 200))
@settings(max_examples=60, deadline=None)
def test_every_command_is_allowed_afterwards(
    levels: list[float], velocity: float, acceleration: float
) -> None:
    limits = MotionLimits(velocity, acceleration, -1.0, 1.0)
    assert keeps_to(limits, kept_within(np.repeat(levels, 3), limits, 20.0), 20.0)


def test_an_allowed_command_is_not_touched() -> None:
    limits = MotionLimits(1.0, 5.0, -1.0, 1.0)
    u = 0.5 * np.sin(2 * np.pi * 0.5 * np.arange(41) / 20)
    assert keeps_to(limits, u, 20.0)
    np.testing.assert_allclose(kept_within(u, limits, 20.0), u, atol=1e-12)


def test_a_step_becomes_a_ramp() -> None:
    found = kept_within(np.full(10, 1.0), MotionLimits(1.0, 8.0, -1.0, 1.0), 20.0)
    np.testing.assert_allclose(found, [0.4, 0.8, 1, 1, 1, 1, 1, 1, 0.8, 0.4])


def test_what_is_not_given_is_what_the_records_did(swinging_record: Record) -> None:
    found = limits_for([swinging_record], acceleration=3.0)
    assert found.velocity == np.max(np.abs(swinging_record.u))
    assert found.acceleration == 3.0
    assert (found.lowest, found.highest) == (swinging_record.y.min(), swinging_record.y.max())
    with pytest.raises(InputError, match="give all three"):
        limits_for([], 1.0, 1.0)


@pytest.mark.parametrize(
    ("limits", "says"),
    [((0.0, 1.0, -1.0, 1.0), "velocity"), ((1.0, -1.0, -1.0, 1.0), "acceleration"), ((1, 1, 2, 1), "stroke")],
)
def test_impossible_limits_are_refused(limits: tuple[float, float, float, float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        MotionLimits(*limits)


def test_stroke_is_held_by_all_outputs() -> None:
    limits = MotionLimits(1.0, 1.0, -1.0, 2.0)
    assert limits.hold(np.array([[0.0, 1.9], [-0.9, 0.0]]))
    assert not limits.hold(np.array([[0.0, 1.9], [-1.1, 0.0]]))
