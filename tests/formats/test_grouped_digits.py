"""Digits in groups of three: the number that was written, and none where a fraction may have been meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.formats.grouped_digits import GROUPED, decimal_sign, without_groups
from bayes_hw.record import Record

STYLES = [(".", ","), (",", "."), (" ", ","), ("'", "."), ("\u202f", ","), ("\u00a0", ",")]


def written(value: float, group: str, decimal: str, digits: int = 3) -> str:
    return f"{value:,.{digits}f}".translate(str.maketrans({",": group, ".": decimal}))


@pytest.mark.parametrize(("group", "decimal"), STYLES)
@given(values=st.lists(st.integers(-(10**9), 10**9), min_size=1, max_size=20))
def test_a_column_is_what_was_written(group: str, decimal: str, values: list[int]) -> None:
    cells = [written(value / 1000, group, decimal) for value in values]
    plain = [float(cell.replace(",", ".")) for cell in without_groups(cells)]
    assert plain == [value / 1000 for value in values]
    for cell, value in zip(cells, values, strict=True):
        assert bool(GROUPED.fullmatch(cell)) == (abs(value) >= 10**6)
        assert decimal_sign(cell) == (decimal if abs(value) >= 10**6 else "")


def test_a_fraction_of_three_digits_stays_one() -> None:
    """Unless the column says that the sign groups; where it says both, it does not."""
    assert without_groups(["1.234", "0.500"]) == ["1.234", "0.500"]
    assert without_groups(["1.234", "1.234.567"]) == ["1234", "1234567"]
    assert without_groups(["1.234", "1.2", "1.234,5"]) == ["1.234", "1.2", "1234.5"]


@pytest.mark.parametrize(("group", "decimal"), STYLES)
def test_a_log_with_grouped_digits(tmp_path: Path, group: str, decimal: str) -> None:
    """Milliseconds and angles beyond a thousand, and counts that are groups only."""
    t = np.arange(400) / 20
    u = np.round(90 * np.sin(0.9 * t), 3)
    y = np.round(1000 + np.cumsum(u) / 20, 3)
    cells = ([written(value, group, decimal) for value in column] for column in (1000 * t, u, y))
    rows = "\n".join(f"{a}\t{b}\t{c}" for a, b, c in zip(*cells, strict=True))
    (tmp_path / "log.txt").write_text(f"t [ms]\tu [deg/s]\ty [deg]\n{rows}\n")
    record = Record.read(tmp_path / "log.txt")
    np.testing.assert_allclose(record.t, t, atol=1e-12)
    np.testing.assert_array_equal(record.u, u)
    np.testing.assert_array_equal(record.y, y)
