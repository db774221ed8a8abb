"""Subspace identification finds the poles of a known system, from one record or several."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.subspace import observability_subspace
from bayes_hw.model.linear import LinearBlock, Mode

RATE_HZ = 20.0
POLE = Mode(2.0, 0.05).pole(RATE_HZ)
POLES = np.array([POLE, np.conj(POLE), 0.6], dtype=complex)
SYSTEM = LinearBlock(np.array([0.3 + 0j]), POLES, 0.1, 0)


def sorted_poles(poles: ComplexArray) -> ComplexArray:
    return poles[np.lexsort((poles.imag, poles.real.round(6)))]


def data(
    count: int, samples: int, correlation: float, size: float
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Inputs and outputs of SYSTEM with AR(1) noise of `size` times the output's spread."""
    rng = np.random.default_rng(7)
    inputs = [rng.standard_normal(samples) for _ in range(count)]
    outputs = []
    for u in inputs:
        y = SYSTEM.filter(u)
        noise = LinearBlock(np.zeros(0), np.array([correlation + 0j]), 1.0, 0).filter(
            rng.standard_normal(samples)
        )
        outputs.append(y + size * y.std() * noise / noise.std())
    return inputs, outputs


@pytest.mark.parametrize("count", [1, 3])
def test_noise_free_poles_are_exact(count: int) -> None:
    subspace = observability_subspace(*data(count, 400, 0.5, 0.0), block_rows=10)
    np.testing.assert_allclose(sorted_poles(subspace.poles(3)), sorted_poles(POLES), atol=1e-8)


def test_noise_free_order_shows_in_the_singular_values() -> None:
    weights = observability_subspace(*data(1, 400, 0.5, 0.0), block_rows=10).singular_values
    assert weights[3] < 1e-9 * weights[2]


def test_coloured_noise_does_not_bias_the_mode() -> None:
    subspace = observability_subspace(*data(3, 4000, 0.8, 0.2), block_rows=10)
    mode = Mode.from_pole(complex(subspace.poles(3)[np.argmax(subspace.poles(3).imag)]), RATE_HZ)
    assert mode.frequency_hz == pytest.approx(2.0, rel=0.01)
    assert mode.damping_ratio == pytest.approx(0.05, rel=0.2)


def test_chunks_do_not_change_the_result(monkeypatch: pytest.MonkeyPatch) -> None:
    inputs, outputs = data(2, 400, 0.5, 0.1)
    whole = observability_subspace(inputs, outputs, 10).singular_values
    monkeypatch.setattr("bayes_hw.identify.subspace.CHUNK", 60)
    np.testing.assert_allclose(observability_subspace(inputs, outputs, 10).singular_values, whole)


def test_too_short_records_are_refused() -> None:
    with pytest.raises(ValueError, match="longer than 40"):
        observability_subspace([np.zeros(35)], [np.zeros(35)], 10)
