"""Timetables and tables of MATLAB's: read with their row times and units, within limits, else refused."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.formats import timetable_file
from bayes_hw.formats.readers import read_table
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record import Columns, Record

matio = pytest.importorskip("matio")
pd = pytest.importorskip("pandas")

COMMAND = np.sin(np.arange(120) / 9)
ANGLE = np.cumsum(COMMAND) / 20


def frame(index: object = None) -> pd.DataFrame:
    found = pd.DataFrame({"az_cmd": COMMAND, "az_pos": ANGLE}, index=index)
    found.index.name = "Time"
    return found


def written(path: Path, version: str = "v7", **variables: object) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        matio.save_to_mat(str(path), variables, version=version)
    return path


DATES = pd.date_range("2026-03-01 12:00:00", periods=120, freq="50ms")
DURATIONS = pd.to_timedelta(np.arange(120) * 0.05, unit="s")
OPTIONS = ReadingOptions(columns=Columns(time="Time", input="az_cmd", output="az_pos"))


@pytest.mark.parametrize(("version", "index"), [("v7", DATES), ("v7.3", DURATIONS)])
def test_a_timetable_is_read_as_a_record(tmp_path: Path, version: str, index: object) -> None:
    path = written(tmp_path / "night.mat", version, log=frame(index))
    record = Record.read(path, options=OPTIONS)
    assert record.sample_rate_hz == pytest.approx(20.0)
    np.testing.assert_array_equal(record.u, COMMAND)
    np.testing.assert_allclose(record.y, ANGLE - ANGLE[0], atol=1e-12)


@pytest.mark.usefixtures("tried_here")
def test_row_times_stand_for_a_clock_that_is_no_column(tmp_path: Path) -> None:
    path = written(tmp_path / "night.mat", log=frame(DATES))
    table = read_table(path, ("t", "az_cmd", "speed"), ("t",), most_rows=100)
    assert table.missing == ("speed",) and table.names == ("Time", "az_cmd", "az_pos")
    assert table.units["t"] == "ns" and len(table.values["t"]) == 100
    assert np.all(np.diff(table.values["t"]) == 50_000_000)


@pytest.mark.usefixtures("tried_here")
def test_a_table_has_columns_alone(tmp_path: Path) -> None:
    table = frame().reset_index(drop=True)
    table.insert(0, "t", np.arange(120) * 0.05)
    path = written(tmp_path / "night.mat", log=table, gain=np.array([[2.0]]))
    found = read_table(path, ("t", "az_cmd"), ("t",), most_rows=1000)
    np.testing.assert_allclose(found.values["t"], np.arange(120) * 0.05)
    assert not read_table(path, ("x", "az_cmd"), ("x",), most_rows=10).values.keys() & {"x"}


def test_stated_units_go_with_their_columns() -> None:
    with_units = frame(DURATIONS)
    with_units.attrs["varUnits"] = [np.array(["deg/s"]), np.array([["deg"]])]
    assert timetable_file._columns(with_units)[1] == {"az_cmd": "deg/s", "az_pos": "deg"}


def test_without_the_library_the_extra_and_the_export_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "night.mat", log=frame(DATES))
    monkeypatch.setattr(timetable_file, "can_read_timetables", lambda: False)
    with pytest.raises(InputError, match=r"bayes-hw\[matlab\].*writetimetable\(log, 'night.csv'\)"):
        read_table(path, ("t", "u"), ("t",), most_rows=10)


def test_a_damaged_timetable_is_refused_in_one_line(tmp_path: Path) -> None:
    path = written(tmp_path / "night.mat", log=frame(DATES))
    content = bytearray(path.read_bytes())
    content[-400:-200] = b"\x07" * 200
    path.write_bytes(bytes(content))
    with pytest.raises(InputError) as met:
        read_table(path, ("t", "az_cmd"), ("t",), most_rows=10)
    assert "\n" not in str(met.value) and "night" in str(met.value)


@pytest.mark.usefixtures("tried_here")
def test_infinite_numbers_are_named_by_row(tmp_path: Path) -> None:
    broken = frame(DURATIONS)
    broken.iloc[7, 1] = np.inf
    path = written(tmp_path / "night.mat", log=broken)
    with pytest.raises(InputError, match=r"row 8.*'az_pos'"):
        read_table(path, ("t", "az_cmd", "az_pos"), ("t",), most_rows=1000)
