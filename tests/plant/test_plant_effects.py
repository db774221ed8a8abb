"""Every fault does what its name says, vanishes with its strength, and sits on the grid of the format."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from plant_axes import an_axis

from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.plant.drive_train import MOTOR_SPEED, STATES
from bayes_hw.plant.effects import CATALOGUE, OFF_CATALOGUES, Effect, Scales
from bayes_hw.plant.effects.command import RateLimit
from bayes_hw.plant.effects.disturbance import Wind, davenport_spectrum, kaimal_spectrum
from bayes_hw.plant.effects.drive import Backlash, DryFriction, TorqueRipple
from bayes_hw.plant.effects.linear import TransportDelay
from bayes_hw.plant.effects.second_group import BrownOut, CommandDeadBand, ToothSkip
from bayes_hw.plant.effects.sensor import Outliers, Quantization, TimingJitter
from bayes_hw.plant.effects.unseen import CableWrap, CommandPlay, ReadingLead
from bayes_hw.plant.excitation import steps_and_triangles
from bayes_hw.plant.integrator import EXTERNAL_LOAD, EXTERNAL_LOST, Friction, rub
from bayes_hw.plant.run import Axis, Run

SCALES = Scales(0.3, 0.5, 1.0, 0.005, 0.004, 60.0, 20.0, (1.9, 4.0), 0.4)
SHORT_S = 30.0
UNNAMED = [fault for group in OFF_CATALOGUES.values() for fault in group]
EVERY = [*CATALOGUE, *UNNAMED]


def run_of(axis: Axis, command: np.ndarray, *acting: tuple[Effect, float]) -> Run:
    run = Run(axis, command, (3, 1))
    for effect, strength in acting:
        effect.act(run, strength)
    return run


def command_of(seconds: float = 60.0) -> np.ndarray:
    return 0.42 * steps_and_triangles(np.random.default_rng(1), 20.0, round(20 * seconds))


def reading(effect: type[Effect], seed: int, strength: float) -> np.ndarray:
    shape = effect.draw(np.random.default_rng(seed), SCALES)
    run = run_of(an_axis(2), command_of(SHORT_S), (shape, strength))
    return run.read(run.angles()).measured()


@cache
def without_faults() -> np.ndarray:
    run = run_of(an_axis(2), command_of(SHORT_S))
    return run.read(run.angles()).measured()


def test_catalogue_has_every_label_of_the_format() -> None:
    assert {effect.label for effect in CATALOGUE} == set(LABEL_BLOCKS)
    assert {effect.label for effect in UNNAMED} == {"other"}
    assert len(set(UNNAMED)) == len(UNNAMED)
    assert len(OFF_CATALOGUES["known"]) >= 9


@pytest.mark.parametrize("effect", EVERY, ids=lambda effect: effect.__name__)
def test_every_fault_vanishes_with_its_strength_and_repeats(effect: type[Effect]) -> None:
    """Nothing at strength 1e-9; something, finite, and the same twice, at a strength within reach."""
    plain = without_faults()
    for seed in (1, 2):
        assert np.abs(reading(effect, seed, 1e-9) - plain).max() < 1e-6
        strong = [reading(effect, seed, strength) for strength in (3.0, 30.0)]
        assert all(np.isfinite(y).all() for y in strong)
        assert max(np.abs(y - plain).max() for y in strong) > 1e-4
        np.testing.assert_array_equal(strong[0], reading(effect, seed, 3.0))


def test_coulomb_friction_holds_the_load_until_the_torque_exceeds_it() -> None:
    """A torque on the load below its friction does not move it; a larger one does."""
    axis = an_axis(2)
    moved = []
    for torque in (0.0, 0.9, 1.5):
        run = Run(axis, np.zeros(200), (1,))
        run.change(load_friction=Friction(1.0, 1.0))
        run.external[:, EXTERNAL_LOAD] = torque
        moved.append(float(np.abs(run.angles()).max()))
    assert moved[0] == 0.0
    assert moved[1] < 1e-12
    assert moved[2] > 1e-4


def test_kinematic_play_is_the_play_operator() -> None:
    """The output's difference from the axis stays within the half gap and reaches it on both sides."""
    axis, command = an_axis(2), command_of()
    free = run_of(axis, command).angles()
    play = run_of(axis, command, (Backlash("kinematic", 0.01), 1.0)).angles()
    assert np.abs(play - free).max() == pytest.approx(0.01, abs=1e-12)
    moving = np.diff(play) != 0
    sign = np.sign(np.diff(free))[moving]
    np.testing.assert_allclose((free - play)[1:][moving], 0.01 * sign, atol=1e-12)


def test_delay_of_whole_samples_shifts_the_record() -> None:
    axis, command = an_axis(2), command_of()
    run, late = run_of(axis, command), run_of(axis, command, (TransportDelay("delay", 20.0), 2.0))
    np.testing.assert_allclose(
        late.read(late.angles()).angle[2:], run.read(run.angles()).angle[:-2], atol=1e-12
    )


def test_rate_limit_bounds_the_slope_of_a_step() -> None:
    """A step to 0.3 at 0.5 deg/s^2 loses 0.3^2 / (2 0.5) deg less half an integration step, times gain."""
    axis = an_axis(2)
    command = np.full(2400, 0.3)
    full, ramped = (
        run_of(axis, command, *acting).angles()[-1]
        for acting in ([], [(RateLimit("ramp_after_limiter", 0.5), 1.0)])
    )
    lost = 0.09 - 0.3 * axis.step_s / 2
    assert full - ramped == pytest.approx(axis.drive.velocity_gain * lost, rel=1e-6)


def test_a_command_that_is_always_as_late_is_delayed() -> None:
    axis, command = an_axis(2), command_of()
    run, delayed = Run(axis, command, (1,)), Run(axis, command, (1,))
    run.late_s = np.full(run.samples, 0.15)
    delayed.extra_delay_s = 0.15
    np.testing.assert_array_equal(run.angles(), delayed.angles())


def test_commands_that_come_late_keep_their_order() -> None:
    """Lateness that grows faster than time holds the command; it never goes back."""
    run = Run(an_axis(2), np.arange(200.0), (1,))
    run.late_s = np.where(run.time > 4.0, 2.0, 0.0)
    rising = run._late(np.arange(run.steps, dtype=np.float64))
    assert (np.diff(rising) >= 0).all()
    assert rising[-1] == run.steps - 1 - round(2.0 / run.axis.step_s)


def test_a_tooth_skip_moves_the_resting_load_by_the_jump() -> None:
    """The velocity loop holds the motor, so that the load ends the jump away from it."""
    axis = an_axis(2)
    angles = run_of(axis, np.zeros(2400), (ToothSkip("tooth_skip", 0.02), 1.0)).angles()
    assert np.abs(angles[: axis.substeps * 400]).max() == 0.0
    assert abs(angles[-1]) == pytest.approx(0.02, rel=0.01)


def test_a_drive_without_torque_stops_following() -> None:
    """Where its supply sags by nearly all, the axis strays from what it would do, and only from then on."""
    axis, command = an_axis(2), command_of()
    run = run_of(axis, command, (BrownOut("brown_out", 0.4), 19.0))
    strayed = np.abs(run.angles() - run_of(axis, command).angles())
    first = int(np.argmax(run.external[:, EXTERNAL_LOST] > 0))
    assert first > 0
    assert strayed[: first + 1].max() == 0.0
    assert strayed[first:].max() > 0.01


def test_drag_slows_the_load_in_proportion_to_its_square() -> None:
    """At constant speed gear and loop carry the drag: the load lags by it over either's stiffness."""
    axis = an_axis(2)
    command = np.full(2400, 0.3)
    free, slowed = Run(axis, command, (1,)), Run(axis, command, (1,))
    slowed.change(drag=0.5)
    lag = free.angles()[-1] - slowed.angles()[-1]
    speed = 0.3 * axis.drive.velocity_gain
    compliance = 1 / axis.drive.stiffness + 1 / axis.drive.loop_integral_gain
    assert lag == pytest.approx(0.5 * speed**2 * compliance, rel=1e-3)


def test_a_dead_band_swallows_small_commands_only() -> None:
    run = run_of(an_axis(2), np.array([0.0, 0.01, -0.02, 0.03, -0.3]), (CommandDeadBand("", 0.025), 1.0))
    np.testing.assert_array_equal(run.command, [0.0, 0.0, 0.0, 0.03, -0.3])


def test_a_cable_wrap_pulls_back_beyond_its_angle_only() -> None:
    """Below it nothing changes; at rest beyond it gear and loop carry the spring's torque."""
    axis = an_axis(2)
    command = np.where(np.arange(2400) < 400, 0.3, 0.0)
    free, wrapped = Run(axis, command, (1,)), run_of(axis, command, (CableWrap("", 1.0, 0.5), 1.0))
    angles, pulled = free.angles(), wrapped.angles()
    reached = int(np.argmax(angles > 1.0))
    assert np.abs(pulled - angles)[:reached].max() == 0.0
    compliance = 1 / axis.drive.stiffness + 1 / axis.drive.loop_integral_gain
    torque = 0.5 * (pulled[-1] - 1.0)
    assert torque > 0.1
    assert angles[-1] - pulled[-1] == pytest.approx(torque * compliance, rel=1e-3)


def test_play_of_the_command_is_the_play_operator() -> None:
    run = run_of(an_axis(2), np.array([0.0, 0.3, 0.25, 0.15, 0.5]), (CommandPlay("", 0.1), 1.0))
    np.testing.assert_allclose(run.command, [0.0, 0.2, 0.2, 0.2, 0.4], atol=1e-15)


def test_the_reading_leads_by_the_square_of_the_speed() -> None:
    axis, command = an_axis(2), np.full(2400, -0.3)
    run, led = Run(axis, command, (1,)), run_of(axis, command, (ReadingLead("", 0.1), 1.0))
    plain, read = (each.read(each.angles()).angle for each in (run, led))
    speed = 0.3 * axis.drive.velocity_gain
    np.testing.assert_allclose(read[-100:] - plain[-100:], -0.1 * speed**2, rtol=1e-6)


def test_readings_on_the_grid_and_held() -> None:
    axis, command = an_axis(2), command_of()
    quantized = run_of(axis, command, (Quantization("rounding", 0.02), 1.0))
    y = quantized.read(quantized.angles()).measured(0.003)
    np.testing.assert_allclose(y / 0.02, np.round(y / 0.02), atol=1e-9)
    held = run_of(axis, command, (TimingJitter("held_samples", 20.0), 6.0))
    free = run_of(axis, command)
    a, b = (run.read(run.angles()).angle for run in (held, free))
    repeated = (np.diff(a) == 0) & (np.diff(b) != 0)
    assert 0.2 < repeated.mean() < 0.4


def test_a_repeated_reading_shows_the_angle_of_the_one_it_repeats() -> None:
    """With its noise in the record, without it in what is free of noise."""
    axis, command = an_axis(2), command_of()
    run = run_of(axis, command, (TimingJitter("held_readings", 20.0), 6.0))
    reading = run.read(run.angles())
    noise = np.random.default_rng(3).normal(size=len(command))
    stale = np.flatnonzero(run.repeated[1:]) + 1
    assert len(stale) > 0.1 * len(command)
    for shown in (reading.noise_free, reading.measured(noise)):
        np.testing.assert_array_equal(shown[stale], shown[stale - 1])
    assert np.any(reading.angle[stale] != reading.angle[stale - 1])


def test_outliers_are_isolated_and_of_the_stated_rate() -> None:
    effect = Outliers("random", 0.01, 0.1)
    run = run_of(an_axis(2), np.zeros(40_000), (effect, 2.0))
    hit = run.outliers != 0
    assert hit.mean() == pytest.approx(0.01, rel=0.2)
    assert np.std(run.outliers[hit]) == pytest.approx(0.2, rel=0.15)


@pytest.mark.parametrize("form", ["davenport", "kaimal"])
def test_wind_has_unit_variance_and_the_slope_of_its_spectrum(form: str) -> None:
    """Variance over many records, and power falling between two bands as the spectrum says."""
    effect = Wind(form, 1.0, 10.0, 26.0, False)
    axis = an_axis(2)
    series = []
    for record in range(30):
        run = Run(axis, np.zeros(2400), (9, record))
        effect.act(run, 1.0)
        series.append(run.external[2400 :: axis.substeps, EXTERNAL_LOAD])
    assert np.mean([np.mean(s**2) for s in series]) == pytest.approx(1.0, abs=0.35)
    power = np.mean([np.abs(np.fft.rfft(s * np.hanning(len(s)))) ** 2 for s in series], axis=0)
    frequency = np.fft.rfftfreq(len(series[0]), 1 / 20.0)
    low, high = (frequency > 0.05) & (frequency < 0.1), (frequency > 0.5) & (frequency < 1.0)
    found = power[low].mean() / power[high].mean()
    assert found > 30.0


def test_spectra_fall_as_the_five_thirds_power() -> None:
    """Both spectra times f^(5/3) are constant at high frequency (Kolmogorov)."""
    f = np.array([5.0, 10.0])
    for power in (davenport_spectrum(f, 10.0), kaimal_spectrum(f, 10.0, 26.0)):
        assert power[0] / power[1] == pytest.approx(2 ** (5 / 3), rel=0.01)


def test_friction_names_its_parameters() -> None:
    parameters = DryFriction("stribeck_motor", 0.1, 1.5, 0.01, 10.0).parameters(2.0)
    assert parameters == {"kind": "stribeck_motor", "coulomb_deg_s2": 0.2, "static_ratio": 1.5}


def test_the_rail_leaves_the_axis_one_place_to_rest() -> None:
    """The steepest rail is as steep as the gear is stiff; torque alone bounds motor and mesh."""
    for seed in range(40):
        ripple = TorqueRipple.draw(np.random.default_rng(seed), SCALES)
        x = np.linspace(0, ripple.period_deg, 4001)
        phase = 2 * np.pi * x / ripple.period_deg
        shape = np.sin(phase + ripple.phase) + ripple.second * np.sin(2 * phase + ripple.phase)
        steepest = ripple.largest * ripple.torque * np.abs(np.gradient(shape, x)).max()
        if ripple.detail == "rail_load":
            assert steepest <= 1.001 * SCALES.torque / SCALES.twist
        else:
            assert ripple.largest * ripple.torque == pytest.approx(8 * SCALES.torque)


def test_bristles_hold_like_a_spring_and_slide_at_the_coulomb_level() -> None:
    """LuGre's friction of one body of unit inertia: a torque below the level bends it to where its spring
    holds, and a body that slides is slowed by the level."""
    stiffness = (2 * np.pi * 12) ** 2
    friction = Friction(20.0, 20.0, 1.0, stiffness, 0.1 * np.sqrt(stiffness))
    step, response = 1e-3, np.zeros(STATES)
    response[MOTOR_SPEED] = step
    x, bristle = np.zeros(STATES), 0.0
    for _ in range(4000):
        x[MOTOR_SPEED] += step * 8.0
        bristle = rub(x, MOTOR_SPEED, response, friction, 0.0, bristle, step)
    assert stiffness * bristle == pytest.approx(8.0, rel=0.02) and abs(x[MOTOR_SPEED]) < 1e-3
    sliding = np.zeros(STATES)
    sliding[MOTOR_SPEED], bristle, speeds = 3.0, 0.0, []
    for _ in range(100):
        bristle = rub(sliding, MOTOR_SPEED, response, friction, 0.0, bristle, step)
        speeds.append(sliding[MOTOR_SPEED])
    assert -np.diff(speeds)[-20:] / step == pytest.approx(20.0, rel=1e-3)
    assert stiffness * bristle == pytest.approx(20.0, rel=1e-3)
