"""A torque as the acceleration of the axis, found from the ports without any inertia."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import form
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.posterior.torque_scale import acceleration_draws, acceleration_of_unit
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.plant.drive_train import LOAD, LOAD_TORQUE, MOTOR_TORQUE, REFERENCE, DriveTrain

RATE = 100.0
DRAWS = 100
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


def powers(a: FloatArray, b: FloatArray, count: int) -> FloatArray:
    """a^k b (count, n), k from 0."""
    found = np.empty((count, len(b)))
    for k in range(count):
        found[k], b = b, a @ b
    return found


def _parts(a: FloatArray, b: FloatArray, c: FloatArray, section: list[float]) -> list[float]:
    """Residue of the pole at one and the section's numerator, from the impulse response."""
    impulse = (powers(a, b, 100) @ c.T)[:, 0]
    columns = [
        np.ones(100),
        signal.lfilter([1.0, 0.0], [1.0, -section[0], section[1]], np.eye(1, 100)[0]),
        signal.lfilter([0.0, 1.0], [1.0, -section[0], section[1]], np.eye(1, 100)[0]),
    ]
    return list(np.linalg.lstsq(np.column_stack(columns), impulse, rcond=None)[0])


DRIVE = DriveTrain(1.0, 0.3, 1.8, 0.01, 3.4, 0.01, 40.0, 2.2, 0.8)


def elastic_axis(drive: DriveTrain, name: str, late: int) -> tuple[JointValues, Structure]:
    """The drive train's own G, `late` samples later than told, and the port of its friction, from impulse
    responses of the sampled state space."""
    side = LOAD_TORQUE if name.endswith("load") else MOTOR_TORQUE
    keep = 7
    step, forcing = (m[:keep] for m in drive.step_matrices(1 / RATE))
    step = step[:, :keep]
    poles = np.linalg.eigvals(step)
    moving = poles[np.argsort(np.abs(poles - 1))[1:]]
    real = np.sort(moving[np.abs(moving.imag) < 1e-12].real)
    upper = moving[moving.imag > 1e-12]
    pairs = np.array([[2 * p.real, abs(p) ** 2] for p in upper])

    def parts(column: FloatArray, delay: int) -> FloatArray:
        ahead = np.linalg.matrix_power(step, max(-delay, 0))
        impulse = powers(step, ahead @ column, 400)[:, LOAD]
        unit = np.eye(1, 400)[0]
        bases = [np.ones(400)] + [signal.lfilter([1.0], [1.0, -p], unit) for p in real]
        for a1, a2 in pairs:
            bases += [signal.lfilter(top, [1.0, -a1, a2], unit) for top in ([1.0], [0.0, 1.0])]
        shifted = np.concatenate([np.zeros(max(delay, 0)), impulse])[:400]
        return np.asarray(
            np.linalg.lstsq(np.column_stack(bases)[max(delay, 0) :], shifted[max(delay, 0) :])[0]
        )

    command, torque = parts(forcing[:, REFERENCE], late), parts(forcing[:, side], 0)
    n = len(real)
    cascade = CascadeValues(
        -np.inf,
        np.inf,
        0.0,
        0.0,
        float(command[0]),
        np.vstack([real, command[1 : 1 + n]]),
        np.vstack([pairs.T, command[1 + n :].reshape(-1, 2).T]),
        np.zeros((1, 3)),
    )
    ports = Ports(
        torque[1 : 1 + n],
        torque[1 + n :].reshape(-1, 2).T,
        np.array([0.0, 0.5]),
        np.zeros(0),
        np.zeros((2, 1)),
    )
    structure = Structure(n, True, len(pairs), 1, lower=False, upper=False, dead_zone=False)
    return JointValues(cascade, (Effect(form("friction", name), np.array([0.01]), ports),)), structure


def at_rest_of(drive: DriveTrain) -> tuple[Structure, JointValues, Effect, float]:
    """What `acceleration_of_unit` takes, of the axis without a delay."""
    values, structure = elastic_axis(drive, "Coulomb, load", 0)
    return structure, values, values.effects[0], RATE


@pytest.mark.parametrize("stiffness", [3.0, 20.0])
def test_it_is_the_acceleration_whatever_the_loop(stiffness: float) -> None:
    values = rigid_axis(1.7, stiffness)
    rng = np.random.default_rng(1)
    assert acceleration_of_unit(STRUCTURE, values, values.effects[0], RATE) == pytest.approx(1.7, rel=0.03)
    drawn = acceleration_draws(STRUCTURE, values, [values], 0, RATE, rng)
    assert drawn == pytest.approx([1.7], rel=0.03)


@pytest.mark.parametrize("late", [-1, 2])
def test_a_delay_that_went_to_the_wrong_place_changes_nothing(late: int) -> None:
    values, structure = elastic_axis(DRIVE, "Coulomb, load", late)
    found = acceleration_of_unit(structure, values, values.effects[0], RATE)
    assert found == pytest.approx(acceleration_of_unit(*at_rest_of(DRIVE)), rel=0.03)


def test_of_an_elastic_axis_it_is_that_of_the_load() -> None:
    """Within what is not known of the loop's stiffness; by the whole axis' inertia it would be 0.42."""
    rng = np.random.default_rng(2)
    values, structure = elastic_axis(DRIVE, "Coulomb, load", 0)
    drawn = acceleration_draws(structure, values, DRAWS * [values], 0, RATE, rng)
    assert drawn is not None
    of_load = 1 / (1 + DRIVE.structure_inertia)
    assert abs(np.log(drawn / of_load).mean()) < 0.15
    assert 0.05 < np.log(drawn).std() < 0.15


@pytest.mark.parametrize(
    ("bandwidth_hz", "least"),
    [
        (0.4, 0.2),
        pytest.param(1.0, 0.15, marks=pytest.mark.slow),
        pytest.param(3.0, 0.07, marks=pytest.mark.slow),
    ],
)
def test_a_loop_that_is_soft_beside_the_gear_widens_it(bandwidth_hz: float, least: float) -> None:
    """Motors of 0.4 to 2.5 loads: that of the load lies within what is said, over all of them."""
    rng, off, said = np.random.default_rng(4), [], []
    for inertia in np.geomspace(0.4, 2.5, 8):
        drive = replace(
            DRIVE,
            motor_inertia=float(inertia),
            loop_bandwidth_hz=bandwidth_hz * (1 + 1.3 / float(inertia)),
            loop_integral_hz=0.03 * bandwidth_hz,
        )
        values, structure = elastic_axis(drive, "Coulomb, load", 0)
        drawn = acceleration_draws(structure, values, DRAWS * [values], 0, RATE, rng)
        if drawn is not None:
            logarithms = np.log(drawn * (1 + DRIVE.structure_inertia))
            off.append(float(logarithms.mean() / logarithms.std()))
            said.append(float(logarithms.std()))
    assert len(off) >= 5
    assert min(said) > least
    assert abs(np.mean(off)) < 1.0
    assert np.sqrt(np.mean(np.square(off))) < 1.5
    assert max(np.abs(off)) < 2.5


def test_a_slow_pair_that_all_but_cancels_is_no_mode_of_the_gear() -> None:
    values, structure = elastic_axis(DRIVE, "Coulomb, load", 0)
    effect, c = values.effects[0], values.cascade
    pole = np.exp((-0.001 + 1j) * 2 * np.pi * 0.05 / RATE)
    idle = [[2 * pole.real], [abs(pole) ** 2], [1e-6], [0.0]]
    cascade = replace(c, sections=np.hstack([c.sections, idle]))
    assert effect.ports is not None
    ports = replace(effect.ports, sections=np.hstack([effect.ports.sections, np.zeros((2, 1))]))
    found = acceleration_of_unit(structure, JointValues(cascade, ()), replace(effect, ports=ports), RATE)
    assert found == pytest.approx(acceleration_of_unit(*at_rest_of(DRIVE)), rel=0.02)


def test_of_a_motor_behind_a_gear_nothing_is_said() -> None:
    values, structure = elastic_axis(DRIVE, "Coulomb, motor", 0)
    assert acceleration_of_unit(structure, values, values.effects[0], RATE) is None
    rng = np.random.default_rng(3)
    assert acceleration_draws(structure, values, [values], 0, RATE, rng) is None


def test_without_an_integrator_nothing_is_said() -> None:
    values = rigid_axis(1.7, 3.0)
    still = Structure(0, False, 0, 1, lower=False, upper=False, dead_zone=False)
    assert acceleration_of_unit(still, values, values.effects[0], RATE) is None
