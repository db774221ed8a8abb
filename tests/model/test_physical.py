"""Mechanics that a model states: both ways of stating them are the same, and what is wrong is named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.physical import Physical

MASSES: dict[str, Any] = {
    "inertias": [0.5, 1.0],
    "bearings": [0.1, 0.2],
    "springs": [{"between": [0, 1], "stiffness": 60.0, "damping": 0.8}],
    "motor": 0,
    "load": 1,
    "sensor": 1,
    "loop": {"kp": 5.0, "ki": 0.0},
}
STATES: dict[str, Any] = {
    "A": [[0, 0, 1, 0], [0, 0, 0, 1], [-120, 120, -11.8, 1.6], [60, -60, 0.8, -1.0]],
    "B": [[0, 0], [0, 0], [2, 0], [0, 1]],
    "sensor": [0, 1, 0, 0],
    "motor": [1, 0, 0, 0],
    "load": [0, 1, 0, 0],
    "inertias": [0.5, 1.0],
    "stiffness": 60.0,
    "damping": 0.8,
}


def test_masses_and_their_state_space_are_the_same() -> None:
    one, other = Physical.from_dict(MASSES), Physical.from_dict(STATES)
    for name in ("a", "torques", "sensor", "motor", "load"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-12)
    assert (one.inertias, one.stiffness, one.damping) == (other.inertias, other.stiffness, other.damping)


def test_at_rest_an_integral_holds_the_motor_against_a_torque() -> None:
    """A steady torque on the motor turns it nowhere beside an integral, and on without one."""
    for ki, turned in ((3.0, 0.0), (0.0, 1 / (5.0 + 0.3))):
        known = Physical.from_dict({**MASSES, "loop": {"kp": 5.0, "ki": ki}})
        x = np.zeros(len(known.a))
        for _ in range(40_000):
            x = x + 1e-3 * (known.a @ x + known.torques[:, 0])
        speed = known.motor @ (known.a @ x + known.torques[:, 0])
        assert speed == pytest.approx(turned, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"springs": []}, "springs: none is between motor and load"),
        ({"inertias": [0.5, -1.0]}, "inertias: must be positive"),
        ({"motor": 2}, "motor: must be the number of a body"),
        ({"loop": {"kp": 5.0}}, "loop.ki"),
        ({"bearings": [0.1]}, "bearings: must have 2"),
        ({"springs": [{"between": [0, 1], "stiffness": 0, "damping": 1}]}, r"springs\[0\].stiffness"),
        ({**STATES, "B": [[0, 0]]}, "B: must be 4 by 2"),
        ({**STATES, "A": [[1, "x"]]}, "A: must hold numbers"),
        ({**STATES, "load": [1, 0]}, "load: must have 4"),
    ],
)
def test_what_is_wrong_is_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Physical.from_dict({**MASSES, **change})


def test_a_model_keeps_what_it_states() -> None:
    model = HammersteinWiener.from_dict(
        {
            "sample_rate_hz": 20.0,
            "saturation": {"lower": -1, "upper": 1},
            "linear": {"zeros": [], "poles": [[1, 0], [0.5, 0]], "gain": 0.1, "delay_samples": 0},
            "dead_zone": {"half_width": 0.01},
            "physical": MASSES,
        }
    )
    assert model.to_dict()["physical"] == MASSES
    with pytest.raises(InputError, match="physical"):
        HammersteinWiener.from_dict({**model.to_dict(), "physical": {"inertias": [1, 2]}})
