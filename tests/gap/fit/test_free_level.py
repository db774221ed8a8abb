"""Free levels of records: nothing that is fitted or screened depends on where zero was put."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA
from fitted import base, of_records

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import CommandBias
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.free_level import level_columns, level_of
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen

LEVEL = 3 * SIGMA


def fitted(level: float) -> Fit:
    """Two records, the second off by a level that is free, fitted from the truth."""
    hypothesis = replace(base(600), free_levels=(1,))
    simulated = hypothesis.simulate(hypothesis.builder.axis.nominal)
    rng = np.random.default_rng(5)
    measured: list[FloatArray] = [y + SIGMA * rng.standard_normal(len(y)) for y in simulated]
    measured[1] = measured[1] + level
    start = of_records(measured, hypothesis)
    return fit(hypothesis, measured, start.coordinates, Plain(SIGMA))


@pytest.fixture(scope="module")
def pair() -> tuple[Fit, Fit]:
    return fitted(0.0), fitted(LEVEL)


def test_a_fit_does_not_depend_on_a_free_level(pair: tuple[Fit, Fit]) -> None:
    plain, moved = pair
    assert moved.cost == pytest.approx(plain.cost, abs=0.01)
    apart = (moved.coordinates - plain.coordinates) / np.sqrt(np.diag(plain.covariance()))
    assert np.abs(apart).max() < 0.05
    for one, other in zip(plain.residuals, moved.residuals, strict=True):
        np.testing.assert_allclose(other, one, atol=0.02 * SIGMA)
    assert abs(float(np.mean(moved.residuals[1]))) < 1e-9


def test_intervals_count_the_level_in(pair: tuple[Fit, Fit]) -> None:
    """Where it is free nothing is known better, and something less well, than where it is held."""
    free = pair[0]
    held = replace(free, hypothesis=replace(free.hypothesis, free_levels=()))
    ratio = np.sqrt(np.diag(free.covariance()) / np.diag(held.covariance()))
    assert ratio.min() > 1 - 1e-9
    assert ratio.max() > 1.001


def test_what_a_level_explains_promises_no_effect(pair: tuple[Fit, Fit]) -> None:
    screens = [Screen(one, Plain(SIGMA)) for one in pair]
    best = [max(c.reduction for c in screen.candidates(CommandBias())) for screen in screens]
    assert best[1] == pytest.approx(best[0], abs=0.5)


def test_levels_of_known_records_and_of_masked_ones_are_none() -> None:
    hypothesis = replace(base(300), free_levels=(0, 1))
    masked = Plain(SIGMA, masked=(np.zeros(300, dtype=bool), np.ones(300, dtype=bool)))
    errors = np.full(300, 2.0)
    assert level_of(hypothesis, masked, errors, 0) == pytest.approx(2.0)
    assert level_of(hypothesis, masked, errors, 1) == 0.0
    assert level_of(replace(hypothesis, free_levels=()), masked, errors, 0) == 0.0
    assert level_columns(hypothesis, masked, [300, 300]).shape == (600, 1)
