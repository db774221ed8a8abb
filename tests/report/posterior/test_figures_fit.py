"""The figure of a record beside its simulation shows both and their difference, in the record's units."""

from __future__ import annotations

import numpy as np

from bayes_hw.record import Record
from bayes_hw.report.posterior.figures_prediction import fit_canvas


def test_it_draws_record_model_and_difference(small_record: Record) -> None:
    simulated = 0.9 * small_record.y
    whole, residual = fit_canvas(small_record, simulated).axes
    record, model = whole.get_lines()
    np.testing.assert_array_equal(record.get_ydata(), small_record.y)
    np.testing.assert_array_equal(model.get_ydata(), simulated)
    np.testing.assert_array_equal(residual.get_lines()[0].get_ydata(), small_record.y - simulated)
    assert whole.get_ylabel() == "output (deg)" and residual.get_xlabel() == "time from first sample (s)"
