"""The offset between two clocks from a signal in both files: right, and as sure as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.log.clock_offset import clock_offset
from bayes_hw.record import Columns, ReadingOptions, Record


def signal(t: np.ndarray) -> np.ndarray:
    return 3 * np.sin(0.7 * t) + 0.5 * np.sin(2.9 * t + 1)


@pytest.mark.parametrize(
    ("count", "fewest", "most"), [(25, 20, 25), pytest.param(100, 87, 99, marks=pytest.mark.slow)]
)
def test_intervals_hold_as_often_as_they_say(count: int, fewest: int, most: int) -> None:
    """White noise on one, correlated noise on the other, clocks of other rates: 94 % within binomial
    error."""
    held = 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        t = np.arange(2000) / 50
        when = np.arange(900) / 23 + 0.003
        offset = rng.uniform(-0.3, 0.3)
        slow = np.convolve(rng.standard_normal(len(when) + 4), np.ones(5), mode="valid")
        a = signal(t) + 0.02 * rng.standard_normal(len(t))
        b = signal(when - offset) + 0.01 * slow
        low, high = clock_offset(t, a, when, b).interval
        held += int(low <= offset <= high)
    assert fewest <= held <= most


def test_signals_that_do_not_agree_are_refused() -> None:
    t = np.arange(1000) / 20
    noise = np.random.default_rng(1).standard_normal(1000)
    with pytest.raises(InputError, match="agree at no offset"):
        clock_offset(t, signal(t), t, noise)
    with pytest.raises(InputError, match="does not move"):
        clock_offset(t, signal(t), t, 0 * noise)


def test_a_joined_file_is_put_on_the_clock_of_the_record(tmp_path: Path) -> None:
    """By the temperature that both files log, the angle of the second is where it belongs."""
    t, rng = np.arange(1200) / 20, np.random.default_rng(3)
    u = np.convolve(rng.standard_normal(1299), np.hanning(100) / 10, mode="valid")
    y = np.concatenate([[0.0], np.cumsum(u[:-1]) / 20])
    when = np.arange(2400) / 40 + 0.01
    rows = np.column_stack([t, u, signal(t)])
    np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="t,cmd,temp", comments="")
    late = np.column_stack([when + 0.08, np.interp(when, t, y), signal(when)])
    np.savetxt(tmp_path / "b.csv", late, "%.9g", ",", header="t,enc,temp", comments="")
    columns = Columns("t", "cmd", "enc")
    options = ReadingOptions(columns=columns, join=(tmp_path / "b.csv",), clock_offset="temp")
    record = Record.read(tmp_path / "a.csv", options=options)
    kept = np.searchsorted(t, record.t)
    np.testing.assert_allclose(record.y, y[kept], atol=2e-3)
    assert any("ahead by 80" in said and "(94 %)" in said for said in record.treatment)
    with pytest.raises(InputError, match=r"no column 'wind', which .*clock_offset.* compares"):
        Record.read(
            tmp_path / "a.csv",
            options=ReadingOptions(columns=columns, join=(tmp_path / "b.csv",), clock_offset="wind"),
        )
