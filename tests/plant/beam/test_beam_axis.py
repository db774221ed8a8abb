"""An axis of finite elements without a fault is the Hammerstein-Wiener system that its case states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant_axis import drawn_axis
from scipy import linalg

from bayes_hw.plant.beam.faults import CATALOGUE, UNNAMED, ControllerRamp, Rounding
from bayes_hw.plant.beam.mechanism import LOAD_INERTIA, Mechanism, draw_mechanism
from bayes_hw.plant.beam.plant import BeamPlant
from bayes_hw.plant.beam.simulation import BeamAxis, BeamRun
from bayes_hw.plant.case import make_case
from bayes_hw.plant.draws import rms
from bayes_hw.plant.effects.effect import Scales
from bayes_hw.plant.integrator import Friction
from bayes_hw.plant.kinds import KINDS, LABELS

KIND = replace(KINDS["beam"], durations_s=(20.0,), rates_hz=(40.0,))
PLANT = BeamPlant()


def drawn(seed: int) -> tuple[BeamAxis, float, list[np.ndarray], Scales]:
    return drawn_axis(PLANT, KIND, seed)


@pytest.mark.parametrize("seed", range(10))
def test_without_a_fault_it_is_the_stated_system(seed: int) -> None:
    """Limits, delay, dead zone and G of orders 10 to 20, of whatever loop: exact to rounding."""
    axis, _, commands, _ = drawn(seed)
    y = PLANT.run(axis, commands[0], (1,), []).measured()
    expected = PLANT.nominal_of(axis).simulate(commands[0])
    assert np.max(np.abs(y - expected)) < 1e-9 * np.ptp(expected)


def test_shapes_differ() -> None:
    drives = [drawn(seed)[0].drive for seed in range(20)]
    assert {len(d.mechanism.motors) for d in drives} == {1, 2}
    assert {d.loop.ki > 0 for d in drives} == {d.loop.ff > 0 for d in drives} == {True, False}
    assert {d.at_motor for d in drives} == {True, False}
    assert len({d.states for d in drives}) >= 5


def mechanism(seed: int) -> Mechanism:
    return draw_mechanism(np.random.default_rng(seed), 2.0)


@pytest.mark.parametrize("seed", range(4))
def test_all_of_it_turns_as_one_without_a_torque(seed: int) -> None:
    """Rigid turning costs nothing, turns the dish's tip by the same angle, and moves all inertias."""
    body = mechanism(seed)
    rigid = np.zeros(body.size)
    rigid[: body.hub + 1] = 1.0
    assert np.max(np.abs(body.stiffness @ rigid)) < 1e-9 * np.max(body.stiffness)
    assert body.tip @ rigid == pytest.approx(1.0)
    assert body.total_inertia > LOAD_INERTIA
    assert body.frequencies_hz()[1] > 1e-2
    assert np.all(linalg.eigvalsh(body.damping) > -1e-9)


def test_an_appendage_swings_at_its_frequency_where_its_host_is_held() -> None:
    body = mechanism(1).with_appendage(2, 0.3, 5.0, 0.01)
    assert np.sqrt(body.stiffness[-1, -1] / body.inertia[-1, -1]) / (2 * np.pi) == pytest.approx(5.0)
    rigid = np.zeros(body.size)
    rigid[: body.hub + 1] = 1.0
    assert np.max(np.abs(body.stiffness @ rigid)) < 1e-9 * np.max(body.stiffness)
    assert body.total_inertia == pytest.approx(mechanism(1).total_inertia + 0.3)


@pytest.mark.parametrize("effect", [*CATALOGUE, *UNNAMED], ids=lambda e: e.__name__)
def test_every_fault_changes_the_record_and_more_of_it_more(effect: type) -> None:
    axis, sigma, commands, scales = drawn(4)
    fault = effect.draw(np.random.default_rng(2), scales)
    clean = PLANT.run(axis, commands[0], (1,), []).measured()
    largest = min(fault.largest, 30.0)
    weak, strong = (
        rms([PLANT.run(axis, commands[0], (1,), [(fault, s)]).measured() - clean])
        for s in (0.02 * largest, largest)
    )
    assert np.isfinite(strong)
    assert strong > 1.2 * weak
    assert strong > 0.05 * sigma


def test_labels_are_those_of_the_catalogue() -> None:
    assert tuple(e.label for e in CATALOGUE) == LABELS
    assert {e.label for e in UNNAMED} == {"other"}


def test_a_controller_moves_its_ramp_once_a_sample() -> None:
    axis, _, _, scales = drawn(5)
    run = BeamRun(axis, np.full(200, 10.0), (1,))
    fault = replace(ControllerRamp.draw(np.random.default_rng(1), scales), detail="ramp_in_samples")
    fault.act(run, 6.0)
    moved = run.delayed().reshape(200, axis.substeps)[axis.delay_samples :]
    assert np.all(np.ptp(moved, axis=1) == 0)
    largest = fault.rate_deg_s2 / 6.0 / axis.sample_rate_hz
    assert np.diff(moved[:, 0])[:2] == pytest.approx(largest)
    assert moved[-1, 0] == pytest.approx(axis.upper)


def test_rounding_before_the_noise_leaves_the_noise_whole() -> None:
    axis, _, commands, scales = drawn(5)
    fault = Rounding("noise_after", 3 * scales.sigma)
    reading = PLANT.run(axis, commands[0], (1,), [(fault, 1.0)])
    lines = reading.measured() / (3 * scales.sigma)
    np.testing.assert_allclose(lines, np.round(lines), atol=1e-9)
    np.testing.assert_allclose(reading.measured(0.01) - reading.measured(), 0.01)


def test_dry_friction_holds_a_slow_axis() -> None:
    axis = replace(drawn(6)[0], dead_zone=0.0)
    command = np.full(100, 0.02 * axis.upper)
    free = PLANT.run(axis, command, (1,), []).angle
    run = BeamRun(axis, command, (1,))
    torque = 2 * axis.drive.loop.kp * axis.drive.loop.velocity_gain * command[0]
    run.change(motor_friction=Friction(torque, torque))
    held = run.read(run.angles()).angle
    assert abs(held[20]) < 0.3 * abs(free[20])


@pytest.mark.slow
def test_case_states_the_gap_that_a_refit_leaves_and_repeats() -> None:
    case, again = (make_case(5, 1, KIND, ["backlash"]) for _ in range(2))
    (gap,) = case.truth["gap_over_sigma"]  # type: ignore[misc]
    sigma = case.truth["base"]["noise.sigma"]  # type: ignore[index]
    assert 0.7 < gap < 5.3
    assert case.truth["gap_rms"]["train"] / sigma == pytest.approx(gap, rel=0.25)  # type: ignore[index]
    np.testing.assert_array_equal(case.train[0].measured, again.train[0].measured)
