"""How far a constant torque moves an axis, apart from what moves it on and on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE

from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.posterior.reported_quantities import static_gain
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports

FORM = FORMS[0]
ONE, TWO, FAST = 0.02, -0.01, 0.6


def gain(slow: float) -> float:
    """Of one section with two real poles, of records of 1,000 samples."""
    cascade = replace(
        CASCADE,
        real=np.zeros((2, 0)),
        sections=np.array([[slow + FAST], [slow * FAST], [0.0], [0.0]]),
    )
    ports = replace(Ports.none(0, 1), sections=np.array([[ONE], [TWO]]))
    return static_gain(Effect(FORM, np.zeros(0), ports), JointValues(cascade), 1000)


def test_a_pole_that_settles_counts_whole() -> None:
    assert gain(0.9) == pytest.approx((ONE + TWO) / (0.1 * 0.4))


def test_of_a_pole_that_never_settles_only_the_other_counts() -> None:
    """The fast fraction alone, which a torque reaches within the record: the sum of its impulse response."""
    slow = 1 - 1e-7
    impulse = (ONE * FAST + TWO) / (FAST - slow) * FAST ** np.arange(60)
    assert gain(slow) == pytest.approx(float(impulse.sum()))
