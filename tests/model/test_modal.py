"""Partial fractions are the block that they come from."""

from __future__ import annotations

import numpy as np
import pytest
from printed.nanshan import nanshan_linear_block

from bayes_hw.model.axis_parameters import AxisParameters, FreeSet
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.linear import LinearBlock
from bayes_hw.model.modal import SEPARATION, linear_batch, modal_form

PAIR = 0.6 + 0.6j
BLOCKS = {
    "Nanshan": nanshan_linear_block(),
    "direct term": LinearBlock(np.array([0.2, 0.4 + 0j]), np.array([PAIR, PAIR.conjugate()]), 0.7, 0),
    "real poles": LinearBlock(np.zeros(0, complex), np.array([1.0, 0.5, -0.3 + 0j]), -2.0, 3),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_sum_of_fractions_is_the_transfer_function(name: str) -> None:
    """direct + sum r / (z - p) + conjugates = G(z) at points on and off the unit circle."""
    block = BLOCKS[name]
    batch = linear_batch(block, 2)
    real, pairs, direct = batch.residues()
    for z in (np.exp(0.3j), 1.2 + 0.1j, -1.5 + 0j):
        total = direct[1] + np.sum(real[:, 1] / (z - batch.real_poles[:, 1]))
        total += np.sum(pairs[:, 1] / (z - batch.pair_poles[:, 1]))
        total += np.sum(pairs[:, 1].conj() / (z - batch.pair_poles[:, 1].conj()))
        expected = block.gain * np.prod(z - block.zeros) / np.prod(z - block.poles)
        assert total == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", BLOCKS)
def test_frequency_response_of_the_batch(name: str) -> None:
    block = BLOCKS[name]
    frequencies = np.array([0.3, 2.0, 9.9])
    found = linear_batch(block, 3).frequency_response(frequencies, 20.0, block.delay_samples)
    np.testing.assert_allclose(found[2], block.frequency_response(frequencies, 20.0), rtol=1e-10)


def test_coinciding_poles_are_moved_apart_and_others_left() -> None:
    """Only in the walkers where they coincide; the middle stays."""
    batch = linear_batch(LinearBlock(np.zeros(0, complex), np.array([0.5, 0.9 + 0j]), 1.0, 0), 2)
    batch.real_poles[1, 0] = batch.real_poles[0, 0]
    moved = batch.separated().real_poles
    np.testing.assert_array_equal(moved[:, 1], batch.real_poles[:, 1])
    assert abs(moved[0, 0] - moved[1, 0]) == pytest.approx(SEPARATION)
    assert moved[:, 0].mean() == pytest.approx(batch.real_poles[0, 0], abs=1e-15)


def test_modal_form_starts_at_rest() -> None:
    form = modal_form(linear_batch(BLOCKS["Nanshan"], 4), np.ones((6, 4)))
    assert form.walkers == 4
    assert not form.real_state.any() and not form.pair_state.any()


@pytest.mark.parametrize("free", ["conditional", "all"])
def test_direct_term_survives_either_parametrisation(free: FreeSet) -> None:
    """A block with as many zeros as poles answers in the sample of the command itself."""
    model = HammersteinWiener("test", 20.0, Saturation(-2, 2), BLOCKS["direct term"], DeadZone(0.0))
    axis = AxisParameters(model, free)
    u = np.array([1.0, 0, 0, 0.5, 0])
    w = simulate_batch(axis.modal_form(axis.nominal[:, None]), u, 0).w[0]
    np.testing.assert_allclose(w, model.linear.filter(u), atol=1e-12)
