"""The eigensystem realisation gives back a system from its responses, also one near that of its bases."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from bayes_hw.arrays import FloatArray
from bayes_hw.simulators.fmu_axis import Realisation

STEPS = 600


def system(frequency: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """An integrator, a lag and a damped swing at a frequency (rad a step), two inputs, three outputs."""
    rotation = 0.99 * np.array(
        [[np.cos(frequency), -np.sin(frequency)], [np.sin(frequency), np.cos(frequency)]]
    )
    a = block_diag(np.eye(1), np.array([[0.9]]), rotation)
    rng = np.random.default_rng(1)
    return a, rng.standard_normal((4, 2)), rng.standard_normal((3, 4)) * np.array([[1.0], [1e-3], [100.0]])


def responses(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    found, state = [np.zeros((3, 2))], b
    for _ in range(STEPS - 1):
        found.append(c @ state)
        state = a @ state
    return np.array(found)


@pytest.mark.parametrize("frequency", [0.2, 0.23])
def test_responses_come_back(frequency: float) -> None:
    bases = Realisation.of(responses(*system(0.2)))
    assert bases.left.shape[1] == 4
    wanted = responses(*system(frequency))
    given = responses(*bases.system(wanted))
    scale = np.abs(wanted).max(axis=(0, 2), keepdims=True)
    np.testing.assert_allclose(given / scale, wanted / scale, atol=1e-8)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(bases.system(wanted)[0])),
        np.sort_complex(np.linalg.eigvals(system(frequency)[0])),
        atol=1e-7,
    )


def test_responses_that_are_too_short_are_told_by_their_error() -> None:
    """A second system, seen only after the first steps, is missing from what these tell."""
    alone = responses(*system(0.2))
    late = alone.copy()
    late[len(late) // 2 :] += 0.1 * alone[: len(alone) - len(late) // 2]
    steps = len(alone) // 3
    assert Realisation.of(alone[:steps]).error(alone, steps) < 1e-9
    assert Realisation.of(late[:steps]).error(late, steps) > 1e-3
