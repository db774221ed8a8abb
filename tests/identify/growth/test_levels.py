"""Free levels: profiled exactly, so that where a record's zero was put changes nothing that is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import triangular_factor
from bayes_hw.identify.growth.levels import level_shapes, levelled, levels_of, with_level_rows
from bayes_hw.identify.growth.search import Grown, grow, smallest_cascade
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

AR1 = Whitener.of_partial(np.array([0.6]))


@pytest.mark.parametrize("holes", [False, True])
def test_the_level_is_that_of_generalised_least_squares(holes: bool) -> None:
    """Against the covariance matrix of the autoregression, written out."""
    rng = np.random.default_rng(3)
    e = rng.standard_normal(60) + 2.0
    measured: BoolArray = np.ones(60, dtype=bool)
    if holes:
        measured[20:27] = False
    covariance = toeplitz(0.6 ** np.arange(60))[np.ix_(measured, measured)]
    weighted = np.linalg.solve(covariance, np.ones(int(measured.sum())))
    expected = float(weighted @ e[measured]) / float(weighted.sum())
    shown = np.where(measured, e, np.nan)
    masks = [measured] if holes else None
    assert levels_of([shown], [np.ones(60)], AR1, masks)[0] == pytest.approx(expected, rel=1e-9)
    (left,) = levelled([shown], [np.ones(60)], AR1, masks)
    np.testing.assert_allclose(left[measured], e[measured] - expected, rtol=1e-9)


def test_a_known_level_and_one_beyond_numbers_stay() -> None:
    e = [np.array([1.0, 2.0, 3.0]), np.array([1.0, np.inf, 3.0])]
    found = levelled(e, [np.zeros(3), np.ones(3)], AR1, None)
    for left, own in zip(found, e, strict=True):
        np.testing.assert_array_equal(left, own)


def test_rows_of_levels_follow_the_parts_of_records() -> None:
    """Two records of 5 and 4 samples, the second one's level free and weighted, in parts of 3 that overlap by
    one."""
    shapes = (np.zeros(5), np.array([1.0, 2.0, 3.0, 4.0]))
    parts = [(3, 0), (3, 1), (3, 0), (2, 1)]
    blocks: list[tuple[FloatArray, int, BoolArray | None]] = [
        (np.full((2, width), -1.0), first, None) for width, first in parts
    ]
    rows = [block[0] for block, _, _ in with_level_rows(blocks, shapes)]
    np.testing.assert_array_equal(np.concatenate(rows), [0, 0, 0, 0, 0, 0, 1, 2, 3, 3, 4])


def moved(record: Record, by: float) -> Record:
    """As if its level had been estimated that far off."""
    return replace(record, y=record.y - by, origin=record.origin + by, level_sd=0.01)


@pytest.fixture(scope="module")
def pair(small_record: Record) -> tuple[Grown, Grown]:
    """Cascades of order 3 grown on a record as it is and on one whose zero is off by a deviation."""
    structure = Structure(0, True, 0, 0, lower=True, upper=True, dead_zone=True)
    first, second = (
        grow(smallest_cascade([moved(small_record, by)], structure, 0.01), 3)[3] for by in (0.0, 0.01)
    )
    return first, second


def test_growth_does_not_depend_on_where_zero_was_put(
    pair: tuple[Grown, Grown], small_axis: HammersteinWiener
) -> None:
    first, second = pair
    assert second.log_likelihood == pytest.approx(first.log_likelihood, abs=0.1)
    assert second.values.half_width == pytest.approx(first.values.half_width, abs=2e-4)
    assert first.values.half_width == pytest.approx(small_axis.dead_zone.half_width, abs=2e-3)
    shift = levels_of(
        second.response.residuals(second.point.coordinates), level_shapes(second.response.records),
        second.point.whitener, None,
    )  # fmt: skip
    own = levels_of(
        first.response.residuals(first.point.coordinates), level_shapes(first.response.records),
        first.point.whitener, None,
    )  # fmt: skip
    assert own[0] - shift[0] == pytest.approx(0.01, abs=2e-4)


def test_intervals_count_the_level_in(pair: tuple[Grown, Grown]) -> None:
    """The factor of a free level is that of derivatives less what the level explains of them."""
    grown = pair[0]
    response, point = grown.response, grown.point
    factor = triangular_factor(response, point)
    ((rows, _, _),) = response.linearise(point.coordinates, point.whitener.order)
    white = point.whitener.apply(np.concatenate([np.ones((1, rows.shape[1])), rows]))
    level, rest = white[0], white[1:]
    rest = rest - np.outer(rest @ level / (level @ level), level)
    np.testing.assert_allclose(
        factor.T @ factor, rest @ rest.T, rtol=1e-6, atol=1e-8 * np.abs(rest @ rest.T).max()
    )
