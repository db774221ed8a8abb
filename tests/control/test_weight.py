"""Weights lie above their floor, are stable, and find a floor that is itself of low order."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.control.python_control import weight_system
from bayes_hw.control.weight import Weight, fit_weight

FREQUENCY = np.geomspace(0.02, 10.0, 300)


def first_order() -> Weight:
    return Weight(0.8, np.array([-0.5 + 0j]), np.array([-12.0 + 0j]), 20.0)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_floor_of_first_order_is_found(order: int) -> None:
    """A weight of at least its order touches it everywhere."""
    floor = first_order().magnitude(FREQUENCY)
    found = fit_weight(FREQUENCY, floor, order, 20.0)
    ratio = found.magnitude(FREQUENCY) / floor
    assert ratio.min() >= 1
    assert ratio.max() < (1.02 if order == 1 else 1.1)


def test_a_resonant_floor_needs_second_order() -> None:
    """A bump at 3 Hz: order 2 lies close above it, order 1 cannot, order 3 is no worse than 2."""
    s = 2j * np.pi * FREQUENCY
    w = 2 * np.pi * 3.0
    floor = 0.05 * np.abs((s**2 + 2 * 0.5 * w * s + w**2) / (s**2 + 2 * 0.05 * w * s + w**2))
    share = np.gradient(np.log(FREQUENCY))
    excess = []
    for order in (1, 2, 3):
        weight = fit_weight(FREQUENCY, floor, order, 20.0)
        ratio = np.log(weight.magnitude(FREQUENCY) / floor)
        assert ratio.min() >= 0
        excess.append(float(ratio @ share / share.sum()))
    assert excess[0] > 0.5
    assert excess[1] < 0.1 and excess[2] < excess[1] + 0.05


@pytest.mark.parametrize("order", [1, 2, 3])
def test_weights_are_stable_and_their_polynomials_say_the_same(order: int) -> None:
    """|W| from the polynomials by python-control; poles and zeros inside the unit circle."""
    floor = 0.03 + 0.4 * (FREQUENCY / 10) ** 1.5 + 0.2 * np.exp(-(((FREQUENCY - 3.5) / 0.4) ** 2))
    weight = fit_weight(FREQUENCY, floor, order, 20.0)
    assert weight.order == order
    system = weight_system(weight)
    below = FREQUENCY[FREQUENCY < 9.9]
    response = system(np.exp(2j * np.pi * below / 20.0))
    np.testing.assert_allclose(np.abs(response), weight.magnitude(below), rtol=1e-9)
    assert np.abs(system.poles()).max() < 1 and np.abs(system.zeros()).max() < 1
