"""Whoever waits for a compilation is told, once; whoever loads what was compiled before is not."""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.first_use import WORDS, told_of_compilation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener


def test_a_compilation_is_told_of_once_and_only_meanwhile() -> None:
    said: list[str] = []
    one, other, later = (njit(lambda x: x + 1) for _ in range(3))
    with told_of_compilation(said.append):
        assert said == []
        assert one(1.0) == other(1.0) == 2.0
        assert said == [WORDS]
    later(1.0)
    assert said == [WORDS]


def test_what_was_compiled_before_is_not_told_of(small_axis: HammersteinWiener) -> None:
    small_axis.simulate(np.ones(50))
    said: list[str] = []
    with told_of_compilation(said.append):
        small_axis.simulate(np.ones(50))
    assert said == []
