"""The search keeps its three conditions, and loosening one never moves its result farther away."""

from __future__ import annotations

import numpy as np
import pytest
from printed.eq12 import nanshan_rounding_box
from printed.representative import find_representative

from bayes_hw.errors import InputError
from bayes_hw.model.linear import LinearBlock

LIMITS = (0.99, 0.993, 0.997)


def _slow(found: np.ndarray) -> np.ndarray:
    return found[(np.abs(found - 1) < 0.1) & (found != 1)]


def _displacement(block: LinearBlock) -> np.ndarray:
    return np.concatenate(nanshan_rounding_box().displacement(*block.coefficients()))


@pytest.mark.parametrize("limit", LIMITS)
def test_representative_keeps_its_conditions(limit: float) -> None:
    block = find_representative(nanshan_rounding_box(), limit)
    assert np.count_nonzero(block.poles == 1) == 1
    assert np.abs(_slow(block.poles)).max() <= limit + 1e-9
    assert np.prod(1 - _slow(block.zeros)) == pytest.approx(np.prod(1 - _slow(block.poles)), rel=1e-7)
    assert np.abs(_displacement(block)).max() < 1


def test_looser_limit_never_lies_farther() -> None:
    distances = [
        np.sum(_displacement(find_representative(nanshan_rounding_box(), limit)) ** 2) for limit in LIMITS
    ]
    assert distances == sorted(distances, reverse=True)


def test_no_neighbour_that_keeps_the_conditions_is_nearer() -> None:
    """Random small moves of the slow roots that keep the conditions, and of the gain, all lie farther."""
    block = find_representative(nanshan_rounding_box(), 0.991)
    best = np.sum(_displacement(block) ** 2)
    rng = np.random.default_rng(0)
    slow_pole, slow_zero = np.abs(block.poles - 1) < 0.1, np.abs(block.zeros - 1) < 0.1
    for _ in range(200):
        size = 10.0 ** rng.uniform(-8, -4)
        poles, zeros = block.poles.copy(), block.zeros.copy()
        moving = slow_pole & (poles != 1)
        poles[moving] = np.minimum(poles[moving].real + size * rng.normal(size=2), 0.991)
        product = np.prod(1 - poles[moving]).real
        centre = zeros[slow_zero][0].real + size * rng.normal()
        height = np.sqrt(product - (1 - centre) ** 2)
        zeros[slow_zero] = [centre + 1j * height, centre - 1j * height]
        moved = LinearBlock(zeros, poles, block.gain * (1 + size * rng.normal()), block.delay_samples)
        assert np.sum(_displacement(moved) ** 2) > best - 1e-9


def test_limit_that_the_box_does_not_reach_is_refused() -> None:
    with pytest.raises(InputError, match="rounding box"):
        find_representative(nanshan_rounding_box(), 0.985)
