"""Marks for what was not measured are found and left out, at both doors; glitches and wraps are none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record import Record
from bayes_hw.unmeasured import mark_of_angle, mark_of_command

T = np.arange(1600) / 20
RNG = np.random.default_rng(12)
U = np.repeat(RNG.uniform(-1.5, 1.5, 80), 20)
Y = 134.2 + np.cumsum(U) / 20 + 2e-4 * RNG.standard_normal(len(T))
LOST = [300, 700, 701]


def log(path: Path, u: np.ndarray, y: np.ndarray) -> str:
    np.savetxt(path, np.column_stack([T, u, y]), delimiter=",", fmt="%.9g", header="t,u,y", comments="")
    return str(path)


def marked(values: np.ndarray, reading: float, at: list[int] = LOST) -> np.ndarray:
    return np.where(np.isin(np.arange(len(values)), at), reading, values)


@pytest.mark.parametrize("reading", [-999.0, 9999.0, -1.0, 0.0, -32768.0, 1e20])
def test_a_mark_is_named_and_left_out_by_the_option_named(
    tmp_path: Path, reading: float, capsys: pytest.CaptureFixture[str]
) -> None:
    path = log(tmp_path / "log.csv", U, marked(Y, reading))
    value = f"{reading:.0f}"
    for command in ("identify", "look", "convert"):
        assert main([command, path, "--out", str(tmp_path / "out.csv")]) == 2
        error = capsys.readouterr().err
        assert f"row 302, column 'y': 3 samples read exactly {value}," in error
        assert f"give --missing {value} (" in error
    with pytest.raises(InputError, match=rf"give options=ReadingOptions\(missing=\({value},\)\)"):
        Record.read(path)
    record = Record.read(path, options=ReadingOptions(missing=(reading,)))
    assert np.flatnonzero(~record.measured_samples).tolist() == LOST
    np.testing.assert_allclose(record.u, U, rtol=1e-8)
    assert main(["inspect", path]) == 0
    assert f"--missing {value} --out" in capsys.readouterr().out
    assert main(["convert", path, "--missing", value, "--out", str(tmp_path / "out.csv")]) == 0


def test_a_reading_that_is_one(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", U, marked(Y, -999))
    assert main(["convert", path, "--missing", "none", "--out", str(tmp_path / "out.csv")]) == 0


def test_a_mark_in_memory() -> None:
    with pytest.raises(
        InputError, match=r"sample 301: 3 samples .* options=ReadingOptions\(missing=\(-999,\)\)"
    ):
        Record.from_arrays(T, U, marked(Y, -999))
    record = Record.from_arrays(T, U, marked(Y, -999), options=ReadingOptions(missing=(-999,)))
    assert (~record.measured_samples).sum() == 3


def test_a_mark_in_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = log(tmp_path / "log.csv", marked(U, -999), Y)
    assert main(["convert", path, "--out", str(tmp_path / "out.csv")]) == 2
    assert "column 'u': 3 samples read exactly -999" in capsys.readouterr().err
    record = Record.read(path, options=ReadingOptions(missing=(-999,), gaps="bridge"))
    assert np.abs(record.u).max() < 1.5


def test_a_command_of_zero_is_one_where_an_angle_of_zero_is_none(tmp_path: Path) -> None:
    still = np.where(T < 10, 0.0, U)
    path = log(tmp_path / "log.csv", still, marked(Y, 0))
    record = Record.read(path, options=ReadingOptions(missing=(0,)))
    assert np.flatnonzero(~record.measured_samples).tolist() == LOST


def test_long_stretches_at_the_ends_of_a_converter(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They stay in the record, as the command is known there; nothing is found in it then."""
    low, high = np.quantile(Y, (0.12, 0.75))
    path = log(tmp_path / "log.csv", U, np.clip(Y, low, high))
    assert main(["inspect", path]) == 0
    printed = capsys.readouterr().out
    assert "give --missing ends" in printed and "--missing ends --out" in printed
    record = Record.read(path, options=ReadingOptions(missing=("ends",)))
    assert (~record.measured_samples).mean() > 0.2 and len(record) == len(T)
    assert record.findings() == ()
    assert main(["convert", path, "--out", str(tmp_path / "out.csv")]) == 0
    shown = capsys.readouterr()
    assert "give --missing ends" in shown.err
    assert f"next: bayes-hw convert {path} --missing ends" in shown.out


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    glitches=st.integers(0, 6),
    step=st.sampled_from([0.0, 1e-3, 0.01, 0.1]),
    size=st.sampled_from([0.05, 1.0, 5.0]),
    turn=st.sampled_from([0.0, 360.0]),
)
def test_glitches_and_wraps_are_no_marks(
    seed: int, glitches: int, step: float, size: float, turn: float
) -> None:
    rng = np.random.default_rng(seed)
    y = np.cumsum(np.repeat(rng.uniform(-2, 2, 30), 50)) / 50 + rng.normal(0, 3e-4, 1500)
    y[rng.integers(0, 1500, glitches)] += size * rng.uniform(0.5, 2, glitches)
    y = np.round(y / step) * step if step else y
    assert mark_of_angle((y + turn) % turn if turn else y) is None


@pytest.mark.parametrize("pulse", [0.05, 1.0, 999.0])
def test_pulses_of_a_command_are_no_marks(pulse: float) -> None:
    u = marked(np.zeros(500), pulse, [100, 101, 300])
    assert mark_of_command(u) is None or pulse == 999.0


def test_no_reading_is_refused() -> None:
    with pytest.raises(InputError, match=r'missing=\("blue",\).: give a reading such as -999'):
        Record.from_arrays(T, U, Y, options=ReadingOptions(missing=("blue",)))
