"""The noise floor from repeats: that of the noise, whatever the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import RATE, white
from fitted import AXIS

from bayes_hw.gap.repeats import repeats
from bayes_hw.record import Record

N = 4000
T = np.arange(N) / RATE


def record(name: str, frequency: float, seed: int, sigma: float) -> Record:
    """A sine as the command, its answer with noise."""
    u = np.sin(2 * np.pi * frequency * T)
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
