"""Deviations keep their order when the truth is negative, and an interval beside the truth is a miss."""

from __future__ import annotations

import pytest
from pages.two_axes_report import AxisParameter, IdentifiedAxis

BELOW = AxisParameter(-2.0, -2.2, 0.1, (-2.4, -2.1), "deg/s")
AROUND = AxisParameter(4.0, 4.2, 0.2, (3.9, 4.5), "Hz")


def test_relative_deviation_of_a_negative_parameter() -> None:
    assert BELOW.relative == pytest.approx((0.1, 0.05, 0.2))


def test_missed_parameters() -> None:
    axis = IdentifiedAxis("azimuth", 94.0, True, True, 9, {"below": BELOW, "around": AROUND})
    assert axis.missed == ("below",)
