"""The drive train behind G: read back from poles and zeros, its torque paths those of the state space."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import (
    LOAD_SPEED,
    LOAD_TORQUE,
    MOTOR_ANGLE,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    RATE,
    TRAIN,
    KnownTrain,
    V,
    W,
    drive_axis,
    frequency_response,
)

from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.chain_batch import simulate_chains
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.gap.simulate.continuous_poles import ContinuousPoles, continuous_poles
from bayes_hw.gap.simulate.drive_train import DriveTrain, UnknownTrain, realise
from bayes_hw.gap.simulate.path import Path
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock

S_AXIS = 2j * np.pi * np.geomspace(0.05, 9.0, 40)
OUTPUTS = (W, MOTOR_ANGLE, MOTOR_SPEED, LOAD_SPEED)
TRAINS = (TRAIN, KnownTrain(kp=150, ki=1500, km=350, kl=210, ks=130, kss=540, c=0.005, cs=0.001, gain=1.1))


def continuous(model: HammersteinWiener) -> ContinuousPoles:
    """G of `model` in continuous time."""
    builder = ChainBuilder(model)
    batch = builder.axis.linear_batch(builder.axis.nominal[:, None])
    real, pairs, _ = batch.residues()
    system = continuous_poles(
        batch.real_poles[:, 0], batch.pair_poles[:, 0], real[:, 0], pairs[:, 0], model.sample_rate_hz
    )
    assert system is not None
    return system


def path(system: Path, kind: int, door: int, s: np.ndarray) -> np.ndarray:
    """Response of an output to what enters at a door, the lower poles of the pairs included."""
    total = np.zeros_like(s)
    for pole, into, out in zip(system.poles, system.inputs[door], system.outputs[kind], strict=True):
        total = total + into * out / (s - pole)
        if pole.imag > 0:
            total = total + np.conj(into * out) / (s - np.conj(pole))
    return total


@pytest.mark.parametrize("train", TRAINS)
def test_g_in_continuous_time_is_that_of_the_state_space(train: KnownTrain) -> None:
    """Undoing the hold of poles and zeros gives w per v of the equations of motion."""
    a, b, c = train.state_space()
    expected = frequency_response(a, b, c, S_AXIS)[:, W, V]
    np.testing.assert_allclose(continuous(drive_axis(train)).response(S_AXIS), expected, rtol=1e-6)


@pytest.mark.parametrize("train", TRAINS)
@pytest.mark.parametrize("rate", [20.0, 50.0])
def test_known_stiffnesses_are_read_back(train: KnownTrain, rate: float) -> None:
    """All ten numbers to 1e-4, from G sampled at two rates, and its response to the misfit said."""
    system = continuous(drive_axis(train, rate))
    found = realise(system, rate)
    assert found is not None
    np.testing.assert_allclose(found.logs, train.logs, atol=1e-4)
    np.testing.assert_allclose(found.response(S_AXIS), system.response(S_AXIS), rtol=1e-5)
    assert found.stiffness == pytest.approx((train.km, train.kl), rel=1e-4)
    assert found.contact_damping == pytest.approx(train.c, rel=1e-4)


def test_a_nominal_g_is_matched_by_its_own_antiresonance() -> None:
    """Modes of a 3 % wrong frequency and half the damping, beside zeros that are right: the match that begins
    at usual proportions alone ends at another antiresonance, a quarter off."""
    poles = np.array([-186.62, -16.0565, 0, -0.72238 + 10.77408j, -0.59315 + 28.66976j])
    residues = np.array(
        [-0.00052278, 0.03456738, 0.54701194, -0.25930356 + 0.00105416j, -0.03136531 - 0.00134163j]
    )
    found = realise(ContinuousPoles(poles, residues, np.array([1.0, 1.0, 1.0, 0.0, 0.0])), RATE)
    assert found is not None and found.misfit < 0.05


def test_a_reversed_axis_keeps_its_stiffnesses() -> None:
    """A negative gain of G is the sign of the drive train."""
    system = continuous(drive_axis())
    turned = ContinuousPoles(system.poles, -system.residues, system.real)
    found = realise(turned, RATE)
    assert found is not None and found.sign == -1
    np.testing.assert_allclose(found.logs, TRAIN.logs, atol=1e-4)


@pytest.mark.parametrize("torque", [MOTOR_TORQUE, LOAD_TORQUE])
@pytest.mark.parametrize("kind", OUTPUTS)
def test_torque_paths_are_those_of_the_state_space(kind: int, torque: int) -> None:
    """Torque at motor or load to each of the four outputs."""
    a, b, c = TRAIN.state_space()
    system = DriveTrain(TRAIN.logs, 1.0, 0.0).torque_path(continuous(drive_axis()))
    expected = frequency_response(a, b, c, S_AXIS)[:, kind, torque]
    found = path(system, kind, torque - MOTOR_TORQUE, S_AXIS)
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("on_structure", [False, True])
@pytest.mark.parametrize("torque", [MOTOR_TORQUE, LOAD_TORQUE])
@pytest.mark.parametrize("kind", OUTPUTS)
def test_torques_meet_a_resonator_too(kind: int, torque: int, on_structure: bool) -> None:
    """Torque at motor or load to each output with one more mass, on the load or on the structure."""
    hung = Resonator(0.7, 1.4, 0.03, on_structure)
    a, b, c = TRAIN.state_space((0.7, 1.4, 0.03), on_structure)
    system = DriveTrain(TRAIN.logs, 1.0, 0.0).torque_path(continuous(drive_axis()), hung)
    expected = frequency_response(a, b, c, S_AXIS)[:, kind, torque]
    np.testing.assert_allclose(
        path(system, kind, torque - MOTOR_TORQUE, S_AXIS), expected, rtol=1e-7, atol=1e-12
    )


@pytest.mark.parametrize("on_structure", [False, True])
def test_inner_motion_with_a_resonator(on_structure: bool) -> None:
    """Motor angle and speeds per v with one more mass: the residues of the closed loop times the ratios."""
    hung = Resonator(0.7, 1.4, 0.03, on_structure)
    a, b, c = TRAIN.state_space((0.7, 1.4, 0.03), on_structure)
    builder = ChainBuilder(drive_axis())
    found = builder.chain(builder.axis.nominal, hung).command_path
    expected = frequency_response(a, b, c, S_AXIS)[:, :, V]
    for kind in OUTPUTS:
        np.testing.assert_allclose(path(found, kind, 0, S_AXIS), expected[:, kind], rtol=1e-4)


def test_inner_motion_answers_to_the_command_as_in_the_state_space() -> None:
    """Motor angle, motor speed and load speed per v: the residues of G times the ratios at its poles."""
    a, b, c = TRAIN.state_space()
    system = continuous(drive_axis())
    train = DriveTrain(TRAIN.logs, 1.0, 0.0)
    found = train.command_path(system, None, train.torque_path(system))
    expected = frequency_response(a, b, c, S_AXIS)[:, :, V]
    for kind in (MOTOR_ANGLE, MOTOR_SPEED, LOAD_SPEED):
        np.testing.assert_allclose(path(found, kind, 0, S_AXIS), expected[:, kind], rtol=1e-5)


def test_another_g_has_no_drive_train(small_axis: HammersteinWiener) -> None:
    """One mode only, and a G whose second mode is of the wrong sign."""
    assert realise(continuous(small_axis), small_axis.sample_rate_hz) is None
    system = continuous(drive_axis())
    residues = system.residues.copy()
    residues[-1] *= -30
    assert realise(ContinuousPoles(system.poles, residues, system.real), RATE) is None


def test_an_unknown_train_is_g_behind_a_velocity_loop(small_axis: HammersteinWiener) -> None:
    """Torque to w is s / (bandwidth (s + corner)) G; motor and load move as one."""
    builder = ChainBuilder(small_axis)
    train = builder.train(builder.axis.nominal)
    assert isinstance(train, UnknownTrain)
    g = continuous(small_axis)
    paths = train.torque_path(g)
    expected = S_AXIS / (train.bandwidth * (S_AXIS + train.corner)) * g.response(S_AXIS)
    for torque in (0, 1):
        np.testing.assert_allclose(path(paths, W, torque, S_AXIS), expected, rtol=1e-9)
        np.testing.assert_allclose(path(paths, MOTOR_ANGLE, torque, S_AXIS), expected, rtol=1e-9)


def test_an_unknown_train_moves_at_the_speed_of_w(small_axis: HammersteinWiener) -> None:
    """Held torques: the difference of w over a short step is the speed."""
    g = continuous(small_axis)
    paths = UnknownTrain().torque_path(g)
    slow = 2j * np.pi * np.geomspace(0.05, 3.0, 20)
    moved = path(paths, W, 0, slow) * slow
    gain_at_once = np.real(
        np.sum((paths.inputs[0] * paths.outputs[W]) * np.where(paths.poles.imag > 0, 2, 1))
    )
    np.testing.assert_allclose(path(paths, LOAD_SPEED, 0, slow), moved - gain_at_once, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("pole", [-0.3, -0.99, 0.0])
def test_a_pole_that_no_continuous_system_has(pole: float) -> None:
    """The chain answers at the samples as the model does."""
    axis = drive_axis()
    linear = LinearBlock(axis.linear.zeros, np.append(axis.linear.poles, pole), axis.linear.gain, 1)
    model = HammersteinWiener(
        "alternating", RATE, axis.saturation, linear, axis.dead_zone, axis.dominant_modes
    )
    builder = ChainBuilder(model)
    settings = S.NEUTRAL.copy()
    settings[[S.LOWER, S.UPPER, S.DEAD_ZONE]] = builder.axis.nominal[:3]
    u = 0.2 * np.random.default_rng(0).normal(size=400)
    (signals,) = simulate_chains([builder.chain(builder.axis.nominal)], settings[None], [u])
    np.testing.assert_allclose(signals.y[:, 0], model.simulate(u).y, atol=1e-7)
