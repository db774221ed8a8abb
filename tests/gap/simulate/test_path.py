"""First-order states are ordered, stepped as the matrix exponential steps them, and spread over lanes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from bayes_hw.gap.simulate.path import OUTPUTS, Path, ordered, states

POLES = np.array([-0.4 + 7j, 0.0, -30.0, -2.0 + 21j])
DOORS = 2


def path(seed: int) -> Path:
    """Four states of random gains, a resonance first and an integrator second."""
    rng = np.random.default_rng(seed)
    gains = rng.normal(size=(DOORS + OUTPUTS, 4)) + 1j * rng.normal(size=(DOORS + OUTPUTS, 4))
    gains[:, POLES.imag == 0] = gains[:, POLES.imag == 0].real
    return Path(*ordered(POLES, gains[:DOORS], gains[DOORS:]))


def test_real_poles_come_first_with_their_own_gains() -> None:
    found, order = path(0), [1, 2, 0, 3]
    rng = np.random.default_rng(0)
    gains = rng.normal(size=(DOORS + OUTPUTS, 4)) + 1j * rng.normal(size=(DOORS + OUTPUTS, 4))
    gains[:, [1, 2]] = gains[:, [1, 2]].real
    assert found.shape == (2, 2)
    np.testing.assert_array_equal(found.poles, POLES[order])
    np.testing.assert_array_equal(found.inputs, gains[:DOORS, order])
    np.testing.assert_array_equal(found.outputs, gains[DOORS:, order])


@pytest.mark.parametrize("h", [0.005, 0.05])
def test_a_step_is_that_of_the_matrix_exponential(h: float) -> None:
    """x' = F x + B v in real coordinates, v held: the exponential of F, B and nothing beneath."""
    found = path(1)
    held = states([found], h)
    blocks = [np.array([[p.real]]) for p in found.poles[:2]]
    blocks += [np.array([[p.real, -p.imag], [p.imag, p.real]]) for p in found.poles[2:]]
    motion = block_diag(*blocks)
    for door in range(DOORS):
        into = np.concatenate([found.inputs[door, :2].real, found.inputs[door, 2:].view(np.float64)])
        augmented = np.zeros((7, 7))
        augmented[:6, :6], augmented[:6, 6] = motion, into
        into_step = expm(augmented * h)[:6, 6]
        np.testing.assert_allclose(held.inputs[door, :, 0], into_step, rtol=1e-10, atol=1e-14)
    turn = expm(motion * h)
    np.testing.assert_allclose(held.factors[:, 0], turn[[0, 1, 2, 3, 4, 5], [0, 1, 2, 2, 4, 4]], rtol=1e-10)
    x = np.array([1.0, -2.0, 0.3, 0.4, -0.5, 0.6])
    pairs = x[2:].view(np.complex128)
    shown = found.outputs[:, :2].real @ x[:2] + 2 * (found.outputs[:, 2:] @ pairs).real
    np.testing.assert_allclose(held.outputs[:, :, 0] @ x, shown, rtol=1e-12)


def test_lanes_after_the_paths_repeat_them() -> None:
    paths, lanes = [path(seed) for seed in range(3)], np.array([0, 1, 2, 0, 1, 2, 2, 2])
    together = states(paths, 0.02, lanes)
    for lane, own in enumerate(lanes):
        alone = states([paths[own]], 0.02)
        for part, one in zip(together[1:], alone[1:], strict=True):
            np.testing.assert_array_equal(part[..., lane], one[..., 0])
