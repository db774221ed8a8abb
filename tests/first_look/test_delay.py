"""A known delay lies in its interval."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_axes import delayed_integrator

from bayes_hw.first_look.delay import delay


@pytest.mark.parametrize("samples", [1, 2, 5, 12])
@pytest.mark.parametrize("sigma", [1e-5, 3e-3])
def test_integrators_delay(samples: int, sigma: float) -> None:
    rng = np.random.default_rng(samples)
    u = rng.standard_normal(3000)
    record = delayed_integrator(u, 50.0, samples, sigma, rng)
    found = delay([record.y], [u], 50.0)
    assert found is not None
    assert found.low - 1e-12 <= samples / 50 <= found.high + 1e-12
    assert found.high - found.low < 0.03
    assert found.low <= found.mean <= found.high


def test_delay_of_a_fast_record_is_read_from_block_means() -> None:
    rng = np.random.default_rng(5)
    u = np.repeat(rng.standard_normal(3000), 10)
    record = delayed_integrator(u, 500.0, 37, 1e-6, rng)
    found = delay([record.y], [u], 500.0)
    assert found is not None
    assert found.low <= 37 / 500 <= found.high


def test_no_delay_without_motion() -> None:
    assert delay([np.random.default_rng(1).standard_normal(1000)], [np.zeros(1000)], 20.0) is None
