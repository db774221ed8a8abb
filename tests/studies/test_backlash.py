"""Backlash follows eq. 3: the play operator, flanks of their own, curved ones; the impossible is refused."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from backlash import Backlash, LinearBranch
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.errors import InputError

SIGNALS = st.lists(st.floats(-100, 100), min_size=1, max_size=40).map(np.array)


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


def test_a_flat_flank_is_refused() -> None:
    with pytest.raises(InputError, match="positive slope"):
        LinearBranch(0.0, 1.0)
