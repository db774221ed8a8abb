"""A limit that no command reached is stated as what it is beyond, never as a value."""

from __future__ import annotations

from bayes_hw.control.plant_summary import Quantity
from bayes_hw.report.design.design_axis_sections import _quantity_row


def test_beyond_the_nearest_end_of_its_interval() -> None:
    limit = Quantity("deg/s", -0.7, -0.72, 0.1, (-1.08, -0.6))
    words, said, interval, unit = _quantity_row("lower saturation limit", limit, unreached=True)
    assert (words, unit) == ("lower saturation limit", "deg/s")
    assert said.startswith("beyond") and "0.6" in said and "0.7" not in said
    assert "1.08" in interval
    assert _quantity_row("lower saturation limit", limit, unreached=False)[1].startswith("\N{MINUS SIGN}0.7")
