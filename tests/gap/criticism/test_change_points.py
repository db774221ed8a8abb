"""Change points: where a residual changes its size, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import coloured

from bayes_hw.gap.criticism.change_points import BLOCKS, change_points

RATE = 20.0
SAMPLES = 2400


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_noise_has_hardly_any(correlation: float) -> None:
    """300 records of stationary noise, white and with a correlation time of ten samples."""
    records = [coloured(SAMPLES, 0.003, correlation, seed) for seed in range(300)]
    assert len({point.record for point in change_points(records, RATE)}) <= 10


@pytest.mark.parametrize(("at", "ratio"), [(30.0, 2.0), (90.0, 0.5), (60.0, 1.5)])
def test_a_change_of_size_is_found_in_its_record(at: float, ratio: float) -> None:
    """To a block's length and a tenth of its size, in the second of three records."""
    found = []
    for seed in range(12):
        records = [coloured(SAMPLES, 1.0, 0.3, 3 * seed + record) for record in range(3)]
        records[1][round(at * RATE) :] *= ratio
        found += [point for point in change_points(records, RATE) if point.record == 1]
    assert len(found) == 12
    block = SAMPLES / RATE / BLOCKS
    assert np.median([abs(point.time_s - at) for point in found]) <= block
    assert np.median([point.ratio for point in found]) == pytest.approx(ratio, rel=0.1)


def test_a_burst_has_a_beginning_and_an_end() -> None:
    residual = coloured(SAMPLES, 1.0, 0.0, 5)
    residual[780:1380] *= 3
    begin, end = change_points([residual], RATE)
    assert begin.time_s == pytest.approx(39) and end.time_s == pytest.approx(69)
    assert begin.ratio == pytest.approx(3, rel=0.1) and end.ratio == pytest.approx(1 / 3, rel=0.1)
    assert begin.to_dict() == {"record": 0, "time_s": begin.time_s, "ratio": begin.ratio}


def test_short_and_silent_records_have_none() -> None:
    assert change_points([np.ones(2 * BLOCKS - 1), np.zeros(SAMPLES), np.ones(SAMPLES)], RATE) == ()
