"""A torque as the acceleration of the axis, found from the ports without any inertia."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import form
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.posterior.torque_scale import acceleration_draws, acceleration_of_unit
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.cascade import CascadeValues, Structure

RATE = 40.0
STRUCTURE = Structure(0, True, 0, 1, lower=False, upper=False, dead_zone=False)


def rigid_axis(acceleration: float, stiffness: float) -> JointValues:
    """One inertia whose speed a PI loop holds: speed' = 2 d w (v - speed) + w^2 z + a tau, z' = v - speed.

    Position over command and over torque are sampled with a hold; both have the loop's pole pair.
    """
    damping = 0.7
    a = np.array([[0, 1, 0], [0, -2 * damping * stiffness, stiffness**2], [0, -1, 0]])
    b = np.array([[0, 0], [2 * damping * stiffness, acceleration], [1, 0]])
    system = signal.cont2discrete((a, b, np.array([[1.0, 0, 0]]), np.zeros((1, 2))), 1 / RATE)
    a, b, c = system[:3]
    poles = np.linalg.eigvals(a)
    pole = poles[np.argmax(poles.imag)]
    section = [2 * pole.real, abs(pole) ** 2]
    residue, *drive = _parts(a, b[:, 0], c, section)
    _, *port = _parts(a, b[:, 1], c, section)
    cascade = CascadeValues(
        -np.inf,
        np.inf,
        0.0,
        0.0,
        residue,
        np.zeros((2, 0)),
        np.array([[*section, *drive]]).T,
        np.zeros((1, 3)),
    )
    ports = Ports(np.zeros(0), np.array(port)[:, None], np.array([0.0, 0.5]), np.zeros(0), np.zeros((2, 1)))
    friction = Effect(form("friction", "Coulomb, load"), np.array([0.01]), ports)
    return JointValues(cascade, (friction,))


def _parts(a: FloatArray, b: FloatArray, c: FloatArray, section: list[float]) -> list[float]:
    """Residue of the pole at one and the section's numerator, from the impulse response."""
    impulse = [float((c @ np.linalg.matrix_power(a, k) @ b)[0]) for k in range(40)]
    columns = [
        np.ones(40),
        signal.lfilter([1.0, 0.0], [1.0, -section[0], section[1]], np.eye(1, 40)[0]),
        signal.lfilter([0.0, 1.0], [1.0, -section[0], section[1]], np.eye(1, 40)[0]),
    ]
    return list(np.linalg.lstsq(np.column_stack(columns), np.array(impulse), rcond=None)[0])


@pytest.mark.parametrize("stiffness", [3.0, 20.0])
def test_it_is_the_acceleration_whatever_the_loop(stiffness: float) -> None:
    values = rigid_axis(1.7, stiffness)
    assert acceleration_of_unit(STRUCTURE, values, values.effects[0], RATE) == pytest.approx(1.7, rel=0.03)
    assert acceleration_draws(STRUCTURE, [values], 0, RATE) == pytest.approx([1.7], rel=0.03)


def test_without_an_integrator_nothing_is_said() -> None:
    values = rigid_axis(1.7, 3.0)
    still = Structure(0, False, 0, 1, lower=False, upper=False, dead_zone=False)
    assert acceleration_of_unit(still, values, values.effects[0], RATE) is None
