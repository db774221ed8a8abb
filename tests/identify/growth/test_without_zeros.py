"""Delays of a drive train in series are told by the phases of its modes; zeros that are there stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from series_axis import DELAY, RATE, STRUCTURE, series

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.growth.delay import begun_at
from bayes_hw.identify.growth.extension import with_section
from bayes_hw.identify.growth.search import Grown
from bayes_hw.identify.growth.without_zeros import in_series, without_slow_parts, without_zeros
from bayes_hw.record import Record, Units

SAMPLES, SIGMA = 6000, 5e-4


def fitted(values: CascadeValues, delay: int) -> Grown:
    """Begun at the truth of DELAY, then at another delay that stands in for it."""
    rng = np.random.default_rng(5)
    records = []
    for number in range(2):
        u = np.repeat(rng.normal(0, 0.3, SAMPLES // 30), 30)
        blank = Record(f"r{number}", np.arange(SAMPLES) / RATE, u, np.zeros(SAMPLES), RATE, Units())
        y = -Grown.at(STRUCTURE, values, [blank, blank], 0).point.residuals[0]
        records.append(replace(blank, y=y + SIGMA * rng.standard_normal(SAMPLES)))
    return begun_at(Grown.at(STRUCTURE, values, records).descended(), delay)


@pytest.mark.parametrize("held", [False, True], ids=["of samples", "held"])
def test_a_delay_that_zeros_stand_in_for_is_found(held: bool) -> None:
    item = fitted(series(held, 2), DELAY + 4)
    assert item.structure.delay_samples == DELAY + 4
    found = without_zeros(item)
    assert found.structure.delay_samples == DELAY
    assert found.log_likelihood > item.log_likelihood - 1


def test_slow_parts_say_nothing_of_it() -> None:
    """Two that are kept for what they have in common with a dead zone stay where they are."""
    item = fitted(series(True, 2), DELAY + 4)
    slow = (0.9999, 0.9998)
    structure, values = with_section(item.structure, item.values, sum(slow), slow[0] * slow[1])
    larger = Grown.at(structure, values, item.response.records)
    assert without_slow_parts(larger).structure.order == item.structure.order
    found = without_zeros(larger)
    assert (found.structure.delay_samples, found.structure.order) == (DELAY, item.structure.order + 2)


def test_residues_in_series_stay_as_they_are() -> None:
    item = fitted(series(True, 2), DELAY)
    truth = Grown.at(STRUCTURE, series(True, 2), item.response.records)
    again = in_series(truth, True)
    assert again is not None
    np.testing.assert_allclose(again.values.sections, truth.values.sections, rtol=1e-7)


def test_zeros_that_are_there_stay() -> None:
    """Modes beside each other: no delay makes them one behind the other."""
    beside = series(True, 2)
    weights: FloatArray = beside.sections.copy()
    weights[2:, 0] *= 0.5
    item = fitted(replace(beside, sections=weights), DELAY)
    assert without_zeros(item) is item
