"""Simulators of any kind are diagnosed: known effects are named, and nothing where there is nothing."""

from __future__ import annotations

import numpy as np
import pytest
from own_simulators import (
    AXIS_RATE,
    MASS,
    RATE,
    integrator,
    motor,
    motor_speed,
    record,
    rigid_axis,
    rubbing_axis,
    steps,
    sweep,
    travelled,
)

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.answer.sentence import sentence
from bayes_hw.gap.case.simulator import Simulator
from bayes_hw.gap.case.simulator_case import SimulatorCase, find_simulator
from bayes_hw.gap.diagnosis import Diagnosis, diagnose
from bayes_hw.record import Record

TRUE_MOTOR = np.array([[33.0, 0.27]])


def noisy(y: FloatArray, sigma: float, seed: int) -> FloatArray:
    return y + np.random.default_rng(seed).normal(0, sigma, len(y))


def diagnosed(simulator: Simulator, records: list[Record]) -> Diagnosis:
    case = SimulatorCase.of_records(simulator, records[:-1], records[-1:])
    return diagnose(case, np.random.default_rng(1), jobs=1)


def motor_records(lower: float, upper: float) -> list[Record]:
    """Staircases of a motor with a dead zone from -lower to upper, in V, and noise of 1 rpm."""
    found = []
    for seed in (1, 2, 3):
        u = steps(600, seed, 9.0)
        v = np.maximum(u - upper, 0) + np.minimum(u + lower, 0)
        y = noisy(motor_speed(TRUE_MOTOR, v)[0], 1.0, seed)
        found.append(record(str(seed), u, y, RATE, motor().units))
    return found


def test_dead_zone_of_a_linear_motor_is_named_with_its_edges() -> None:
    verdict = diagnosed(motor(), motor_records(1.8, 2.2)).verdict
    assert verdict.answer == ("dead_zone",)
    assert verdict.where.block == "input"
    edges = verdict.parameters["dead_zone.lower"], verdict.parameters["dead_zone.upper"]
    for edge, true in zip(edges, (1.8, 2.2), strict=True):
        assert abs(edge.mean - true) < 5 * edge.sd + 0.01
    assert verdict.gap_holdout.closed > 0.99
    assert verdict.gap_holdout.rmse_after == pytest.approx(1.0, rel=0.1)


@pytest.fixture(scope="module")
def nothing_missing() -> Diagnosis:
    """Of a motor whose noise is known."""
    return diagnosed(motor(1.0), motor_records(0.0, 0.0))


@pytest.mark.parametrize("noise_sigma", [pytest.param(float("nan"), marks=pytest.mark.slow), 1.0])
def test_nothing_is_named_where_there_is_nothing(nothing_missing: Diagnosis, noise_sigma: float) -> None:
    """With the noise known and unknown; base parameters come back."""
    unknown = np.isnan(noise_sigma)
    found = diagnosed(motor(noise_sigma), motor_records(0.0, 0.0)) if unknown else nothing_missing
    assert found.verdict.answer == ()
    assert "Nothing is missing" in sentence(found)
    gain = found.verdict.base["speed_per_volt"]
    assert abs(gain.mean - 33.0) < 5 * gain.sd


@pytest.mark.slow
def test_lag_of_an_integrator_is_named_with_its_time() -> None:
    records = []
    for seed in (4, 5):
        u = steps(500, seed, 0.5)
        decay = np.exp(-1 / (RATE * 10 * 0.2))
        fine = np.repeat(u, 10)
        followed = np.asarray(motor_like(fine, decay)).reshape(-1, 10).mean(axis=1)
        y = noisy(travelled(np.array([[0.0, 1.0]]), followed)[0], 1e-3, seed)
        records.append(record(str(seed), u, y, RATE))
    verdict = diagnosed(integrator(), records).verdict
    assert verdict.answer == ("lag",)
    time = verdict.parameters["lag.time"]
    assert time.mean == pytest.approx(0.2, rel=0.03)
    assert verdict.gap_holdout.closed > 0.98


def motor_like(u: FloatArray, decay: float) -> FloatArray:
    """First-order lag of a fine command, its value at the end of every fine sample."""
    state, found = 0.0, np.empty(len(u))
    for k, value in enumerate(u):
        state = value + (state - value) * decay
        found[k] = state
    return found


@pytest.fixture(scope="module")
def friction() -> Diagnosis:
    records = []
    for seed in (6, 7):
        u = sweep(700, seed)
        y = noisy(rubbing_axis(u, 4.0, 10.0, 20.0), 2e-5, seed)
        records.append(record(str(seed), u, y, AXIS_RATE, rigid_axis().units))
    return diagnosed(rigid_axis(), records)


@pytest.mark.slow
def test_friction_of_a_rigid_axis_in_closed_loop_is_named(friction: Diagnosis) -> None:
    """Against a simulation written out anew; Coulomb and viscous parts and their directions come back."""
    verdict = friction.verdict
    assert verdict.answer == ("friction",)
    assert verdict.where.block == "drive"
    assert verdict.gap_holdout.closed > 0.98
    torque, viscous = (verdict.parameters[f"friction.{name}"].mean * MASS for name in ("torque", "viscous"))
    assert torque == pytest.approx(4.0, rel=0.1)
    assert viscous == pytest.approx(15.0, rel=0.15)
    assert verdict.parameters["friction.viscous_asymmetry"].mean == pytest.approx(-1 / 3, abs=0.1)


@pytest.mark.slow
def test_only_labels_that_find_a_door_are_in_question(
    friction: Diagnosis, nothing_missing: Diagnosis
) -> None:
    without = nothing_missing.verdict.probability
    with_door = friction.verdict.probability
    assert {"dead_zone", "lag", "saturation", "backlash", "outliers", "rate_limit"} <= set(without)
    assert set(with_door) - set(without) == {"friction", "torque_ripple"}
    assert not {"unmodelled_mode", "cubic_stiffness", "saturation_drift", "wind"} & set(with_door)


@pytest.mark.slow
def test_a_record_held_out_can_go_on_where_another_ends() -> None:
    """With the commands before it the prediction is that of the whole record, and is scored on its end."""
    whole = motor_records(1.8, 2.2)[0]
    train, held = whole.window(0.0, 18.0), whole.window(18.0, 60.0)
    case = SimulatorCase.of_records(motor(), [train], [held], [train.u])
    found = diagnose(case, np.random.default_rng(1), jobs=1)
    fitted = found.decision.explanation.fit
    expected = fitted.hypothesis.simulate(fitted.values, [whole.u])[0]
    np.testing.assert_allclose(found.after, expected[len(train) :])
    assert found.verdict.gap_holdout.rmse_after < 1.5


def test_histories_are_one_for_each_record_held_out() -> None:
    records = motor_records(0.0, 0.0)
    with pytest.raises(InputError, match="2 histories for 1 records"):
        SimulatorCase.of_records(motor(), records[:1], records[1:2], [np.zeros(3), np.zeros(3)])


def test_simulators_are_found_by_name() -> None:
    assert find_simulator("own_simulators:motor").name == "motor"
    for name, said in (
        ("own_simulators:absent", "cannot be imported"),
        ("no_such_module:motor", "cannot be imported"),
        ("own_simulators:RATE", "is missing"),
    ):
        with pytest.raises(InputError, match=said):
            find_simulator(name)
