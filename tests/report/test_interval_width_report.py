"""The slope over length is that of a power law, whatever the other series say."""

from __future__ import annotations

import pytest
from pages.interval_width_report import Experiment, ParameterWidth, slope_over_length


def experiment(series: str, setting: float, half_width: float) -> Experiment:
    widths = {"gain": ParameterWidth(half_width, -2.0, "identified", "")}
    return Experiment(series, "", setting, (-1.0, 1.0), 0.0, True, widths)


def test_slope_of_a_power_law() -> None:
    lengths = (30.0, 60.0, 240.0)
    law = [experiment("length", length, 3.0 * length**-0.7) for length in lengths]
    assert slope_over_length([*law, experiment("amplitude", 10.0, 1e6)], "gain") == pytest.approx(-0.7)


def test_relative_width_of_a_negative_parameter_is_positive() -> None:
    assert experiment("length", 1.0, 0.5).widths["gain"].relative == 0.25
