"""A MuJoCo model as an axis: its linear stand-in, the catalogue's forces in it, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_axis import (
    DECLARED,
    DECLARED_LOOP,
    TORQUE_MOTOR,
    URDF,
    URDF_DECLARED,
    commands,
    record,
    write_mjcf,
)

pytest.importorskip("mujoco")

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.case.simulator import SimulatorWithDoors
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.effects.any_simulator import effects_for
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.simulator_chain import ForceLaw, inner_settings, simulator_scale
from bayes_hw.simulators.mjcf_axis import MjcfAxis
from bayes_hw.simulators.simulator_diagnosis import open_simulator

SAMPLES = 1000


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> MjcfAxis:
    found = open_simulator(write_mjcf(tmp_path_factory.mktemp("axis")))
    assert isinstance(found, MjcfAxis)
    return found


@pytest.fixture(scope="module")
def u() -> FloatArray:
    return commands(np.random.default_rng(1), SAMPLES)


def values(axis: MjcfAxis) -> FloatArray:
    """Parameters (1, parameters) off the nominal ones."""
    return np.array([[1.1 * parameter.nominal for parameter in axis.parameters]])


def law(**changed: float) -> ForceLaw:
    settings = S.NEUTRAL.copy()
    for name, value in changed.items():
        settings[getattr(S, name)] = value
    return ForceLaw(settings[None])


def test_the_linear_axis_is_the_simulator_where_that_is_linear(axis: MjcfAxis, u: FloatArray) -> None:
    full, linear = axis.simulate(values(axis), u), axis.linear.simulate(values(axis), u)
    assert np.ptp(full) > 1.0
    np.testing.assert_allclose(linear, full, atol=1e-9)
    assert isinstance(axis, SimulatorWithDoors)


SMOOTH = (
    {"RIPPLE": 50.0, "RIPPLE_PERIOD": 3.0, "RIPPLE_PHASE": 0.4, "RIPPLE_START": -20.0},
    {"LOAD_RIPPLE": 20.0, "LOAD_RIPPLE_PERIOD": 3.0, "LOAD_RIPPLE_SECOND": 5.0},
    {"MESH_RIPPLE": 20.0, "MESH_RIPPLE_PERIOD": 3.0},
    {"GAP": 0.01},
    {"CUBIC": 500.0},
    {"CUBIC": -500.0, "SOFTENING": 500.0},
)
DRY = (
    {"MOTOR_FRICTION": 50.0, "MOTOR_SMOOTHING": 0.05},
    {"MOTOR_FRICTION": 50.0, "MOTOR_SMOOTHING": 0.05, "VISCOUS": 5.0},
    {"MOTOR_FRICTION": 50.0, "MOTOR_SMOOTHING": 0.05, "MOTOR_ASYMMETRY": 0.2},
    {"LOAD_FRICTION": 20.0, "LOAD_SMOOTHING": 0.02},
    {"LOAD_FRICTION": 20.0, "LOAD_SMOOTHING": 0.02, "LOAD_STATIC": 0.5, "LOAD_STRIBECK_SPEED": 0.1},
    {"LOAD_FRICTION": 20.0, "LOAD_PRESLIDING": 4000.0},
)


@pytest.mark.parametrize("changed", SMOOTH, ids=lambda each: next(iter(each)))
def test_smooth_forces_are_the_same_in_both(axis: MjcfAxis, u: FloatArray, changed: dict[str, float]) -> None:
    """A gap by a tendon's slack, springs by a polynomial or a law, ripple by a law."""
    none = axis.linear.simulate(values(axis), u)
    full, linear = (each.simulate(values(axis), u, law(**changed)) for each in (axis, axis.linear))
    assert np.abs(full - none).max() > 1e-4
    np.testing.assert_allclose(linear, full, atol=1e-8)


@pytest.mark.parametrize("changed", DRY, ids=lambda each: "-".join(each))
def test_dry_friction_is_nearly_the_same_in_both(
    axis: MjcfAxis, u: FloatArray, changed: dict[str, float]
) -> None:
    """MuJoCo's frictionloss fades at low speed by a law of its own: within a thirtieth of the effect."""
    none = axis.linear.simulate(values(axis), u)
    full, linear = (each.simulate(values(axis), u, law(**changed)) for each in (axis, axis.linear))
    assert np.std(full - none) > 0.03
    assert np.std(linear - full) < np.std(full - none) / 30


def test_plain_friction_is_frictionloss_and_a_falling_one_a_law(axis: MjcfAxis) -> None:
    at = values(axis)[0]
    plain = axis.forces_of(at, law(**DRY[3]).settings[0])
    assert [edit.field for edit in plain.edits] == ["frictionloss", "friction_time"]
    assert len(plain.laws) == 0
    inertia = 1.1 * 10 * np.pi / 180
    np.testing.assert_allclose(plain.edits[0].value, 20.0 * inertia, rtol=0.01)
    falling = axis.forces_of(at, law(**DRY[4]).settings[0])
    assert falling.edits == []
    assert len(falling.laws) == 1


@pytest.mark.slow
def test_a_known_force_enters_at_the_motor(axis: MjcfAxis, u: FloatArray) -> None:
    push = np.zeros(SAMPLES)
    push[200:300] = 10.0
    known = ForceLaw(S.NEUTRAL[None], push)
    full, linear = (each.simulate(values(axis), 0 * u, known) for each in (axis, axis.linear))
    assert np.abs(full).max() > 0.01
    np.testing.assert_allclose(linear, full, atol=1e-9)


def test_columns_of_the_records_enter_at_their_doors(tmp_path: Path, u: FloatArray) -> None:
    """As the same forces held there do; and a simulator that takes them is refused a record without."""
    path = write_mjcf(tmp_path)
    declared = path.with_suffix(".toml")
    known = '[known.gust]\ndoor = "load"\nfactor = 2.5\n[known.motor_torque]\ndoor = "motor"\n'
    declared.write_text(declared.read_text() + known)
    axis = open_simulator(path)
    assert isinstance(axis, MjcfAxis)
    gust, torque = np.sin(np.arange(SAMPLES) / 9), np.where(np.arange(SAMPLES) > 250, 0.4, 0.0)
    given = np.column_stack([u, gust, torque])
    full, linear = axis.simulate(values(axis), given), axis.linear.simulate(values(axis), given)
    np.testing.assert_allclose(linear, full, atol=1e-9)
    forces = np.zeros((SAMPLES, 3))
    forces[:, list(axis.places).index("load")] = 2.5 * gust
    forces[:, list(axis.places).index("motor")] = torque
    model = axis.with_edits(axis.base_edits(values(axis)[0]))
    held = axis.motion(model, u, np.zeros((0, 11)), forces)
    np.testing.assert_allclose(full[0], held, atol=1e-12)
    assert np.std(held - axis.motion(model, u, np.zeros((0, 11)))) > 0.01
    plain, apart = record("a", u, held), record("b", 0.5 * u, 0.5 * held)
    with pytest.raises(InputError, match=r"takes 'gust', which was not read; give --known 'gust'"):
        SimulatorCase.of_records(axis.linear, [plain], [apart])
    one, other = (replace(each, known={"gust": gust, "motor_torque": torque}) for each in (plain, apart))
    np.testing.assert_array_equal(SimulatorCase.of_records(axis, [one], [other]).inputs[0], given)


def test_effects_within_a_drive_train_find_their_doors(axis: MjcfAxis, u: FloatArray) -> None:
    from example_axis import record

    y = axis.linear.simulate(values(axis), u)[0]
    scale = simulator_scale(axis.linear, [record("a", u, y)], 0.002)
    labels = {effect.name for effect in effects_for(scale, inner_settings(axis.linear))}
    wanted = {"friction (Coulomb, load)", "backlash (gap in the compliance)", "torque_ripple (gear mesh)"}
    assert wanted <= labels
    assert "cubic_stiffness" in labels
    assert scale.stiffness == axis.linear.stiffness


@pytest.mark.parametrize("limit", [1000.0, 0.5])
def test_a_loop_outside_the_model_is_that_inside(
    tmp_path: Path, axis: MjcfAxis, u: FloatArray, limit: float
) -> None:
    """MuJoCo's own two actuators make the same loop; a limit of the torque shows."""
    declared = DECLARED.replace('"rate", "hold"', '"torque"') + DECLARED_LOOP.replace("1000.0", str(limit))
    outside = open_simulator(write_mjcf(tmp_path, TORQUE_MOTOR, declared))
    difference = np.abs(outside.simulate(values(axis), u) - axis.simulate(values(axis), u)).max()
    assert (difference < 0.02) if limit == 1000.0 else (difference > 0.1)
    if limit == 1000.0:
        full, linear = (each.simulate(values(axis), u) for each in (outside, outside.linear))
        np.testing.assert_allclose(linear, full, atol=1e-9)


def test_a_sensor_is_read_at_the_instant_of_the_sample(tmp_path: Path, axis: MjcfAxis, u: FloatArray) -> None:
    declared = DECLARED.replace('joint = "azimuth"\nunit', 'sensor = "encoder"\nunit')
    seen = open_simulator(write_mjcf(tmp_path, declared=declared))
    full = axis.simulate(values(axis), u)
    np.testing.assert_allclose(seen.simulate(values(axis), u), full, atol=1e-9)
    np.testing.assert_allclose(seen.linear.simulate(values(axis), u), full, atol=1e-9)


def test_a_urdf_is_an_axis_with_the_declared_loop(tmp_path: Path, u: FloatArray) -> None:
    path = tmp_path / "dish.urdf"
    path.write_text(URDF)
    path.with_suffix(".toml").write_text(URDF_DECLARED)
    axis = open_simulator(path)
    at = np.array([[2.0]])
    full, linear = axis.simulate(at, u), axis.linear.simulate(at, u)
    np.testing.assert_allclose(linear, full, atol=1e-9)
    assert np.ptp(full) > 0.5


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('["rate", "hold"]', '["speed"]', "no actuator 'speed' in the model; it has: rate, hold"),
        ('joint = "azimuth"\nunit', 'joint = "dome"\nunit', "no joint 'dome' in the model; it has: motor, "),
        ('joint = "azimuth"\nunit', 'variable = "angle"\nunit', "measured.variable is for an FMU"),
        ('tendon = "gear"', 'tendon = "belt"', "no tendon 'belt'"),
        ("joint/azimuth/armature", "joint/azimuth/mass", "'mass' of a joint is unknown; use armature"),
        ("joint/azimuth/armature", "joint/azimuth/stiffness", "is 0 in the model"),
        ("joint/azimuth/armature", "armature", "give KIND/NAME/FIELD"),
        ("sample_rate_hz = 50.0", "sample_rate_hz = 60.0", "is no whole part of a sample at 60 Hz"),
    ],
)  # fmt: skip
def test_what_does_not_fit_the_model_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in DECLARED
    path = write_mjcf(tmp_path, declared=DECLARED.replace(old, new, 1))
    with pytest.raises(InputError) as refused:
        open_simulator(path)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_files_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not there"):
        open_simulator(tmp_path / "none.xml")
    path = write_mjcf(tmp_path)
    path.write_text("<mujoco><worldbody>")
    with pytest.raises(InputError, match="MuJoCo cannot read it"):
        open_simulator(path)
    path.with_suffix(".toml").unlink()
    with pytest.raises(InputError, match=r"write axis\.toml beside it, or give --declaration"):
        open_simulator(path)
