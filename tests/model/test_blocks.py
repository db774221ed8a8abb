"""The static blocks do what eqs. 1, 3 and 5 say, and their inverses undo them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.model.blocks import Backlash, DeadZone, GainNormalization, LinearBranch, Saturation

POSITIVE = st.floats(1e-3, 1e3)
SIGNALS = st.lists(st.floats(-100, 100), min_size=1, max_size=40).map(np.array)


@given(SIGNALS, POSITIVE, POSITIVE, POSITIVE)
def test_saturation_is_equation_1(u: np.ndarray, below: float, upper: float, gain: float) -> None:
    v = Saturation(-below, upper, gain)(u)
    for command, limited in zip(u, v, strict=True):
        scaled = gain * command
        expected = upper if scaled > upper else -below if scaled < -below else scaled
        assert limited == expected


@given(SIGNALS, st.floats(0, 50), POSITIVE, POSITIVE)
def test_dead_zone_is_equation_5(w: np.ndarray, delta: float, c2: float, c3: float) -> None:
    y = DeadZone(delta, c2, c3)(w)
    for position, angle in zip(w, y, strict=True):
        expected = 0.0
        if position > delta:
            expected = c2 * (position - delta)
        elif position < -delta:
            expected = c3 * (position + delta)
        assert angle == expected


@given(SIGNALS, st.floats(0, 50), POSITIVE, POSITIVE)
def test_dead_zone_undoes_its_exact_inverse(y: np.ndarray, delta: float, c2: float, c3: float) -> None:
    """The error allowed is that of rounding y / c + delta, seen through the slope c, and underflow."""
    dead_zone = DeadZone(delta, c2, c3)
    rounding = 4 * np.finfo(float).eps * (np.abs(y) + max(c2, c3) * delta) + 1e-300
    assert np.all(np.abs(dead_zone(dead_zone.inverse(y)) - y) <= rounding)


@given(st.floats(0, 5), st.floats(0.1, 10), st.floats(0.1, 10), st.floats(1e-3, 1))
def test_smoothed_inverse_increases_and_joins_the_branches(
    delta: float, c2: float, c3: float, smoothing: float
) -> None:
    """Monotone across the join, continuous at its ends, zero at zero and exact outside."""
    dead_zone = DeadZone(delta, c2, c3)
    y = np.linspace(-2 * smoothing, 2 * smoothing, 801)
    w = dead_zone.inverse(y, smoothing)
    assert np.all(np.diff(w) > 0)
    outside = np.abs(y) >= smoothing
    assert np.array_equal(w[outside], dead_zone.inverse(y)[outside])
    assert dead_zone.inverse(np.zeros(1), smoothing)[0] == pytest.approx(0, abs=1e-15)
    edges = np.array([-1.0, 1.0]) * smoothing
    joined = dead_zone.inverse(edges * (1 - 1e-9), smoothing)
    assert joined == pytest.approx(dead_zone.inverse(edges), rel=1e-6)


@given(st.floats(1e-3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_backlash_flanks_are_inverted(slope: float, intercept: float, w: float) -> None:
    branch = LinearBranch(slope, intercept)
    assert branch.inverse(branch(w)) == pytest.approx(w, rel=1e-9, abs=1e-9)
    assert branch(intercept) == 0


@given(SIGNALS, st.floats(0, 20), st.floats(0.1, 10), st.floats(-50, 50))
def test_play_is_the_play_operator(w: np.ndarray, half_gap: float, slope: float, start: float) -> None:
    """Against p(k) = max(w - gap, min(w + gap, p(k-1))), y = slope p, the usual form of the play operator."""
    y = Backlash.play(half_gap, slope)(w, initial=slope * start)
    held = start
    for position, angle in zip(w, y, strict=True):
        held = max(position - half_gap, min(position + half_gap, held))
        assert angle == pytest.approx(slope * held, rel=1e-9, abs=1e-9)


def test_unequal_flanks_follow_their_own_slope() -> None:
    """Up on one flank, hold, down on the other, hold, up again: the loop worked out by hand.

    Increasing y = w - 2, decreasing y = (w + 1) / 2; they meet at w = 5, beyond this record.
    """
    backlash = Backlash(LinearBranch(1.0, 2.0), LinearBranch(0.5, -1.0))
    y = backlash(np.array([0.0, 2.0, 3.0, 2.0, 1.0, 0.0, -3.0, -2.0, 1.0, 1.5]))
    assert y.tolist() == [0, 0, 1, 1, 1, 0.5, -1, -1, -1, -0.5]


@dataclass(frozen=True)
class CubicBranch:
    """y = (w - intercept)^3: a curved flank with a closed inverse."""

    intercept: float

    def __call__(self, w: float) -> float:
        return (w - self.intercept) ** 3

    def inverse(self, y: float) -> float:
        return float(np.cbrt(y)) + self.intercept


def test_curved_flanks_are_followed() -> None:
    y = Backlash(CubicBranch(1.0), CubicBranch(-1.0))(np.array([3.0, 2.0, 1.0, 0.5, -3.0]))
    assert y == pytest.approx([8, 8, 8, 1.5**3, -8])


def test_crossing_flanks_are_refused() -> None:
    with pytest.raises(InputError, match="flanks cross"):
        Backlash(LinearBranch(1.0, -1.0), LinearBranch(1.0, 1.0))(np.zeros(3))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Saturation(0.1, 0.4), "lower < 0 < upper"),
        (lambda: Saturation(-0.1, float("inf")), "finite"),
        (lambda: DeadZone(-1e-9), "half_width"),
        (lambda: DeadZone(float("nan")), "half_width"),
        (lambda: LinearBranch(0.0, 1.0), "positive slope"),
        (lambda: GainNormalization(c1=0.0), "c1"),
        (lambda: GainNormalization(c3=float("nan")), "c3"),
    ],
)
def test_impossible_blocks_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
