"""The compiled chain: the Hammerstein-Wiener model without effects, the equations of motion with each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from drive_axis import LOAD_SPEED, MOTOR_SPEED, RATE, KnownTrain, command, drive_axis, hypothesis
from slow_reference import (
    Setting,
    Torques,
    coulomb,
    dahl,
    free_gap,
    overtone,
    ripple,
    slow_w,
    softening,
    stiffening,
    stribeck,
)

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import (
    CommandBias,
    CoulombFrictionAtLoad,
    CoulombFrictionAtMotor,
    CubicStiffness,
    DynamicBacklash,
    EarlyRateLimit,
    EncoderEccentricity,
    GainAsymmetry,
    GainDrift,
    KinematicBacklash,
    LinearSensorDrift,
    PreslidingFriction,
    RateLimit,
    ReadingAsymmetry,
    ReadingEccentricity,
    SaturationDrift,
    SaturationSlope,
    SofteningStiffness,
    StribeckFrictionAtMotor,
    ThermalSensorDrift,
    TorqueRipple,
    TransportDelay,
    UnmodelledMode,
)
from bayes_hw.gap.effects.drive import (
    LoadRippleWithOvertone,
    MeshRippleWithOvertone,
    TorqueRippleWithOvertone,
)
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.friction import BristleFriction, BristleFrictionAtLoad, StribeckFrictionAtLoad
from bayes_hw.gap.effects.linear import ModeOnStructure
from bayes_hw.gap.effects.sensor import OvalEncoder, OvalReading
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.gap.simulate.drive_train import DriveTrain
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SAMPLES = 240
AXIS = drive_axis()
U = command(SAMPLES, seed=3)
T = np.arange(SAMPLES) / RATE
ON_MOTOR = (6.0, 3.0, 0.3, 2.0, -1.0, 1.5)
ON_LOAD = (0.8, 0.4, 0.3, 0.3, -0.2, 0.1)
HUNG = (0.8, 1.3, 0.02)
LIMITS = AXIS.saturation.lower, AXIS.saturation.upper
TWICE = np.hypot(0.1, 0.05)
TURN = np.arctan2(0.05, 0.1)


def simulated(effect: Effect, values: Sequence[float], u: FloatArray = U) -> tuple[FloatArray, FloatArray]:
    """w and y of the axis with one effect."""
    found = hypothesis(AXIS, [u], effect)
    start = np.concatenate([found.builder.axis.nominal, values])
    return found.simulate_signals(start)[0]


def relative_error(effect: Effect, values: Sequence[float], setting: Setting, u: FloatArray = U) -> float:
    """Error of w over the size of the effect, both root mean square."""
    expected = slow_w(u, RATE, AXIS.linear.delay_samples, *LIMITS, setting)
    size = np.sqrt(np.mean((expected - AXIS.simulate(u).w) ** 2))
    assert size > 1e-3, "the effect must show"
    return float(np.sqrt(np.mean((simulated(effect, values, u)[0] - expected) ** 2)) / size)


def dead_zone(w: FloatArray) -> FloatArray:
    half = AXIS.dead_zone.half_width
    return np.where(w > half, w - half, np.where(w < -half, w + half, 0.0))


@pytest.mark.parametrize("known", [True, False])
def test_without_effects_it_is_the_hammerstein_wiener_model(
    known: bool, small_axis: HammersteinWiener
) -> None:
    """w and y to 1e-9, of an axis whose drive train is known and of one where it is not."""
    model = AXIS if known else small_axis
    found = hypothesis(model, [U])
    expected = model.simulate(U)
    w, y = found.simulate_signals(found.builder.axis.nominal)[0]
    np.testing.assert_allclose(w, expected.w, rtol=0, atol=1e-9)
    np.testing.assert_allclose(y, expected.y, rtol=0, atol=1e-9)


def test_base_parameters_move_it_as_they_move_the_model() -> None:
    """Limits, dead zone, gain, modes: the same model rebuilt from its parameter vector."""
    builder = ChainBuilder(AXIS)
    values = builder.axis.nominal * np.array([0.9, 1.1, 1.5, 0.95, 1.03, 0.8, 0.98, 1.2])
    found = hypothesis(AXIS, [U])
    expected = builder.axis.to_model(values).simulate(U)
    np.testing.assert_allclose(found.simulate(values)[0], expected.y, rtol=0, atol=1e-9)


@pytest.mark.parametrize("rate", [20.0, 100.0])
def test_short_steps_leave_the_linear_axis_as_it_is(rate: float) -> None:
    """A torque of no size switches the drive train's inner steps on and changes nothing."""
    axis = drive_axis(rate=rate)
    u = command(SAMPLES, 4, rate)
    found = hypothesis(axis, [u], CoulombFrictionAtMotor())
    y = found.simulate(np.concatenate([found.builder.axis.nominal, [1e-12, 0.01]]))[0]
    np.testing.assert_allclose(y, axis.simulate(u).y, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("effect", "values", "setting", "tolerance"),
    [
        (CoulombFrictionAtMotor(), (8.0, 0.02), Setting(coulomb(8.0, 0.02, MOTOR_SPEED)), 0.02),
        (CoulombFrictionAtLoad(), (1.0, 0.02), Setting(coulomb(1.0, 0.02, LOAD_SPEED)), 0.02),
        (StribeckFrictionAtMotor(), (8.0, 0.5, 0.05, 0.02), Setting(stribeck(8.0, 0.5, 0.05, 0.02)), 0.03),
        (PreslidingFriction(), (8.0, 1e3), Setting(dahl(8.0, 1e3)), 0.03),
        (TorqueRipple(), (6.0, 3.0, 0.3), Setting(ripple(np.hypot(6, 3), 0.3, np.arctan2(3, 6))), 0.03),
        (CubicStiffness(), (3e4,), Setting(stiffening(3e4)), 0.01),
        (CubicStiffness(), (-100.0,), Setting(stiffening(-100.0)), 0.02),
        (SofteningStiffness(), (1e3,), Setting(softening(1e3)), 0.02),
        (DynamicBacklash(), (0.003,), Setting(free_gap(0.003)), 0.07),
        (
            StribeckFrictionAtLoad(),
            (1.0, 0.5, 0.05, 0.02),
            Setting(stribeck(1.0, 0.5, 0.05, 0.02, LOAD_SPEED)),
            0.03,
        ),
        (BristleFriction(), (8.0, 1e3, 0.5, 0.05), Setting(dahl(8.0, 1e3, 0.5, 0.05)), 0.03),
        (
            BristleFrictionAtLoad(),
            (1.0, 300.0, 0.5, 0.05),
            Setting(dahl(1.0, 300.0, 0.5, 0.05, LOAD_SPEED)),
            0.03,
        ),
        (TorqueRippleWithOvertone(), ON_MOTOR, Setting(overtone(ON_MOTOR, "motor")), 0.03),
        (LoadRippleWithOvertone(), ON_LOAD, Setting(overtone(ON_LOAD, "load")), 0.03),
        (MeshRippleWithOvertone(), ON_LOAD, Setting(overtone(ON_LOAD, "mesh")), 0.03),
    ],
    ids=lambda value: value.name if isinstance(value, Effect) else "",
)
def test_torques_follow_the_equations_of_motion(
    effect: Effect, values: tuple[float, ...], setting: Setting, tolerance: float
) -> None:
    """Steps of 10 ms against 0.2 ms, as a share of what the effect changes."""
    assert relative_error(effect, values, setting) < tolerance


@pytest.mark.parametrize("inertia", [0.05, 0.3, 2.0])
def test_a_resonator_is_a_mode_hung_on_the_load(inertia: float) -> None:
    """Poles and residues found by polynomials, against nine states."""
    values = (inertia, 1.3, 0.02)
    setting = Setting(resonator=values, fine=False)
    assert relative_error(UnmodelledMode(), values, setting) < 1e-6


@pytest.mark.parametrize("inertia", [0.05, 0.8])
def test_a_resonator_may_hang_on_the_structure(inertia: float) -> None:
    """The same on the structure, whose angle G does not show."""
    values = (inertia, 2.3, 0.02)
    setting = Setting(resonator=values, on_structure=True, fine=False)
    assert relative_error(ModeOnStructure(), values, setting) < 1e-6


@cache
def hung_alone(on_structure: bool) -> FloatArray:
    """w of the axis with a resonator and no torque."""
    setting = Setting(resonator=HUNG, on_structure=on_structure, fine=False)
    return slow_w(U, RATE, AXIS.linear.delay_samples, *LIMITS, setting)


@pytest.mark.parametrize(
    "mode",
    [UnmodelledMode(), pytest.param(ModeOnStructure(), marks=pytest.mark.slow)],
    ids=lambda mode: mode.name,
)
@pytest.mark.parametrize(
    ("effect", "values", "torques", "tolerance"),
    [
        (CoulombFrictionAtLoad(), (1.0, 0.02), coulomb(1.0, 0.02, LOAD_SPEED), 0.03),
        (CoulombFrictionAtMotor(), (8.0, 0.02), coulomb(8.0, 0.02, MOTOR_SPEED), 0.03),
        (CubicStiffness(), (3e4,), stiffening(3e4), 0.03),
        (LoadRippleWithOvertone(), ON_LOAD, overtone(ON_LOAD, "load"), 0.04),
    ],
    ids=lambda value: value.name if isinstance(value, Effect) else "",
)
def test_torques_act_on_a_drive_train_with_a_resonator(
    mode: UnmodelledMode, effect: Effect, values: tuple[float, ...], torques: Torques, tolerance: float
) -> None:
    """One more mass changes what a torque does, as a share of what the torque changes."""
    setting = Setting(torques, resonator=HUNG, on_structure=isinstance(mode, ModeOnStructure))
    expected = slow_w(U, RATE, AXIS.linear.delay_samples, *LIMITS, setting)
    without = hung_alone(setting.on_structure)
    found = hypothesis(AXIS, [U], mode, effect)
    w, _ = found.simulate_signals(np.concatenate([found.builder.axis.nominal, HUNG, values]))[0]
    assert np.sqrt(np.mean((w - expected) ** 2) / np.mean((expected - without) ** 2)) < tolerance


@pytest.mark.parametrize("on_structure", [False, True])
def test_a_heavy_resonator_on_a_g_with_modes_a_little_off_is_stable(on_structure: bool) -> None:
    """Nothing in it gives energy, so no pole may leave the left half plane."""
    builder = ChainBuilder(AXIS)
    for frequency in np.geomspace(0.5, 6, 8):
        for factor in (0.97, 1.03):
            values = builder.axis.nominal * np.array([1, 1, 1, 1, factor, 0.7, 1 / factor, 0.7])
            chain = builder.chain(values, Resonator(2.0, float(frequency), 0.01, on_structure))
            poles, real_count = chain.command_path.poles, chain.command_path.real_count
            assert poles[:real_count].real.max() <= 0 and poles[real_count:].real.max() < 0


def test_an_oval_disc_has_a_second_harmonic() -> None:
    """A sin(x) + B cos(x) + C sin(2 x) + D cos(2 x), less its value where the record starts."""
    values = (0.01, 0.005, 0.8, 0.004, -0.002)
    w = AXIS.simulate(U).w
    x = 2 * np.pi * w / 0.8
    error = 0.01 * np.sin(x) + 0.005 * (np.cos(x) - 1) + 0.004 * np.sin(2 * x) - 0.002 * (np.cos(2 * x) - 1)
    np.testing.assert_allclose(simulated(OvalEncoder(), values)[0], w + error, rtol=0, atol=1e-9)
    np.testing.assert_allclose(simulated(OvalReading(), values)[1], dead_zone(w) + error, rtol=0, atol=1e-9)


def test_no_resonator_without_inertia() -> None:
    builder = ChainBuilder(AXIS)
    plain, with_none = (
        builder.chain(builder.axis.nominal, resonator) for resonator in (None, Resonator(0.0, 1.3, 0.02))
    )
    np.testing.assert_array_equal(plain.command_path.poles, with_none.command_path.poles)


BEFORE_THE_LIMITER: Any = [
    (RateLimit(), (0.3,), Setting(command_rate=0.3), 1e-3),
    (EarlyRateLimit(), (0.3,), Setting(command_rate=0.3), 1e-3),
    (EarlyRateLimit(), (4.0,), Setting(command_rate=4.0), 2e-3),
    (TransportDelay(), (2.0,), Setting(extra_delay=2.0), 1e-9),
    (SaturationDrift(), (0.1, 0.05, 1.5), None, 1e-3),
    (SaturationSlope(), (0.1,), Setting(limits_at=lambda w: 1 + 0.1 * w), 1e-3),
    (CommandBias(), (0.01,), Setting(bias=0.01, fine=False), 1e-9),
    (GainDrift(), (0.05, 7.0), Setting(gain_at=lambda t: 1.05 - 0.05 * np.exp(-t / 7), fine=False), 1e-9),
]


@pytest.mark.parametrize(("effect", "values", "setting", "tolerance"), BEFORE_THE_LIMITER)
def test_command_side(
    effect: Effect, values: tuple[float, ...], setting: Setting | None, tolerance: float
) -> None:
    """Rate limit, whole delay, limits by position, bias, warming drive."""

    def swing(w: float) -> float:
        return 1 + float(TWICE * np.sin(2 * np.pi * w / 1.5 + TURN))

    setting = setting or Setting(limits_at=swing)
    assert relative_error(effect, values, setting) < tolerance


@pytest.mark.parametrize("share", [0.3, 1.3])
@pytest.mark.parametrize("saturates", [False, True])
def test_a_fractional_delay(share: float, saturates: bool) -> None:
    """A held command that arrives between samples; limited or not."""
    u = U if saturates else 0.3 * U
    assert relative_error(TransportDelay(), (share,), Setting(extra_delay=share), u) < 5e-3


def test_play_remembers() -> None:
    """The play operator sample by sample, and its dead zone behind it."""
    half, w, expected = 0.01, AXIS.simulate(U).w, np.zeros(SAMPLES)
    held = 0.0
    for k in range(SAMPLES):
        held = min(max(held, w[k] - half), w[k] + half)
        expected[k] = held
    found, y = simulated(KinematicBacklash(), (half,))
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_allclose(y, dead_zone(expected), atol=1e-12)


def test_eccentricity_starts_at_zero() -> None:
    w = AXIS.simulate(U).w
    size, phase = np.hypot(0.01, 0.004), np.arctan2(0.004, 0.01)
    expected = w + size * (np.sin(2 * np.pi * w / 0.4 + phase) - np.sin(phase))
    found, _ = simulated(EncoderEccentricity(), (0.01, 0.004, 0.4))
    assert found[0] == 0
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_unequal_gains_and_drifts_of_the_encoder() -> None:
    """The ratio holds in front of the dead zone; drifts are added behind it."""
    simulation = AXIS.simulate(U)
    w, y = simulation.w, simulation.y
    assert w.min() < 0 < w.max()
    ratio = simulated(GainAsymmetry(), (1.2,))[1]
    np.testing.assert_allclose(ratio, dead_zone(np.where(w > 0, 1.2 * w, w)), atol=1e-12)
    np.testing.assert_allclose(simulated(LinearSensorDrift(), (0.002,))[1], y + 0.002 * T, atol=1e-12)
    warm = y + 0.03 * (1 - np.exp(-T / 4))
    np.testing.assert_allclose(simulated(ThermalSensorDrift(), (0.03, 4.0))[1], warm, atol=1e-12)


def test_an_axis_that_sticks_stays_where_it_is() -> None:
    """Friction above the loop's torque holds the motor; steps of 10 ms let it creep by a few per cent."""
    u = np.full(SAMPLES, 1e-4)
    stuck, _ = simulated(CoulombFrictionAtMotor(), (1e3, 1e-6), u)
    free = AXIS.simulate(u).w
    assert np.abs(stuck).max() < 0.03 * np.abs(free).max()


def test_two_effects_at_once() -> None:
    """Delay in front and play behind: each in its place."""
    found = hypothesis(AXIS, [U], TransportDelay(), KinematicBacklash())
    w = found.simulate_signals(np.concatenate([found.builder.axis.nominal, [2.0, 0.01]]))[0][0]
    late = AXIS.simulate(np.concatenate([np.zeros(2), U[:-2]])).w
    held, expected = 0.0, np.zeros(SAMPLES)
    for k in range(SAMPLES):
        held = min(max(held, late[k] - 0.01), late[k] + 0.01)
        expected[k] = held
    np.testing.assert_allclose(w, expected, atol=1e-9)


def test_errors_behind_the_dead_zone() -> None:
    """A reading's eccentricity and unequal gains act on the dead zone's output, by the angle before it."""
    w, plain = simulated(GainAsymmetry(), (1.0,))
    ratio = simulated(ReadingAsymmetry(), (1.2,))[1]
    np.testing.assert_allclose(ratio, np.where(plain > 0, 1.2 * plain, plain), rtol=1e-12)
    sine, cosine, period = 0.01, 0.004, 0.4
    shown = simulated(ReadingEccentricity(), (sine, cosine, period))[1]
    x = 2 * np.pi * w / period
    np.testing.assert_allclose(shown, plain + sine * np.sin(x) + cosine * (np.cos(x) - 1), atol=1e-9)


@pytest.mark.parametrize("off", [0.95, 1.05])
def test_motor_and_load_turn_together_though_the_gear_damping_is_a_little_off(off: float) -> None:
    """The zero of the gear's damping lies on the pole of the velocity loop, where the motor's ratio to w has
    a pole of its own: with the damping read back 5 % off, friction at the motor is still nearly that of the
    drive train itself."""
    exact = KnownTrain(kp=330.0, ki=3300.0, c=0.00315)
    axis = drive_axis(exact)
    found = hypothesis(axis, [U], CoulombFrictionAtMotor())
    start = np.concatenate([found.builder.axis.nominal, (8.0, 0.02)])
    logs = {factor: exact.logs + np.log(factor) * (np.arange(len(exact.logs)) == 6) for factor in (1.0, off)}
    w: dict[float, FloatArray] = {}
    for factor, log in logs.items():
        builder = ChainBuilder(axis)
        builder._train = lambda _, log=log: DriveTrain(log, 1.0, 0.0)  # type: ignore[assignment, misc]
        w[factor] = replace(found, builder=builder).simulate_signals(start)[0][0]
    rubbed = np.sqrt(np.mean((w[1.0] - axis.simulate(U).w) ** 2))
    assert np.sqrt(np.mean((w[off] - w[1.0]) ** 2)) < 0.1 * rubbed
