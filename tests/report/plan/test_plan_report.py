"""The page of a plan says what is played, when, how much of the axis it takes, how often it is read."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.first_look.plan import AxisLimits, plan
from bayes_hw.provenance import provenance
from bayes_hw.report.page.document import Report, Table
from bayes_hw.report.plan.plan_report import plan_report

LIMITS = AxisLimits(0.5, 2.0, -5.0, 5.0, 0.113)


def page(rate: float) -> Report:
    found = plan(LIMITS, np.random.default_rng(1), sample_rate_hz=rate, highest_hz=4.0, duration_s=240)
    return plan_report(found, LIMITS, provenance("bayes-hw plan", 1, [], 1.0))


@pytest.mark.slow
def test_parts_stand_in_the_order_in_which_they_are_played() -> None:
    report = page(20.0)
    (table,) = report.sections[0].blocks
    assert isinstance(table, Table)
    assert [row[0] for row in table.rows if row[0] != "rest"] == [
        "small sweep",
        "full sweep",
        "slow triangles",
        "steps",
    ]
    largest = {row[0]: row[3] for row in table.rows}
    assert largest["rest"] == "0.00" and float(largest["full sweep"]) <= LIMITS.velocity
    assert float(largest["small sweep"]) == pytest.approx(0.3 * LIMITS.velocity, rel=0.05)
    assert "10 min 10 s in all" in report.verdict


def test_cards_say_how_much_of_the_axis_is_taken() -> None:
    cards = {badge.label: badge.detail for badge in page(20.0).badges}
    assert cards["largest command"].endswith("of 0.500 allowed")
    assert cards["largest change in 1 s"].endswith("of 2.00 allowed")
    assert "5 samples in a cycle of 4 Hz" in cards["rate"]
