"""Columns that nobody named: found where there is one pair, asked for by one option where there are more."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.reading_options import Columns
from bayes_hw.record import Record

RATE_HZ = 20.0
T = np.arange(1500) / RATE_HZ


def axis(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Command, speed and angle of an axis with a lag, begun at 134 deg."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, 30), 50) * np.repeat(rng.integers(0, 2, 60), 25)
    v = np.zeros(len(u))
    for k in range(1, len(u)):
        v[k] = 0.8 * v[k - 1] + 0.2 * u[k - 1]
    return u, v, 134.2 + np.cumsum(v) / RATE_HZ + 3e-4 * rng.standard_normal(len(u))


U, V, Y = axis(1)
OTHER_U, _, OTHER_Y = axis(2)
NOISE = np.random.default_rng(3).standard_normal((2, len(T)))
TEMPERATURE, WIND = 20 + 0.01 * np.cumsum(NOISE[0]), NOISE[1]


def written(path: Path, **columns: FloatArray) -> Path:
    header = ",".join(columns)
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=header, comments="")
    return path


@pytest.mark.parametrize(("columns", "names"), [
    ({"when": T, "a": U, "b": Y}, ("when", "a", "b")),
    ({"b": Y, "a": U, "x": TEMPERATURE, "w": WIND, "s": T}, ("s", "a", "b")),
    ({"t": T, "rate_cmd": U, "enc": Y, "vel_fb": V}, ("t", "rate_cmd", "enc")),
    ({"t": T, "u": U, "angle": Y, "wind": WIND}, ("t", "u", "angle")),
])  # fmt: skip
def test_one_pair_is_taken(
    tmp_path: Path, columns: dict[str, FloatArray], names: tuple[str, str, str]
) -> None:
    record = Record.read(written(tmp_path / "log.csv", **columns))
    assert record.options.columns == Columns(*names)
    np.testing.assert_array_equal(record.u, U)
    np.testing.assert_array_equal(record.y, Y)


@pytest.mark.parametrize(("columns", "asked"), [
    ({"t": T, "a_cmd": U, "a_pos": Y, "b_cmd": OTHER_U, "b_pos": OTHER_Y}, r"output='a_pos'.*output='b_pos'"),
    ({"t": T, "a": U, "b": Y, "c": V}, "which column"),
    ({"t": T, "u": U, "enc_1": Y, "enc_2": Y + 1e-4 * WIND}, r"output='enc_"),
    ({"t": T, "x": WIND, "z": TEMPERATURE}, r"input=\"NAME\".*output=\"NAME\""),
])  # fmt: skip
def test_more_than_one_is_asked_about(tmp_path: Path, columns: dict[str, FloatArray], asked: str) -> None:
    """Two axes in one log whatever their names say; and a speed beside the command."""
    path = written(tmp_path / "log.csv", **columns)
    with pytest.raises(InputError, match=asked):
        Record.read(path)


def test_the_one_option_that_is_asked_for_is_enough(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", t=T, a_cmd=U, a_pos=Y, b_cmd=OTHER_U, b_pos=OTHER_Y)
    record = Record.read(path, columns=Columns(output="b_pos"))
    np.testing.assert_array_equal(record.u, OTHER_U)


def test_the_number_of_a_row_is_no_clock(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", n=np.arange(len(T)), u=U, y=Y)
    with pytest.raises(InputError, match="which column is the clock"):
        Record.read(path)
    record = Record.read(path, sample_rate_hz=RATE_HZ, columns=Columns(None))
    np.testing.assert_array_equal(record.y, Y)


def test_whole_seconds_beside_their_fractions(tmp_path: Path) -> None:
    """Where the fractions are none that is known, neither is the clock; the rate that they have is said."""
    path = written(tmp_path / "log.csv", sec=np.floor(T), ticks=1e9 * (T % 1), u=U, y=Y)
    with pytest.raises(InputError, match="sample_rate_hz=20"):
        Record.read(path)


@pytest.mark.parametrize(("row", "column", "cell"), [(700, 2, "inf"), (3, 1, "off"), (1499, 0, "Total")])
def test_the_cell_that_is_no_number_is_named(tmp_path: Path, row: int, column: int, cell: str) -> None:
    """Not that its column is text, also where columns are to be found."""
    path = written(tmp_path / "log.csv", when=T, a=U, b=Y)
    lines = path.read_text().splitlines()
    cells = lines[row + 1].split(",")
    cells[column] = cell
    path.write_text("\n".join([*lines[: row + 1], ",".join(cells), *lines[row + 2 :]]) + "\n")
    with pytest.raises(InputError, match=rf"row {row + 2}, .*'{cell}' is no number as the others are"):
        Record.read(path)


def test_a_name_that_is_there_twice_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", time=T, vel=U, pos=Y)
    path.write_text("time,pos,pos\n" + path.read_text().split("\n", 1)[1])
    with pytest.raises(InputError, match="column 'pos' is there twice"):
        Record.read(path)
