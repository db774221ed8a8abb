"""Records at a lower rate, for the search of long ones, and the way back to the full rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from known_axis import commands, known_axis, simulated_records

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.lowered import lowered
from bayes_hw.identify.long_records import at_higher_rate

FACTOR = 4
STRUCTURE = Structure(2, integrator=True, real_poles=1, sections=2, lower=True, upper=True, dead_zone=True)
VALUES = CascadeValues(
    -0.3, 0.4, 0.006, 0.0, 0.02,
    np.array([[0.7], [-0.01]]),
    np.array([[1.2, 0.9], [0.8, 0.18], [0.004, -0.01], [0.002, 0.003]]),
    np.zeros((1, 6)),
)  # fmt: skip
"""Of a lower rate; its second section has two real poles."""


def test_a_lower_rate_keeps_commands_and_what_was_not_measured() -> None:
    rng = np.random.default_rng(1)
    (record,) = simulated_records(known_axis(), commands(rng, 1, 0.3), rng, 0.01)
    measured = np.arange(len(record)) % 5 != 0
    held = replace(record, measured=measured, known={"wind": 2 * record.y})
    found = lowered(held, 3)
    assert found.sample_rate_hz == record.sample_rate_hz / 3
    assert len(found) == len(found.known["wind"]) == len(record) // 3
    np.testing.assert_allclose(found.u, held.u.reshape(-1, 3).mean(axis=1))
    np.testing.assert_array_equal(found.y[measured[::3]], record.y[::3][measured[::3]])
    np.testing.assert_array_equal(found.known["wind"], held.known["wind"][::3])
    np.testing.assert_array_equal(found.measured_samples, measured[::3])


def _at_both_rates(
    u: FloatArray, structure: Structure, values: CascadeValues
) -> tuple[FloatArray, FloatArray]:
    """w at the samples of the lower rate, from the cascade of the higher rate and from its own."""
    (record,) = simulated_records(known_axis(), [u], np.random.default_rng(1), 0.0)
    faster, moved = at_higher_rate(structure, values, FACTOR, 1)
    assert faster.delay_samples == FACTOR * structure.delay_samples and faster.order == structure.order
    fast = CascadeResponse(faster, [record]).intermediate(moved, 0)[::FACTOR]
    return fast, CascadeResponse(structure, [lowered(record, FACTOR)]).intermediate(values, 0)


def test_a_cascade_responds_alike_at_both_rates() -> None:
    """For commands held over the longer interval."""
    held = np.repeat(np.random.default_rng(2).normal(0, 0.4, 150), FACTOR)
    fast, slow = _at_both_rates(held, STRUCTURE, VALUES)
    np.testing.assert_allclose(fast, slow, rtol=0, atol=1e-9)


def test_what_limits_clip_within_an_interval_is_counted() -> None:
    """An integrator is driven by the sum of the clipped commands at any rate."""
    u = np.random.default_rng(2).normal(0, 0.4, 600)
    assert 0.2 < np.mean((u < VALUES.lower) | (u > VALUES.upper)) < 0.8
    alone = replace(STRUCTURE, real_poles=0, sections=0)
    values = replace(VALUES, real=np.zeros((2, 0)), sections=np.zeros((4, 0)), starts=np.zeros((1, 1)))
    fast, slow = _at_both_rates(u, alone, values)
    np.testing.assert_allclose(fast, slow, rtol=0, atol=1e-12)


def test_derivatives_hold_at_a_lower_rate() -> None:
    """Those of the limits count the share of each interval beyond them."""
    rng = np.random.default_rng(3)
    (record,) = simulated_records(known_axis(), [rng.normal(0, 0.4, 600)], rng, 0.0)
    response = CascadeResponse(STRUCTURE, [lowered(record, FACTOR)])
    at = response.coordinates(VALUES)
    rows = next(iter(response.linearise(at, 0)))[0]
    for row in range(3):
        step = np.zeros(len(at))
        step[row] = 1e-7
        quotient = (response.residuals(at - step)[0] - response.residuals(at + step)[0]) / 2e-7
        assert np.median(np.abs(quotient - rows[row])) < 1e-6
        assert np.mean(np.abs(quotient - rows[row]) < 1e-5) > 0.98


def test_a_pole_that_no_mode_has_settles_at_once() -> None:
    values = replace(VALUES, real=np.array([[-0.3], [0.013]]))
    structure, found = at_higher_rate(STRUCTURE, values, FACTOR, 1)
    (pole,), (residue,) = found.real
    assert 0 < pole**FACTOR < 0.05
    assert np.isclose(residue / (1 - pole), 0.01)
    assert structure.sections == 2
