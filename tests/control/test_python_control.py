"""python-control's transfer functions: there and back, and what is refused."""

from __future__ import annotations

import control
import numpy as np
import pytest

from bayes_hw.control.python_control import model_of_transfer_function, transfer_function
from bayes_hw.errors import InputError
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

BLOCKS = {"saturation": Saturation(-0.8, 1.0), "dead_zone": DeadZone(0.02)}


def test_its_response_is_that_of_the_linear_block(small_axis: HammersteinWiener) -> None:
    """python-control evaluates the same G, delay included."""
    system = transfer_function(small_axis)
    assert system.dt == pytest.approx(0.05)
    frequency = np.array([0.1, 1.0, 2.0, 5.0])
    expected = small_axis.linear.frequency_response(frequency, small_axis.sample_rate_hz)
    np.testing.assert_allclose(system(np.exp(2j * np.pi * frequency * system.dt)), expected, rtol=1e-9)


def test_there_and_back(small_axis: HammersteinWiener) -> None:
    back = model_of_transfer_function(transfer_function(small_axis), noise_sigma=0.01, **BLOCKS)
    u = np.random.default_rng(1).normal(0, 1, 300)
    np.testing.assert_allclose(back.simulate(u).y, small_axis.simulate(u).y, atol=1e-10)
    assert back.name == small_axis.name
    assert back.dominant_modes[0].frequency_hz == pytest.approx(2.0)


def test_a_continuous_system_is_refused_until_it_is_sampled() -> None:
    """A known answer: a zero-order hold of 1/s steps up by the sample time at every sample."""
    continuous = control.tf([1.0], [1.0, 0.0])
    with pytest.raises(InputError, match=r"control.sample_system"):
        model_of_transfer_function(continuous, **BLOCKS)
    model = model_of_transfer_function(control.sample_system(continuous, 0.1, "zoh"), **BLOCKS)
    np.testing.assert_allclose(model.simulate(np.full(5, 0.5)).w, 0.05 * np.arange(5), atol=1e-12)


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (control.tf([1.0], [1.0, -0.5], True), "no sample time"),
        (control.tf([1.0], [1.0, -1.5], 0.1), "unstable"),
        (control.tf([[[1.0], [1.0]]], [[[1.0, -0.5], [1.0, -0.5]]], 0.1), "2 inputs and 1 outputs"),
        (control.tf([1.0, 0.0, 0.0], [1.0, -0.5], 0.1), "improper"),
    ],
)
def test_what_is_no_axis_is_refused(system: control.TransferFunction, said: str) -> None:
    with pytest.raises(InputError, match=said):
        model_of_transfer_function(system, **BLOCKS)
