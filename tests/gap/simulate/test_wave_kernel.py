"""Compiled waves against sines, cosines and their means written out."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.simulate.wave_kernel import add_products, turns_of, wave_responses
from bayes_hw.model.lanes import LANES

SAMPLES = 2 * LANES


def test_waves_driving_states_of_one_pole() -> None:
    """Their means over the moves by sinc at the nodes, less the start; zero where nothing is seen."""
    rng = np.random.default_rng(0)
    places, moves, scale = rng.normal(size=(3, SAMPLES))
    moves[3] = 0.0
    frequencies = 0.7 + 0.05 * np.arange(LANES)
    nodes, weights = np.array([0.7, 1.4]), rng.uniform(size=(2, LANES))
    start, seen = rng.normal(size=(2, LANES)), (np.arange(SAMPLES) % 5 > 0).astype(np.float64)
    turns, found = np.empty((SAMPLES, 2 * LANES)), np.empty((SAMPLES, 2 * LANES))
    turns_of(2 * np.pi * 0.05 * places, turns)
    rows = [x.reshape(-1, LANES) for x in (places, moves, scale)]
    angles = 2 * np.pi * places[:, None] * frequencies
    means = np.sinc(moves[:, None] * nodes) @ weights
    sines, cosines = scale[:, None] * np.sin(angles) * means, scale[:, None] * np.cos(angles) * means
    waves = np.concatenate([sines - start[0], cosines - start[1]], axis=1)
    none = np.zeros(0)
    wave_responses(0.7, *rows, turns, nodes, weights, start, seen, 0, none, none, none, found)
    np.testing.assert_allclose(found, seen[:, None] * waves, atol=1e-12)
    pole = [np.array([value]) for value in (0.9, 0.3, 2.0)]
    wave_responses(0.7, *rows, turns, nodes, weights, start, seen, 1, *pole, found)
    expected, state = np.empty_like(found), np.zeros(2 * LANES)
    for k in range(SAMPLES):
        expected[k] = seen[k] * 2.0 * state
        state = 0.9 * state + 0.3 * waves[k]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_products_are_added() -> None:
    white, products = np.random.default_rng(1).normal(size=(50, 2 * LANES)), np.ones((3, LANES))
    add_products(white, products)
    sines, cosines = white[:, :LANES], white[:, LANES:]
    expected = [np.sum(a * b, axis=0) for a, b in ((sines, sines), (cosines, cosines), (sines, cosines))]
    np.testing.assert_allclose(products, 1 + np.array(expected))
