"""Zeros from poles and residues are those that the model was built from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from spread_axis import spread_posterior

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.plant_summary import antiresonances, minimum_phase, zeros
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode


@pytest.mark.parametrize("free", ["conditional", "all"])
def test_zeros_of_the_printed_model(free: str) -> None:
    model = nanshan_model()
    found = zeros(AxisDraws.nominal(spread_posterior(model, free)))[:, 0]  # type: ignore[arg-type]
    finite = found[np.abs(found) < 10]
    for zero in model.linear.zeros:
        assert np.abs(finite - zero).min() < 1e-6


def test_zeros_with_a_direct_term(small_axis: HammersteinWiener) -> None:
    wanted = np.array([0.5 + 0.3j, 0.5 - 0.3j, -0.2])
    model = replace(small_axis, linear=LinearBlock(wanted, small_axis.linear.poles, 0.02, 1))
    found = zeros(AxisDraws.nominal(spread_posterior(model)))[:, 0]
    np.testing.assert_allclose(np.sort_complex(found)[:3], np.sort_complex(wanted), atol=1e-9)


def test_antiresonance_and_its_side_of_the_circle(small_axis: HammersteinWiener) -> None:
    """A zero pair at 3 Hz, damped or beyond the unit circle: frequency, sign of the damping, phase."""
    for damping in (0.02, -0.02):
        pair = Mode(3.0, damping).pole(20.0)
        linear = LinearBlock(np.array([pair, pair.conjugate()]), small_axis.linear.poles, 0.02, 1)
        posterior = spread_posterior(replace(small_axis, linear=linear), "all", spread=1e-4)
        axis = AxisDraws.of_posterior(posterior, posterior.draws(50, np.random.default_rng(1)))
        (found,) = antiresonances(axis, AxisDraws.nominal(posterior))
        assert found.nominal_hz == pytest.approx(3.0, rel=1e-6)
        assert found.nominal_damping == pytest.approx(damping, rel=1e-4)
        assert found.frequency_hz == pytest.approx(np.full(50, 3.0), rel=0.01)
        assert (np.sign(found.damping_ratio) == np.sign(damping)).all()
        assert (minimum_phase(zeros(axis)) == (damping > 0)).all()


def test_held_zeros_do_not_move(axis: AxisDraws, nominal: AxisDraws) -> None:
    found = zeros(axis)
    np.testing.assert_allclose(found[0], np.repeat(zeros(nominal)[0], axis.count), atol=1e-9)
    assert np.isinf(found[1:]).all()
