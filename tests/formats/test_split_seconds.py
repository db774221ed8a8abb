"""Seconds and nanoseconds in two columns are one clock, to the nanosecond."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bayes_hw.formats.readers import read_table
from bayes_hw.formats.split_seconds import halves_of, split_clocks, with_split_clocks
from bayes_hw.inspection.inspected_file import inspect_file
from bayes_hw.reading_options import Columns
from bayes_hw.record import Record

ROWS, STEP_NS = 200, 49_999_983
START_NS = 1_730_673_667 * 10**9 + 123_456_789
STAMPS = START_NS + STEP_NS * np.arange(ROWS, dtype=np.int64)
U = np.round(np.sin(np.arange(ROWS) / 20), 4)
Y = np.round(134.2 + np.cumsum(U) / 20, 4)


def table(names: tuple[str, str], per_second: int = 10**9) -> pd.DataFrame:
    small = STAMPS % 10**9 // (10**9 // per_second)
    return pd.DataFrame({names[0]: STAMPS // 10**9, names[1]: small, "cmd": U, "pos": Y})


@pytest.mark.parametrize(
    ("names", "per_second"),
    [
        (("sec", "nsec"), 10**9),
        (("field.header.stamp.secs", "field.header.stamp.nsecs"), 10**9),
        (("stamp_sec", "stamp_nanosec"), 10**9),
        (("seconds", "Nanoseconds"), 10**9),
        (("tv_sec", "tv_usec"), 10**6),
    ],
)
def test_two_columns_are_one_clock(tmp_path: Path, names: tuple[str, str], per_second: int) -> None:
    path = tmp_path / "axis.csv"
    given = table(names, per_second)
    given.to_csv(path, index=False)
    time = "+".join(names)
    exact = (STAMPS // (10**9 // per_second)).tolist()
    assert read_table(path, [time, "cmd"], [time], most_rows=1000).values[time].tolist() == exact
    record = Record.read(path)
    assert record.sample_rate_hz == pytest.approx(1e9 / STEP_NS, rel=1e-9 if per_second == 10**9 else 1e-5)
    np.testing.assert_array_equal(record.y, Y)
    assert f"--time {time} " in inspect_file(path).command(path)
    named = Record.read(path, columns=Columns(time=time, input="cmd", output="pos"))
    np.testing.assert_array_equal(named.t, record.t)
    np.testing.assert_array_equal(Record.from_dataframe(given).t, record.t)


def test_a_clock_of_a_message_before_another_of_the_log(tmp_path: Path) -> None:
    """The stamp in two columns stands nearer to the signals; when they were written does not matter."""
    path = tmp_path / "axis.csv"
    given = table(("stamp.secs", "stamp.nsecs"))
    given.insert(0, "time", STAMPS + 3_000_000 + np.arange(ROWS) % 3 * 10**6)
    given.to_csv(path, index=False)
    found = Record.read(path)
    assert found.options is not None and found.options.columns.time == "stamp.secs+stamp.nsecs"
    np.testing.assert_array_equal(found.u, U)


def test_columns_that_are_no_clock_stay_as_they_are(tmp_path: Path) -> None:
    assert split_clocks(["nsec", "u"]) == [] and halves_of("a+b") is None
    path = tmp_path / "axis.csv"
    given = table(("sec", "nsec"))
    given["nsec"] *= 3  # beyond a second
    given.to_csv(path, index=False)
    found = read_table(path, ["sec", "nsec"], [], most_rows=1000)
    assert set(with_split_clocks(found).values) == {"sec", "nsec"}
