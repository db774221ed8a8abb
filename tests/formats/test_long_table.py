"""Long tables: a row a value becomes a column a signal; a log with the state of the axis in it stays one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.formats.long_table import long_columns
from bayes_hw.formats.readers import read_table

ROWS = 40


def written(path: Path, separator: str = ",", header: str = "time,signal,value", late: bool = False) -> Path:
    lines = [header.replace(",", separator)]
    for i in range(ROWS):
        lines.append(separator.join([f"{i / 20:.2f}", "cmd", f"{i * 0.5}"]))
        lines.append(separator.join([f"{i / 20 + 0.01 * late:.2f}", "pos", f"{100 + i}"]))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_signals_become_columns_with_one_clock(tmp_path: Path, separator: str) -> None:
    path = written(tmp_path / "log.csv", separator)
    table = read_table(path, ("time", "cmd", "pos"), ("time",), most_rows=1000)
    assert table.names == ("time", "cmd", "pos") and not table.clocks and not table.missing
    np.testing.assert_allclose(table.values["time"], np.arange(ROWS) / 20)
    np.testing.assert_allclose(table.values["pos"], 100 + np.arange(ROWS))


def test_signals_of_other_stamps_keep_them(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", late=True)
    table = read_table(path, ("time", "cmd", "pos"), ("time",), most_rows=1000)
    assert "time" not in table.values
    np.testing.assert_allclose(table.clocks["pos"], np.arange(ROWS) / 20 + 0.01)
    np.testing.assert_allclose(table.clocks["cmd"], np.arange(ROWS) / 20)


def test_a_state_that_rarely_changes_is_a_column_like_others(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{i / 20},{'SLEW' if i > 20 else 'IDLE'},{i}" for i in range(ROWS)]
    path.write_text("time,state,actual\n" + "\n".join(rows) + "\n")
    assert long_columns(path) is None
    table = read_table(path, ("time", "actual"), ("time",), most_rows=100)
    assert len(table.values["actual"]) == ROWS


def test_a_value_that_is_no_number_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv")
    rows = "".join(f"{i},cmd,{i}\n{i},pos,{i}\n" for i in range(300, 600))
    path.write_text(path.read_text() + rows + "9,pos,stuck\n")
    with pytest.raises(InputError, match=r"'pos', value 341: 'stuck' is not a finite number"):
        read_table(path, ("time", "pos"), ("time",), most_rows=1000)
    assert len(read_table(path, ("time", "cmd"), ("time",), most_rows=1000).values["cmd"]) == 340
