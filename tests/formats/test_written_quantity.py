"""Sexagesimal angles and numbers with a unit in their cells: their value, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.formats.csv_file import read_csv
from bayes_hw.formats.header import quantity_of


@pytest.mark.parametrize(("cell", "value", "unit"), [
    ("12:30:36", 12.51, None),
    ("-0:00:36.0", -0.01, None),
    ("134:11:60.0000", 134.2, None),
    ("+12 30 36", 12.51, None),
    ("12d30m36s", 12.51, "deg"),
    ("12°30'36.00\"", 12.51, "deg"),
    ("1h02m03s", 15.5125, "deg"),
    ("0.5 deg/s", 0.5, "deg/s"),
    ("-3,25°", -3.25, "°"),
    ("1e-3rad", 1e-3, "rad"),
])  # fmt: skip
def test_a_quantity_is_its_value_and_unit(cell: str, value: float, unit: str | None) -> None:
    found = quantity_of(cell)
    assert found is not None and found.unit == unit
    assert found.value == pytest.approx(value)


@pytest.mark.parametrize(
    "cell", ["", "IDLE", "12:61:00", "12:30", "deg", "2026-03-01", "1.2.3 deg", "12:00:00:00"]
)
def test_other_text_is_none(cell: str) -> None:
    assert quantity_of(cell) is None


@given(st.floats(-359.0, 359.0).filter(lambda angle: abs(angle) > 1e-3))
def test_an_angle_comes_back_from_its_sexagesimal_form(angle: float) -> None:
    size = abs(angle)
    whole, minutes = int(size), int(size * 60) % 60
    seconds = (size * 60 - int(size * 60)) * 60
    found = quantity_of(f"{'-' if angle < 0 else ''}{whole}:{minutes:02d}:{seconds:09.6f}")
    assert found is not None and found.value == pytest.approx(angle, abs=1e-8)


def test_a_column_of_them_states_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,u,y\n0,0.1 deg/s,10:00:00\n1,0.2 deg/s,10:00:36\n2,,10:01:12\n")
    table = read_csv(path, ("u", "y"), most_rows=10)
    np.testing.assert_allclose(table.values["u"], [0.1, 0.2, np.nan])
    np.testing.assert_allclose(table.values["y"], [10, 10.01, 10.02])
    assert table.units == {"u": "deg/s"}


def test_units_that_change_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,u\n0,0.1 deg/s\n1,0.2 rad/s\n")
    with pytest.raises(InputError, match=r"row 3, column 'u': '0.2 rad/s' is in another unit"):
        read_csv(path, ("u",), most_rows=10)
