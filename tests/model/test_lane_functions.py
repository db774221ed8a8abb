"""Functions of lanes against numpy's, over the range that a simulation uses and beyond it."""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.arrays import FloatArray
from bayes_hw.model.lane_functions import (
    absolute,
    angle_of,
    cosine,
    exponential,
    logarithm,
    sine,
    square_root,
    where_less,
)
from bayes_hw.model.lanes import LANES, broadcast, load, store

RNG = np.random.default_rng(2)


@njit(error_model="numpy")
def filled(x, sines, exponentials, chosen, cosines, roots):  # type: ignore[no-untyped-def]
    for row in range(len(x)):
        value = load(x, row)
        store(sines, row, sine(value))
        store(cosines, row, cosine(value))
        store(roots, row, square_root(value))
        store(exponentials, row, exponential(value))
        store(chosen, row, where_less(value, broadcast(0.5), absolute(value), broadcast(7.0)))


def of_lanes(x: FloatArray) -> list[FloatArray]:
    """Sine, exponential, |x| where below 0.5, else 7, cosine, root; x (n,) in multiples of LANES."""
    rows = x.reshape(-1, LANES)
    found = [np.empty_like(rows) for _ in range(5)]
    filled(rows, *found)
    return [part.ravel() for part in found]


def test_sine_and_cosine_to_rounding() -> None:
    """Small, large and negative arguments, and those next to multiples of a quarter turn."""
    quarters = np.arange(-500, 500) * (np.pi / 2)
    near = np.concatenate([quarters, np.nextafter(quarters, 9e9), quarters + 1e-8, quarters - 1e-8])
    x = np.concatenate([near, RNG.uniform(-10, 10, 4000), RNG.uniform(-1e6, 1e6, 4000)])
    np.testing.assert_allclose(of_lanes(x)[0], np.sin(x), rtol=0, atol=3e-16)
    np.testing.assert_allclose(of_lanes(x)[3], np.cos(x), rtol=0, atol=3e-16)


def test_square_root_is_rounded_right() -> None:
    x = np.concatenate([RNG.uniform(0, 1, 4000), np.exp(RNG.uniform(-700, 700, 4000))])
    np.testing.assert_array_equal(of_lanes(x)[4], np.sqrt(x))
    assert np.isnan(of_lanes(np.full(LANES, -1.0))[4]).all()


def test_exponential_to_rounding() -> None:
    x = np.concatenate([RNG.uniform(-700, 700, 4000), RNG.uniform(-1, 1, 4000)])
    np.testing.assert_allclose(of_lanes(x)[1], np.exp(x), rtol=5e-16)
    far = of_lanes(np.repeat([-1e300, -800.0, 0.0, 1e-300], LANES))[1].reshape(4, LANES)
    assert (far[:2] < 1e-300).all() and (far[2:] == 1).all()


def test_a_sine_stays_bounded_where_an_argument_ran_away() -> None:
    assert np.abs(of_lanes(np.repeat([1e18, -1e100], LANES))[0]).max() <= 1


def test_choice_and_absolute_value() -> None:
    x = RNG.normal(size=10 * LANES)
    np.testing.assert_array_equal(of_lanes(x)[2], np.where(x < 0.5, np.abs(x), 7.0))


@njit(error_model="numpy")
def logarithms_and_angles(x, y, logarithms, angles):  # type: ignore[no-untyped-def]
    for row in range(len(x)):
        store(logarithms, row, logarithm(load(x, row)))
        store(angles, row, angle_of(load(x, row), load(y, row)))


def test_logarithm_to_rounding() -> None:
    """Over all normal numbers, and next to one, where most digits cancel."""
    x = np.concatenate([np.exp(RNG.uniform(-700, 700, 4000)), RNG.uniform(0.5, 2, 4000)]).reshape(-1, LANES)
    found, angles = np.empty_like(x), np.empty_like(x)
    logarithms_and_angles(x, x, found, angles)
    np.testing.assert_allclose(found, np.log(x), rtol=1e-15, atol=3e-16)
    bad = np.repeat([-1.0, np.nan, np.inf], LANES).reshape(-1, LANES)
    found, angles = np.empty_like(bad), np.empty_like(bad)
    logarithms_and_angles(bad, bad, found, angles)
    assert not np.isfinite(found[1:]).any()


def test_angle_to_rounding() -> None:
    """In all quadrants, along the axes and where one part is far smaller than the other."""
    x = np.concatenate([RNG.normal(size=4000), [1.0, -1.0, 0.0, 0.0], np.full(12, 1e-9)]).reshape(-1, LANES)
    y = np.concatenate([RNG.normal(size=4000), [0.0, 0.0, 1.0, -1.0], RNG.normal(size=12)]).reshape(-1, LANES)
    found, angles = np.empty_like(x), np.empty_like(x)
    logarithms_and_angles(np.abs(x) + 1, y, found, angles)
    np.testing.assert_allclose(angles, np.arctan2(y, np.abs(x) + 1), rtol=0, atol=5e-16)
    logarithms_and_angles(x, y, found, angles)
    np.testing.assert_allclose(angles, np.arctan2(y, x), rtol=0, atol=1e-15)
