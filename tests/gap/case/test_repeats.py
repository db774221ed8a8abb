"""The noise floor from repeats: that of the noise, whatever the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import RATE, white
from fitted import AXIS

from bayes_hw.gap.case.repeats import period_of, repeated_floor, repeats
from bayes_hw.record import Record

N = 4000
T = np.arange(N) / RATE


def record(name: str, frequency: float, seed: int, sigma: float) -> Record:
    """A sweep as the command, its answer with noise."""
    u = np.sin(2 * np.pi * frequency * T * (1 + T / T[-1]))
    return Record(name, T, u, 3 * u + white(N, sigma, seed), RATE, AXIS.units)


def test_the_floor_is_the_noise() -> None:
    """Three repeats of standard deviation 0.2; the fourth record had another command."""
    records = [record(f"night_{i}", 0.1, i, 0.2) for i in range(3)] + [record("other", 0.2, 5, 5.0)]
    found = repeats(records)
    assert found is not None and found.names == ("night_0", "night_1", "night_2")
    assert found.floor == pytest.approx(0.2, rel=0.05)


def test_without_repeats_there_is_none() -> None:
    one = record("one", 0.1, 1, 0.1)
    assert repeats([one]) is None
    assert repeats([one, record("two", 0.11, 2, 0.1)]) is None
    shorter = replace(one, t=one.t[:-1], u=one.u[:-1], y=one.y[:-1])
    assert repeats([one, shorter]) is None


def periodic(period: int, periods: float, creep: float, sigma: float) -> Record:
    """A multisine of that many periods; the answer settles in the first and creeps in every one."""
    count = round(period * periods)
    t = np.arange(count) / RATE
    phase = 2 * np.pi * np.arange(count) / period
    u = np.sin(phase) + 0.3 * np.cos(3 * phase)
    settling = 9.0 * np.exp(-np.arange(count) / (period / 12))
    y = 3 * u + creep * np.floor(np.arange(count) / period) + settling + white(count, sigma, 4)
    return Record("sweep", t, u, y, RATE, AXIS.units)


def test_periods_of_one_record_are_repeats() -> None:
    """The settling of the first period and a constant creep are not noise."""
    record = periodic(400, 10.5, 0.7, 0.2)
    assert period_of(record.u) == 400
    found = repeats([record])
    assert found is not None and found.periods and found.names == ("sweep",)
    assert found.floor == pytest.approx(0.2, rel=0.05)


@pytest.mark.parametrize("periods", [2.0, 2.99])
def test_too_few_periods_are_none(periods: float) -> None:
    assert period_of(periodic(400, periods, 0.0, 0.1).u) is None


def test_a_command_that_almost_repeats_does_not() -> None:
    record = periodic(400, 10, 0.0, 0.1)
    command = record.u.copy()
    command[-1] += 1e-3
    assert period_of(command) is None and repeats([replace(record, u=command)]) is None


def test_the_floor_is_no_bound_without_repeats() -> None:
    assert repeated_floor([record("one", 0.1, 1, 0.1)]) == np.inf
    repeated = [record(name, 0.1, seed, 0.1) for seed, name in enumerate("ab")]
    assert repeated_floor(repeated) == pytest.approx(0.1, rel=0.05)
