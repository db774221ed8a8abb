"""Least trimmed squares: the stretches that fit worst are found, and do not move the fit."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, simulated_with
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.gap.effects.catalogue import CubicStiffness, TransportDelay
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.fit.least_trimmed_squares import STRETCHES, best_stretches
from bayes_hw.gap.noise.whitener import Plain

PLAIN = Plain(SIGMA)
NOMINAL = hypothesis(AXIS, [command(10, 1)]).builder.axis.nominal


def test_the_loudest_stretches_of_all_records_are_left_out() -> None:
    """Two loud stretches of 48 in the first column, one of each record; others in the second."""
    errors = [np.ones((240, 2)), np.ones((480, 2))]
    errors[0][20:30, 0] = errors[1][460:480, 0] = 3.0
    errors[1][0:40, 1] = 2.0
    kept = best_stretches(errors, 2 / (2 * STRETCHES))
    for record, samples in enumerate((240, 480)):
        for column in (0, 1):
            np.testing.assert_array_equal(
                kept[record][:samples, column],
                errors[record][:, column] == 1.0,
                err_msg=f"{record}, {column}",
            )


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**31), st.floats(0.05, 0.6), st.lists(st.integers(1, 200), min_size=1, max_size=3))
def test_no_other_choice_of_as_many_stretches_is_smaller(seed: int, share: float, lengths: list[int]) -> None:
    """What is kept is the stretches of the smallest mean squares, at least the share that is to stay."""
    rng = np.random.default_rng(seed)
    errors = [rng.normal(size=(n, 1)) * np.exp(rng.normal(size=(n, 1))) for n in lengths]
    kept = best_stretches(errors, share)
    squares, stays = [], []
    for e, k in zip(errors, kept, strict=True):
        starts = np.unique(np.linspace(0, len(e), min(STRETCHES, len(e)) + 1)[:-1].astype(int))
        for first, last in zip(starts, [*starts[1:], len(e)], strict=True):
            assert k[first:last].all() or not k[first:last].any()
            squares.append(np.mean(e[first:last] ** 2))
            stays.append(bool(k[first, 0]))
    count = max(round((1 - share) * len(squares)), 1)
    assert sum(stays) == count
    assert sorted(np.array(squares)[stays]) == sorted(squares)[:count]


def test_an_error_that_has_run_away_is_not_left_out_altogether() -> None:
    """Part of a column is left out; a column with nothing finite stays, so that its cost is not zero."""
    errors = np.ones((240, 2))
    errors[200:, 0], errors[:, 1] = np.nan, np.inf
    (kept,) = best_stretches([errors], 0.3)
    assert not kept[200:, 0].any() and kept[:160, 0].all()
    assert kept[:, 1].all()


def test_a_stretch_that_no_model_follows_does_not_move_the_fit() -> None:
    """A fifth of a record goes its own way: the delay is found on the rest, and missed on the whole."""
    inputs = [command(700, seed) for seed in (1, 2)]
    clean = simulated_with(TransportDelay(), (1.6,), inputs)
    measured = [y + white(len(y), SIGMA, i) for i, y in enumerate(clean)]
    measured[0][300:440] = clean[0][294:434]
    found = hypothesis(AXIS, inputs, TransportDelay())
    start = found.to_coordinates(np.array([*found.builder.axis.nominal, 0.4]))
    trimmed = fit(found, measured, start, PLAIN, left_out=0.3)
    assert trimmed.values[-1] == pytest.approx(1.6, abs=0.05)
    assert abs(fit(found, measured, start, PLAIN).values[-1] - 1.6) > 0.2
    assert trimmed.cost < 0.5 * sum(len(y) for y in measured)


def test_a_simulation_that_runs_away_in_a_stretch_is_no_fit() -> None:
    """A spring that yields runs away for part of a record only: leaving that part out would hide it."""
    inputs = [command(700, seed) for seed in (1, 2)]
    measured = [y + white(len(y), SIGMA, i) for i, y in enumerate(hypothesis(AXIS, inputs).simulate(NOMINAL))]
    found = hypothesis(AXIS, inputs, CubicStiffness())
    costs = []
    with np.errstate(all="ignore"):
        for cubic in -np.geomspace(1e2, 1e7, 26):
            start = found.to_coordinates(np.append(NOMINAL, cubic))
            costs.append(fit(found, measured, start, PLAIN, 0, left_out=0.5).cost)
            assert np.isfinite(costs[-1]) == np.isfinite(fit(found, measured, start, PLAIN, 0).cost)
    assert np.isfinite(costs).any() and not np.isfinite(costs).all()
