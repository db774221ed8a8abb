"""The interface of simulators: one test walks over all kinds; effects before, behind and within."""

from __future__ import annotations

import numpy as np
import pytest
from own_simulators import AXIS_RATE, RATE, integrator, motor, rigid_axis, steps, sweep

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.case.simulator import FunctionSimulator, Simulator
from bayes_hw.gap.effects.any_simulator import FOR_ANY_SIMULATOR, effects_for, written
from bayes_hw.gap.effects.catalogue import catalogue
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.labels import BLOCKS
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.rigid_axis import RigidAxis
from bayes_hw.gap.simulate.signal_kernel import command_side, output_side
from bayes_hw.gap.simulate.simulator_chain import ForceLaw, SimulatorBuilder, simulator_scale
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Uniform
from bayes_hw.record import Record, Units

KINDS: list[tuple[Simulator, FloatArray]] = [
    (rigid_axis(), sweep(300, 3)),
    (motor(), steps(300, 3, 9.0)),
    (integrator(), steps(300, 4, 0.5)),
]
IDS = [simulator.name for simulator, _ in KINDS]


def nominal(simulator: Simulator) -> FloatArray:
    return np.array([parameter.nominal for parameter in simulator.parameters])


def hypothesis(simulator: Simulator, u: FloatArray) -> Hypothesis:
    y = simulator.simulate(nominal(simulator)[None], u)[0]
    records = [
        Record("r", np.arange(len(u)) / simulator.sample_rate_hz, u, y, simulator.sample_rate_hz, Units())
    ]
    scale = simulator_scale(simulator, records, 1e-3 * float(np.ptp(y)))
    return Hypothesis(SimulatorBuilder(simulator), scale, [u])


@pytest.mark.parametrize(("simulator", "u"), KINDS, ids=IDS)
def test_every_simulator_has_what_a_diagnosis_needs(simulator: Simulator, u: FloatArray) -> None:
    """A batch is its rows; parameters move the output; a hypothesis of it simulates the same."""
    values = np.tile(nominal(simulator), (3, 1))
    values[1] = values[1] * 1.02 + 1e-3
    outputs = simulator.simulate(values, u)
    assert outputs.shape == (3, len(u)) and np.isfinite(outputs).all()
    np.testing.assert_array_equal(outputs[0], outputs[2])
    np.testing.assert_array_equal(outputs[1], simulator.simulate(values[1:2], u)[0])
    assert np.abs(outputs[1] - outputs[0]).max() > 0
    found = hypothesis(simulator, u)
    np.testing.assert_allclose(found.simulate(values[1])[0], outputs[1], atol=1e-12)
    np.testing.assert_allclose(found.to_values(found.to_coordinates(values[1])), values[1])
    assert found.base_count == len(simulator.parameters) == len(found.builder.start_spreads)


@pytest.mark.parametrize(
    "effect", effects_for(hypothesis(*KINDS[0]).scale, S.FORCE_SIDE), ids=lambda e: e.name
)
def test_every_effect_moves_a_simulator_and_vanishes(effect: Effect) -> None:
    """At its first start; every start lies where its prior is finite."""
    base = hypothesis(*KINDS[0])
    parameters = effect.parameters(base.scale)
    starts = effect.starts(base.scale) or [effect.test_values]
    for start in starts:
        for parameter, value in zip(parameters, start, strict=True):
            assert parameter.name.startswith(f"{effect.label}.")
            assert np.isfinite(parameter.prior.log_density(np.asarray(value)))
    values = np.concatenate([nominal(rigid_axis()), starts[-1]])
    moved = base.with_effect(effect).simulate(values)[0]
    assert np.isfinite(moved).all()
    if effect.label != "saturation":
        assert np.abs(moved - base.simulate(nominal(rigid_axis()))[0]).max() > 0


@pytest.mark.parametrize("kind", FOR_ANY_SIMULATOR, ids=lambda kind: kind.__name__)
def test_effects_of_simulators_say_what_they_are(kind: type[Effect]) -> None:
    effect = kind()
    assert len(" ".join((kind.__doc__ or "").split())) > 80
    assert effect.block in BLOCKS
    assert len(effect.parameters(hypothesis(*KINDS[0]).scale)) == len(effect.test_values)


def test_effects_find_their_doors_by_what_they_write() -> None:
    """Friction needs the force door; what needs the inside of a drive train finds none; labels are struck."""
    scale: AxisScale = hypothesis(*KINDS[1]).scale
    names = {
        door: {e.name for e in effects_for(scale, S.FORCE_SIDE if door else frozenset())}
        for door in (False, True)
    }
    assert names[True] - names[False] == {
        "friction (Coulomb, motor)",
        "friction (Stribeck, motor)",
        "friction (Coulomb and viscous)",
        "friction (Coulomb and viscous, unequal by direction)",
        "torque_ripple (motor)",
    }
    inside = {e.label for e in catalogue()} - {e.label for e in effects_for(scale, S.FORCE_SIDE)}
    assert inside == {"unmodelled_mode", "cubic_stiffness", "saturation_drift"}
    struck = effects_for(scale, S.FORCE_SIDE, frozenset({"friction", "lag"}))
    assert not {"friction", "lag"} & {e.label for e in struck}
    for effect in effects_for(scale, S.FORCE_SIDE):
        assert written(effect, scale) <= S.COMMAND_SIDE | S.OUTPUT_SIDE | S.FORCE_SIDE


def shown(u: FloatArray, rate: float, **changed: float) -> FloatArray:
    settings, v = S.NEUTRAL.copy(), np.empty(len(u))
    for name, value in changed.items():
        settings[getattr(S, name)] = value
    command_side(u, rate, settings, v)
    return v


def test_the_command_side_does_what_its_formulas_say() -> None:
    u = steps(200, 5, 3.0)
    np.testing.assert_array_equal(shown(u, RATE), u)
    delayed = shown(u, RATE, EXTRA_DELAY=2.25)
    np.testing.assert_allclose(delayed[3:], 0.75 * u[1:-2] + 0.25 * u[:-3])
    dead = shown(u, RATE, INPUT_DEAD_LOWER=0.5, INPUT_DEAD_UPPER=1.0)
    np.testing.assert_allclose(dead, np.where(u > 1, u - 1, np.where(u < -0.5, u + 0.5, 0)))
    np.testing.assert_allclose(shown(u, RATE, LOWER=-1.0, UPPER=2.0), np.clip(u, -1, 2))
    np.testing.assert_allclose(shown(u, RATE, BIAS=0.2), u + 0.2)
    t = np.arange(200) / RATE
    np.testing.assert_allclose(
        shown(u, RATE, GAIN_CHANGE=0.1, GAIN_TIME=3.0), u * (1 + 0.1 * (1 - np.exp(-t / 3)))
    )
    ramp = shown(np.ones(200), RATE, COMMAND_RATE=0.5)
    np.testing.assert_allclose(ramp[:40], 0.5 * (t[:40] + 0.5 / RATE))
    np.testing.assert_allclose(ramp[41:], 1.0)


def test_the_mean_of_a_lagged_step_is_that_of_the_exponential() -> None:
    time, t = 0.4, np.arange(100) / RATE
    found = shown(np.ones(100), RATE, LAG=time)
    mean = 1 - RATE * time * (np.exp(-t / time) - np.exp(-(t + 1 / RATE) / time))
    np.testing.assert_allclose(found, mean, atol=1e-12)


def test_the_output_side_leaves_and_changes_as_told() -> None:
    x, w, y = np.sin(np.arange(300) / 20), np.empty(300), np.empty(300)
    output_side(x, RATE, S.NEUTRAL, w, y)
    np.testing.assert_array_equal(y, x)
    settings = S.NEUTRAL.copy()
    settings[S.GAIN_RATIO], settings[S.DRIFT_RATE] = 1.1, 0.01
    output_side(x, RATE, settings, w, y)
    np.testing.assert_allclose(y, np.where(x > 0, 1.1 * x, x) + 0.01 * np.arange(300) / RATE)


def rubbed(values: FloatArray, inputs: FloatArray, force: ForceLaw | None) -> FloatArray:
    """A user's own rigid axis with a force door, explicit and finely stepped, in open loop."""
    fine = 200
    h = 1 / (AXIS_RATE * fine)
    x, v = np.zeros(len(values)), values[:, 1].copy()
    found = np.empty((len(values), len(inputs)))
    for k, u in enumerate(inputs):
        found[:, k] = x
        for _ in range(fine):
            a = 12.0 * u / values[:, 0] + (0.0 if force is None else force(k, x, v))
            v = v + h * a
            x = x + h * v
    return found


def test_the_force_door_of_a_function_and_of_the_compiled_axis_agree() -> None:
    """Friction by direction, Stribeck's curve and ripple by two integrations."""
    u = 0.3 * np.sin(2 * np.pi * np.arange(150) / AXIS_RATE) + 0.1
    settings = S.NEUTRAL.copy()
    settings[[S.MOTOR_FRICTION, S.MOTOR_SMOOTHING, S.MOTOR_STATIC, S.MOTOR_STRIBECK_SPEED]] = (
        0.1,
        0.02,
        0.3,
        0.05,
    )
    settings[[S.VISCOUS, S.VISCOUS_ASYMMETRY, S.MOTOR_ASYMMETRY]] = 0.5, 0.2, -0.1
    settings[[S.RIPPLE, S.RIPPLE_PERIOD, S.RIPPLE_PHASE, S.RIPPLE_START]] = 0.05, 0.02, 0.4, -0.03
    own = FunctionSimulator("own", rubbed, rigid_axis().parameters, AXIS_RATE, force_door=True)
    fine = RigidAxis("fine", 10.0, 12.0, 20 * AXIS_RATE, 0.01)
    values, law = np.array([[10.0, 0.0]]), ForceLaw(settings[None])
    expected = fine.simulate(values, np.repeat(u, 20), law)[0][::20]
    free = fine.simulate(values, np.repeat(u, 20))[0][::20]
    found = own.simulate(values, u, law)[0]
    assert np.abs(found - free).max() > 0.02
    np.testing.assert_allclose(found, expected, atol=2e-4)


def test_known_inputs_pass_effects_of_the_command_by() -> None:
    """A bias is added to the command, not to the wind beside it; a pulse of the command finds none."""
    given = np.column_stack([steps(200, 5, 3.0), steps(200, 6, 1.0)])
    windy = FunctionSimulator(
        "windy",
        lambda values, inputs: values[:, :1] * inputs[:, 0] + values[:, 1:] * inputs[:, 1],
        motor().parameters,
        RATE,
        known_inputs=("wind",),
    )
    settings = S.NEUTRAL.copy()
    settings[S.BIAS] = 0.2
    builder = SimulatorBuilder(windy)
    chain = builder.chain(np.array([30.0, 0.3]))
    ((_, y),) = builder.simulate([chain], settings[None], [given])
    np.testing.assert_allclose(y[:, 0], 30 * (given[:, 0] + 0.2) + 0.3 * given[:, 1])
    pulse = np.eye(200)[:, :1]
    np.testing.assert_allclose(chain.small_responses("command", pulse), 30 * pulse, atol=1e-9)


def test_a_friction_above_the_drive_holds_the_axis() -> None:
    settings = S.NEUTRAL.copy()
    settings[[S.MOTOR_FRICTION, S.MOTOR_SMOOTHING]] = 5.0, 1e-9
    x = rigid_axis(None).simulate(np.array([[10.0, 0.0]]), np.full(100, 1.0), ForceLaw(settings[None]))[0]
    assert np.abs(x).max() < 1e-8


def test_wrong_shapes_and_priors_are_refused() -> None:
    wrong = FunctionSimulator("wrong", lambda _, u: u, motor().parameters, RATE)
    with pytest.raises(InputError, match=r"returned shape \(50,\)"):
        wrong.simulate(np.ones((1, 2)), np.zeros(50))
    for parameters, said in (
        ((), "no parameter"),
        ((Parameter("a", "", 0.5, Uniform(0, 1), Identity()),), "give a Normal prior"),
        ((Parameter("a", "", 0.5, LogNormal(0.5, 1), Identity()),), "give a Normal prior"),
    ):
        with pytest.raises(InputError, match=said):
            SimulatorBuilder(FunctionSimulator("odd", motor().function, parameters, RATE))
    assert isinstance(motor().parameters[0].transform, Logarithm)
    still = Record("still", np.arange(300) / RATE, np.zeros(300), np.zeros(300), RATE, Units())
    with pytest.raises(InputError, match="give records that move"):
        simulator_scale(motor(), [still], 1.0)
