"""Coherence of further columns with the error: seen where there is some, silent where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.known_columns import KnownColumn, known_columns
from bayes_hw.record import Record, Units

RATE = 20.0


def columns(strength: float, seed: int, left: float = 0.0) -> tuple[KnownColumn, ...]:
    """Of an error that follows a wind below 0.5 Hz by `strength`, and `left` of the command, beside noise."""
    rng = np.random.default_rng(seed)
    records, errors, commands = [], list[FloatArray](), list[FloatArray]()
    for samples in (2000, 900):
        wind = signal.lfilter([0.2], [1.0, -0.8], rng.standard_normal(samples))
        slow = signal.lfilter(*signal.butter(2, 0.5, fs=RATE), wind)
        noise = signal.lfilter([0.05], [1.0, -0.9], rng.standard_normal(samples))
        commands.append(signal.lfilter([0.2], [1.0, -0.8], rng.standard_normal(samples)))
        errors.append(strength * slow + left * commands[-1] + noise)
        t = np.arange(samples) / RATE
        records.append(Record("r", t, t, t, RATE, Units(), known={"wind": wind, "off": np.ones(samples)}))
    return known_columns(records, errors, commands, RATE)


def test_a_column_that_acts_is_seen_where_it_acts() -> None:
    (wind,) = columns(1.0, 1)
    assert wind.name == "wind" and wind.follows
    assert wind.strongest_hz < 0.8
    assert 0.2 < wind.share < 0.9
    assert wind.coherence[wind.frequency_hz > 3].max() < wind.bound + 0.1


def test_what_the_error_holds_of_the_command_hides_no_column() -> None:
    (plain,), (beside) = columns(1.0, 1), columns(1.0, 1, left=20.0)
    assert beside[0].coherence.max() == pytest.approx(plain.coherence.max(), abs=0.02)


def test_a_column_that_does_not_act_is_silent() -> None:
    """Of 60 unrelated columns at most three exceed the bound of one in a hundred."""
    found = [columns(0.0, seed)[0] for seed in range(60)]
    assert sum(column.follows for column in found) <= 3
    assert np.mean([column.share for column in found]) < 0.1
