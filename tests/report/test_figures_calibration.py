from dataclasses import replace

import numpy as np
import pytest
from pages.figures_calibration import (
    IntervalPoint,
    RankPanel,
    ecdf_differences,
    interval_coverage,
    rank_histograms,
)

from bayes_hw.report.page.palette import VERMILLION


@pytest.fixture
def panel():
    counts = np.array([9.0, 11.0, 12.0, 8.0])
    probability = np.array([0.25, 0.5, 0.75])
    difference = np.cumsum(counts)[:-1] / 40 - probability
    bound = np.full(3, 0.2)
    return RankPanel("gain", counts, counts * 0, counts * 2, probability, difference, -bound, bound)


def outside(panel):
    """The same quantity with a heap at both ends."""
    counts = np.array([40.0, 0.0, 0.0, 40.0])
    return replace(panel, label="delay", counts=counts, difference=np.array([0.25, 0.0, -0.25]))


@pytest.mark.parametrize("draw", [ecdf_differences, rank_histograms])
@pytest.mark.usefixtures("wide_only")
def test_curve_outside_its_band_is_coloured_and_named(panel, draw):
    quiet, loud = draw([panel], "here"), draw([panel, outside(panel)], "here")
    assert VERMILLION.lower() not in quiet.svg.lower()
    assert VERMILLION.lower() in loud.svg.lower()
    assert "None leaves its band" in quiet.caption
    assert loud.caption.endswith("Outside here: delay.")


@pytest.mark.parametrize("draw", [pytest.param(ecdf_differences, marks=pytest.mark.slow), rank_histograms])
def test_every_quantity_has_its_panel(panel, draw, labels_of):
    panels = [replace(panel, label=f"quantity {i}") for i in range(6)]
    labels = labels_of(lambda: draw(panels, "six"))
    assert {p.label for p in panels} <= set(labels)
    assert "simultaneous 95\u00a0% band" in labels


@pytest.mark.usefixtures("wide_only")
def test_coverage_names_parameters_and_kinds(labels_of):
    points = [
        IntervalPoint(parameter, kind, nominal, 0.7, 0.6, 0.85)
        for parameter in ("gain", "frequency of mode 1")
        for kind, nominal in (("50 % central", 0.5), ("80 % central", 0.8))
    ]
    labels = labels_of(lambda: interval_coverage(points))
    assert {"gain", "frequency of mode 1", "50 % central", "80 % central"} <= set(labels)
    assert VERMILLION.lower() in interval_coverage(points).svg.lower()
    assert VERMILLION.lower() not in interval_coverage(points[1::2]).svg.lower()
