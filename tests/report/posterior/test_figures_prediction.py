from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.record import Units
from bayes_hw.report.posterior.figures_prediction import (
    Coverage,
    PredictedRecord,
    coverage,
    predicted_overview,
    predicted_record,
)


@pytest.fixture
def record():
    t = np.arange(40_000) / 20
    mean = np.sin(t)
    y = mean + 0.01 * np.random.default_rng(0).normal(size=len(t))
    bands = (mean - 0.01, mean + 0.01, mean - 0.02, mean + 0.02)
    return PredictedRecord("<b>$hold", t, y, mean, *bands, Units(input="V", output="<mm>"))


def test_prediction_states_level_units_and_both_bands(record, labels_of):
    labels = labels_of(lambda: predicted_record(record, (100.0, 110.0)))
    assert {"output (<mm>)", "residual (<mm>)", "time from first sample (s)", "record", "prediction"} <= set(
        labels
    )
    assert {"94\u00a0% with noise", "94\u00a0% parameters alone"} <= set(labels)
    assert "100 to 110 s, shaded above" in labels


@pytest.mark.slow
@pytest.mark.usefixtures("wide_only")
def test_long_record_makes_a_small_picture_the_same_each_time(record):
    first = predicted_record(record, (100.0, 110.0))
    assert len(first.svg) < 400_000
    assert predicted_record(record, (100.0, 110.0)).svg == first.svg
    assert "“<b>$hold”" in first.caption


@pytest.mark.slow
def test_overview_is_not_flattened_by_wide_bands(record, labels_of):
    """Bands a thousand times as wide as the record leave its scale readable."""
    wide = replace(record, noise_lower=record.mean - 1000, noise_upper=record.mean + 1000)
    labels = labels_of(lambda: predicted_overview(wide))
    assert {"output (<mm>)", "residual (<mm>)", "time from first sample (s)"} <= set(labels)
    assert not {"−500", "−1000"} & set(labels)


def test_stretch_keeps_every_series_together(record):
    part = record.within(10.0, 20.0)
    assert len(part.t) == len(part.y) == len(part.noise_upper) == 201
    assert part.units == record.units


def test_coverage_names_rows_and_kind_of_interval(labels_of):
    rows = [Coverage("validation 1", 0.94, 0.93, 0.92, 0.94), Coverage("b", 0.5, 0.52, 0.5, 0.54)]
    labels = labels_of(lambda: coverage(rows))
    assert {"validation 1", "b", "coverage (%)", "nominal", "achieved"} <= set(labels)
    assert "95 % binomial interval" in labels
