"""Rows made once say what stepping says: outputs ahead under a held input, many steps at a time."""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.state_kernel import later_rows, output_of, repeated, response_to, stepped
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, load, store

REAL, PAIRS, STEPS = 2, 2, 5
STATES = REAL + 2 * PAIRS


def filled(values: FloatArray) -> FloatArray:
    """Rows (n, LANES) as the kernels take them."""
    rows = aligned_rows(len(values))
    rows[:] = values
    return np.asarray(rows)


def system(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Factors, inputs, weights of one output and states (n, LANES) of a stable system, each lane its own."""
    rng = np.random.default_rng(seed)
    factors = np.empty((STATES, LANES))
    factors[:REAL] = rng.uniform(0.2, 1.0, (REAL, LANES))
    turn = rng.uniform(0.1, 2.0, (PAIRS, LANES))
    radius = rng.uniform(0.5, 1.0, (PAIRS, LANES))
    factors[REAL::2], factors[REAL + 1 :: 2] = radius * np.cos(turn), radius * np.sin(turn)
    inputs, weights, x = rng.normal(size=(3, STATES, LANES))
    return filled(factors), filled(inputs), filled(weights), filled(x)


def matrix(factors: FloatArray, lane: int) -> FloatArray:
    """The transition (states, states) of one lane."""
    found = np.diag(factors[:, lane])
    for i in range(REAL, STATES, 2):
        c, s = factors[i, lane], factors[i + 1, lane]
        found[i : i + 2, i : i + 2] = [[c, -s], [s, c]]
    return found


@njit
def read_ahead(factors, inputs, rows, by_input, x, v, found):  # type: ignore[no-untyped-def]
    """The output 0 to STEPS steps on under a held v."""
    later_rows(rows, by_input, 0, STEPS, factors, inputs, REAL, STATES)
    for j in range(STEPS + 1):
        store(found, j, output_of(j, rows, x) + load(by_input, j) * broadcast(v))


@njit
def many_steps(factors, inputs, x, v):  # type: ignore[no-untyped-def]
    """The states STEPS steps later, in one."""
    all_factors, all_inputs = aligned_rows(STATES), aligned_rows(STATES)
    repeated(factors, inputs, STEPS, REAL, all_factors, all_inputs)
    stepped(all_factors, all_inputs, 0, broadcast(v), REAL, x)


@njit
def one_response(rows, inputs, found):  # type: ignore[no-untyped-def]
    store(found, 0, response_to(0, rows, 0, inputs, STATES))


def test_outputs_read_ahead_are_those_of_stepping() -> None:
    factors, inputs, weights, x = system(1)
    rows = filled(np.concatenate([weights, np.zeros((STEPS * STATES, LANES))]))
    by_input, found, v = filled(np.zeros((STEPS + 1, LANES))), np.empty((STEPS + 1, LANES)), 0.7
    read_ahead(factors, inputs, rows, by_input, x, v, found)
    for lane in range(LANES):
        state, transition = x[:, lane].copy(), matrix(factors, lane)
        for j in range(STEPS + 1):
            np.testing.assert_allclose(found[j, lane], weights[:, lane] @ state, rtol=1e-12)
            state = transition @ state + inputs[:, lane] * v


def test_many_steps_at_once_are_as_many_single_ones() -> None:
    factors, inputs, _, x = system(2)
    expected = x.copy()
    for lane in range(LANES):
        for _ in range(STEPS):
            expected[:, lane] = matrix(factors, lane) @ expected[:, lane] - 1.3 * inputs[:, lane]
    many_steps(factors, inputs, x, -1.3)
    np.testing.assert_allclose(x, expected, rtol=1e-12)


def test_a_unit_input_adds_its_gains_times_the_weights() -> None:
    _, inputs, weights, _ = system(3)
    found = np.empty((1, LANES))
    one_response(weights, inputs, found)
    np.testing.assert_allclose(found[0], np.sum(weights * inputs, axis=0), rtol=1e-12)
