"""The static blocks do what eqs. 1 and 5 say, and their inverses undo them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.model.blocks import DeadZone, GainNormalization, Saturation

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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Saturation(0.1, 0.4), "lower < 0 < upper"),
        (lambda: Saturation(-0.1, float("inf")), "finite"),
        (lambda: DeadZone(-1e-9), "half_width"),
        (lambda: DeadZone(float("nan")), "half_width"),
        (lambda: GainNormalization(c1=0.0), "c1"),
        (lambda: GainNormalization(c3=float("nan")), "c3"),
    ],
)
def test_impossible_blocks_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
