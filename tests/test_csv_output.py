"""A table of numbers is read back to the same bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from bayes_hw.files import write_csv


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(arrays.arrays(np.float64, (5, 2), elements=st.floats(allow_nan=False, allow_infinity=False, width=64)))
def test_every_number_survives(tmp_path: Path, values: np.ndarray) -> None:
    path = tmp_path / "deep" / "table.csv"
    write_csv(path, {"a": values[:, 0], "b": values[:, 1]})
    header, *rows = path.read_text().splitlines()
    assert header == "a,b"
    np.testing.assert_array_equal([[float(cell) for cell in row.split(",")] for row in rows], values)
