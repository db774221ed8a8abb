"""One sample of the controller: the sums worked by hand, and rest before the reference moves."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.model.controller_kernel import COMMAND, MEMORY, STATES, next_command, start_at_rest

NO_FILTERS, FILTER = np.zeros((0, 5)), np.array([[0.5, 0.1, 0.2, -0.3, 0.1]])


def numbers(**given: float) -> np.ndarray:
    """Kp 2, Ki T 0.5, no derivative, wide limits, memory of the limited command."""
    known = {
        "kp": 2.0,
        "ki": 0.5,
        "kd": 0.0,
        "pole": 0.0,
        "low": -9.0,
        "high": 9.0,
        "change": 9.0,
        "share": 1.0,
    }
    return np.array([*(known | given).values()])


def commands(gains: np.ndarray, errors: list[float]) -> list[float]:
    filters, state = np.zeros((0, 2)), np.zeros(STATES)
    start_at_rest(NO_FILTERS, 0.0, filters, state)
    return [next_command(gains, NO_FILTERS, error, filters, state) for error in errors]


def test_increments_add_up() -> None:
    """Kp e + Ki T times the sum of e, whatever the increments."""
    errors = [1.0, 0.5, -0.25]
    assert commands(numbers(), errors) == pytest.approx([2.5, 1.75, 0.125])
    assert commands(numbers(kd=4.0), errors) == pytest.approx([6.5, -0.25, -2.875])


def test_limits_of_size_and_of_change() -> None:
    assert commands(numbers(high=1.0), [1.0]) == [1.0]
    assert commands(numbers(change=0.5), [1.0, 1.0, 1.0]) == [0.5, 1.0, 1.5]


def test_what_the_limit_took_is_kept_or_not_by_the_share() -> None:
    for share, memory in ((1.0, 1.0), (0.0, 2.5), (0.5, 1.75)):
        filters, state = np.zeros((0, 2)), np.zeros(STATES)
        start_at_rest(NO_FILTERS, 0.0, filters, state)
        next_command(numbers(high=1.0, share=share), NO_FILTERS, 1.0, filters, state)
        assert (state[COMMAND], state[MEMORY]) == (1.0, memory)


def test_an_error_that_was_ever_there_moves_nothing_without_an_integral() -> None:
    filters, state = np.zeros((1, 2)), np.zeros(STATES)
    start_at_rest(FILTER, 0.7, filters, state)
    gains = numbers(ki=0.0, kd=3.0, pole=0.5)
    found = [next_command(gains, FILTER, 0.7, filters, state) for _ in range(5)]
    assert found == pytest.approx([0.0] * 5, abs=1e-12)
