"""Gain and lag of a known input, against the response to a wave of its column summed from impulses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.posterior.reported_quantities import gain_and_lag
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.search.known_input import forms_of

SAMPLES = 4000
LAG = 4.3


def _impulse(ports: Ports, pole: float) -> FloatArray:
    """Of the direct path, one real pole and the section of the small axis."""
    k = np.arange(SAMPLES - 1)
    found = np.zeros(SAMPLES)
    found[1:] = ports.direct[0] * ports.direct[1] ** k + ports.real[0] * pole**k
    a1, a2 = CASCADE.sections[:2, 0]
    section = np.zeros(SAMPLES)
    section[1] = ports.sections[0, 0]
    section[2] = a1 * section[1] + ports.sections[1, 0]
    for n in range(3, SAMPLES):
        section[n] = a1 * section[n - 1] - a2 * section[n - 2]
    return found + section


@pytest.mark.parametrize("cycles", [0.002, 0.01, 0.06])
def test_a_torque_through_every_kind_of_path(cycles: float) -> None:
    pole = 0.95
    ports = Ports(
        np.array([0.0004]),
        np.array([[0.0012], [-0.0007]]),
        np.array([0.0003, 0.5]),
        np.zeros(1),
        np.zeros((2, 1)),
    )
    effect = Effect(forms_of("wind")[0], np.array([LAG]), ports)
    values = JointValues(replace(CASCADE, real=np.array([[pole], [0.1]])), (effect,))
    gain, lag = gain_and_lag(effect, values, cycles)
    turned = np.exp(-2j * np.pi * cycles * np.arange(SAMPLES))
    expected = np.sum(_impulse(ports, pole) * turned) * np.exp(-2j * np.pi * cycles * LAG)
    assert gain * np.exp(-2j * np.pi * cycles * lag) == pytest.approx(expected, rel=1e-6)


def test_a_part_of_the_reading_is_what_it_says() -> None:
    effect = Effect(forms_of("wind")[1], np.array([-0.02, LAG]))
    assert gain_and_lag(effect, JointValues(CASCADE, (effect,)), 0.01) == (-0.02, LAG)
