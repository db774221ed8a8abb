"""Lines that name their values become columns, whatever the program that printed them."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.formats.key_values import holds_key_values, named_values
from bayes_hw.formats.readers import read_table
from bayes_hw.record import Record

ROWS, RATE = 200, 20.0
START = dt.datetime(2026, 11, 13, 22, 41, 7, tzinfo=dt.UTC)
T = np.arange(ROWS) / RATE
U = np.round(np.sin(T), 4)
Y = np.round(134.2 + np.cumsum(U) / RATE, 4)


def stamp(index: int) -> str:
    return f"{START + dt.timedelta(seconds=index / RATE):%Y-%m-%d %H:%M:%S.%f}"[:-3]


LINES: dict[str, Callable[[int], str]] = {
    "blanks": lambda i: f"t={T[i]:.3f} u={U[i]} y={Y[i]}",
    "commas": lambda i: f"t: {T[i]:.3f}, u: {U[i]}, y: {Y[i]}",
    "decimal commas": lambda i: f"t={T[i]:.3f} u={U[i]} y={Y[i]}".replace(".", ","),
    "units": lambda i: f"t={T[i]:.3f}s u={U[i]}deg/s y={Y[i]}°;",
    "log4j": lambda i: f"{stamp(i).replace('.', ',')} [Thread-3] DEBUG o.t.Loop:131 - u={U[i]}, y={Y[i]}",
    "ros": lambda i: f"[INFO] [{START.timestamp() + T[i]:.6f}]: u={U[i]} y={Y[i]}",
    "logfmt": lambda i: f'level=info ts={stamp(i).replace(" ", "T")}Z msg="servo tick" u={U[i]} y={Y[i]}',
    "influx": lambda i: (
        f"axis,host=pi u={U[i]},y={Y[i]} {(round(START.timestamp() * 1000) + 50 * i) * 10**6}"
    ),
    "by turns": lambda i: f"{stamp(i)} u={U[i]}\n{stamp(i)} y={Y[i]}",
    "two columns": lambda i: f"sec={1000 + i // 20} nsec={i % 20 * 50_000_000} u={U[i]} y={Y[i]}",
    "other messages": lambda i: (
        f"{stamp(i)} u={U[i]} y={Y[i]}\n" + f"{stamp(i)} the dome is slow\n" * (i % 9 == 4)
    ),
}


@pytest.mark.parametrize("kind", LINES)
def test_lines_become_a_record(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "axis.log"
    path.write_text("\n".join(map(LINES[kind], range(ROWS))) + "\n")
    record = Record.read(path)
    np.testing.assert_allclose(record.t - record.t[0], T, atol=1e-6)
    np.testing.assert_array_equal(record.u, U)
    np.testing.assert_array_equal(record.y, Y)
    assert "lines of names and values" in record.treatment
    assert ("22 lines that name no number left out" in record.treatment) == (kind == "other messages")


def test_two_axes_in_one_log_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "axis.log"
    lines = [f"{stamp(i)} {axis}: cmd={U[i] + n}" for i in range(ROWS) for n, axis in enumerate(("az", "el"))]
    path.write_text("\n".join(lines) + "\n")
    table = read_table(path, ("time", "az.cmd", "el.cmd"), ("time",), most_rows=1000)
    assert table.names == ("time", "az.cmd", "el.cmd")
    np.testing.assert_allclose(table.values["el.cmd"], U + 1)


def test_a_log_without_stamps_asks_for_the_rate(tmp_path: Path) -> None:
    path = tmp_path / "axis.log"
    path.write_text("".join(f"u:{U[i]},y:{Y[i]}\n" for i in range(ROWS)))
    with pytest.raises(InputError, match="which column is the clock"):
        Record.read(path)


def test_what_is_no_pair() -> None:
    """Times of day, addresses, words and versions."""
    assert named_values("22:41:07 INFO host=10.0.0.1 state=TRACK ver=1.2.3 2026-11-03T22:41:07Z") is None
    found = named_values("22:41:07.05 az u=nan y=1e-3deg")
    assert found is not None and found.stamp == "22:41:07.05" and found.word == "az"
    assert found.pairs == (("u", "nan", ""), ("y", "1e-3", "deg"))


def test_a_table_with_a_header_of_pairs_is_a_table(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    header = "".join(f"# gain{i}: {i}\n" for i in range(30))
    path.write_text(header + "t,u,y\n" + "".join(f"{T[i]},{U[i]},{Y[i]}\n" for i in range(ROWS)))
    assert not holds_key_values(path)
    np.testing.assert_array_equal(Record.read(path).y, Y)
