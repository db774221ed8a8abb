"""Every part of a cascade is left out in turn, and the order below takes the likeliest of what is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.extension import with_section, with_separate_pole, with_single_poles
from bayes_hw.identify.growth.score_test import best_candidates
from bayes_hw.identify.growth.search import (
    Grown,
    extended,
    with_smaller_ones,
    without_each_part,
)
from bayes_hw.identify.long_records import with_own_delay, without_fast_poles
from bayes_hw.record import Record

STRUCTURE = Structure(1, integrator=True, real_poles=1, sections=1)
VALUES = CascadeValues(
    -np.inf, np.inf, 0.0, 0.0, 0.05, np.array([[0.7], [0.02]]),
    np.array([[1.6], [0.9], [0.03], [-0.02]]), np.zeros((0, 4)),
)  # fmt: skip


@pytest.fixture
def grown() -> Grown:
    """At the truth, an integrator, a real pole and a mode."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.normal(size=60), 20)
    silent = Record.from_arrays(np.arange(len(u)) / 20, u, np.zeros(len(u)))
    response = CascadeResponse(STRUCTURE, [silent])
    clean = -response.residuals(response.coordinates(VALUES))[0]
    record = replace(silent, y=clean + 0.001 * rng.normal(size=len(u)))
    return Grown.at(STRUCTURE, VALUES, [record])


def test_each_part_is_left_out_once(grown: Grown) -> None:
    smaller = without_each_part(grown)
    assert [(item.structure.real_poles, item.structure.sections) for item in smaller] == [(0, 1), (1, 0)]
    np.testing.assert_allclose(smaller[0].values.sections, VALUES.sections, rtol=1e-6)
    np.testing.assert_allclose(smaller[1].values.real, VALUES.real, rtol=1e-6)


def test_a_poor_minimum_of_a_smaller_order_is_left(grown: Grown) -> None:
    """The truth is a mode beside the integrator; growth had stayed where it has no weight."""
    mode = replace(VALUES, real=np.array([[0.7], [0.0]]))
    record = grown.response.records[0]
    noise = 0.001 * np.random.default_rng(5).normal(size=len(record))
    seen = [replace(record, y=_simulated(mode, record) + noise)]
    whole = Grown.at(STRUCTURE, mode, seen)
    poor = Grown.at(
        replace(STRUCTURE, real_poles=0),
        replace(mode, real=np.zeros((2, 0)), sections=np.array([[0.1], [0.0], [0.0], [0.0]])),
        seen,
    )
    found = with_smaller_ones({4: whole, 3: poor})
    assert found[3].log_likelihood > poor.log_likelihood + 50
    assert found[3].log_likelihood > whole.log_likelihood - 5


def test_a_section_of_two_real_poles_parts_without_a_change(grown: Grown) -> None:
    structure, values = with_section(STRUCTURE, VALUES, 1.3, 0.4)
    values = replace(values, sections=values.sections + [[0.0], [0.0], [0.01], [-0.004]] * np.array([0, 1]))
    parted = with_single_poles(structure, values)
    assert (parted[0].real_poles, parted[0].sections) == (3, 1)
    records = grown.response.records
    before, after = (Grown.at(*one, records).point.residuals[0] for one in ((structure, values), parted))
    np.testing.assert_allclose(before, after, atol=1e-9)


def test_fast_poles_that_nothing_asks_for_go(grown: Grown) -> None:
    """A pole that alternates and one of a section, both without weight; what the records show stays."""
    structure, values = with_separate_pole(*with_section(STRUCTURE, VALUES, 1.3, 0.4), -0.99)
    found = without_fast_poles(Grown.at(structure, values, grown.response.records).descended())
    assert (found.structure.real_poles, found.structure.sections) == (1, 1)
    assert found.log_likelihood > grown.descended().log_likelihood - 1


def test_slow_poles_stay_though_nothing_asks_for_them(grown: Grown, monkeypatch: pytest.MonkeyPatch) -> None:
    structure, values = with_separate_pole(*with_separate_pole(STRUCTURE, VALUES, 0.99), 0.97)
    monkeypatch.setattr(Grown, "descended", lambda self: self)
    found = without_fast_poles(Grown.at(structure, values, grown.response.records))
    assert sorted(found.values.real[0]) == [0.7, 0.97, 0.99]


@pytest.mark.parametrize("wrong", [-1, 3])
def test_a_delay_that_was_rounded_is_found_without_the_poles_beside_it(grown: Grown, wrong: int) -> None:
    structure, values = with_separate_pole(STRUCTURE, VALUES, 0.05)
    begun = replace(structure, delay_samples=STRUCTURE.delay_samples + wrong)
    found = with_own_delay(Grown.at(begun, values, grown.response.records).descended(), 4)
    assert abs(found.structure.delay_samples - STRUCTURE.delay_samples) <= 1
    assert found.structure.order == STRUCTURE.order
    assert found.criterion < grown.descended().criterion + 2


def test_a_pole_that_all_but_alternates_is_promised(grown: Grown) -> None:
    """A pole at -0.96 acts for 25 samples; one at -0.8 is told from it and promises less."""
    alternating = replace(VALUES, real=np.array([[-0.96], [0.004]]))
    record = grown.response.records[0]
    noise = 0.001 * np.random.default_rng(6).normal(size=len(record))
    seen = [replace(record, y=_simulated(alternating, record) + noise)]
    without = without_each_part(Grown.at(STRUCTURE, alternating, seen))[0].descended()
    (first, *_), _ = best_candidates(without.response, without.point, 1)
    assert -0.99 < first.a1 < -0.9
    found = extended(without, first).descended()
    assert found.log_likelihood > Grown.at(STRUCTURE, alternating, seen).log_likelihood - 1


def _simulated(values: CascadeValues, record: Record) -> np.ndarray:
    response = CascadeResponse(STRUCTURE, [replace(record, y=np.zeros(len(record)))])
    return -response.residuals(response.coordinates(values))[0]
