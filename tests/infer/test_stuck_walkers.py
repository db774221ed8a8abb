"""Walkers in side peaks without weight are taken back; those in peaks that may have weight stay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from targets import Target

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.infer.stuck_walkers import without_strays

PEAK = np.full(8, 30.0)


class WithPeak(Target):
    """A standard normal density, and a peak of width 1e-4 at PEAK so much higher than its top."""

    def __init__(self, height: float) -> None:
        super().__init__(len(PEAK))
        self.height = height

    def log_density(self, x: FloatArray) -> FloatArray:
        wide = -0.5 * np.sum(x**2, axis=-1)
        return np.logaddexp(wide, self.height - 0.5 * np.sum(((x - PEAK) / 1e-4) ** 2, axis=-1))


def settled(height: float, peaked: Sequence[int]) -> tuple[FloatArray, FloatArray, EnsembleState]:
    density = WithPeak(height)
    start = np.random.default_rng(1).standard_normal((64, 8))
    start[list(peaked)] = PEAK
    proposal = Laplace([(np.zeros(8), np.eye(8))], [density]).proposal(1.0)
    state = start_ensemble(start, density, 3)
    chain, log_density, _, after = advance(state, density, weighted_moves(proposal, 0.5), 20)
    return chain, log_density, after


def test_a_walker_in_a_low_and_narrow_peak_is_put_among_the_others() -> None:
    chain, log_density, state = settled(-40.0, [7])
    assert (state.coordinates[7] == PEAK).all()
    freed = without_strays(chain, log_density, state)
    assert (np.abs(freed.coordinates) < 8).all()
    np.testing.assert_allclose(freed.log_probability, WithPeak(-40.0)(freed.coordinates))
    others = np.delete(np.arange(64), 7)
    np.testing.assert_array_equal(freed.coordinates[others], state.coordinates[others])
    assert freed.random_state is state.random_state


@pytest.mark.parametrize(("height", "peaked"), [(5.0, [7]), (-40.0, []), (-40.0, range(64))])
def test_nothing_else_is_moved(height: float, peaked: Sequence[int]) -> None:
    """Not from a peak higher than all else, nor where nobody is stuck, nor where everybody is."""
    chain, log_density, state = settled(height, peaked)
    same = without_strays(chain, log_density, state)
    np.testing.assert_array_equal(same.coordinates, state.coordinates)
    np.testing.assert_array_equal(same.log_probability, state.log_probability)
