"""An FMU as an axis: its linear stand-in by pulses, forces at its inputs, and the FMU that wraps it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from example_axis import DECLARED, commands

pytest.importorskip("fmpy")
pytest.importorskip("pythonfmu")

import fmpy
from fmpy.fmi2 import FMU2Slave

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.files import write_text_atomically
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.simulator_chain import ForceLaw
from bayes_hw.simulators import laws, run_fmu, unit_loop
from bayes_hw.simulators.corrected import program
from bayes_hw.simulators.corrected_fmu import INNER, write_wrapper
from bayes_hw.simulators.fmu_axis import FmuAxis
from bayes_hw.simulators.simulator_diagnosis import open_simulator

UNIT_DECLARED = (
    DECLARED.split("[forces.motor]")[0]
    .replace('actuators = ["rate", "hold"]', 'variables = ["command"]')
    .replace('joint = "azimuth"', 'variable = "angle"')
    .replace("sample_rate_hz = 50.0", "sample_rate_hz = 50.0\nstep_s = 0.004")
    .replace("joint/azimuth/armature", "dish_inertia")
    .replace("tendon/gear/stiffness", "stiffness")
)
DOORS = """[forces.motor]
input = "motor_torque"
position = "motor_angle"
speed = "motor_speed"
[forces.load]
input = "dish_torque"
position = "angle"
speed = "speed"
"""


def built(folder: Path, builder: str = "pythonfmu", replaced: tuple[tuple[str, str], ...] = ()) -> Path:
    """The FMU with its declaration beside it."""
    text = Path(__file__).with_name("azimuth_unit.py").read_text()
    for old, new in replaced:
        text = text.replace(old, new)
    script = folder / f"azimuth_of_{builder}.py"
    script.write_text(text)
    build = [sys.executable, "-m", builder, "build", "-f", str(script), "-d", str(folder)]
    subprocess.run(build, check=True, capture_output=True)
    (folder / "Azimuth.toml").write_text(UNIT_DECLARED + DOORS)
    return folder / "Azimuth.fmu"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU (FMI 2) with its declaration beside it."""
    return built(tmp_path_factory.mktemp("unit"))


@pytest.fixture(scope="module")
def axis(path: Path) -> FmuAxis:
    found = open_simulator(path)
    assert isinstance(found, FmuAxis)
    return found


U = commands(np.random.default_rng(2), 500)
AT = np.array([[11.0, 4400.0]])


def law(**changed: float) -> ForceLaw:
    settings = S.NEUTRAL.copy()
    for name, value in changed.items():
        settings[getattr(S, name)] = value
    return ForceLaw(settings[None])


def test_the_linear_axis_is_the_unit_where_that_is_linear(axis: FmuAxis) -> None:
    """At parameters other than those whose responses gave the bases."""
    full = axis.simulate(AT, U)
    assert np.ptp(full) > 0.5
    np.testing.assert_allclose(axis.linear.simulate(AT, U), full, atol=1e-8)


def test_a_unit_of_fmi_3_is_the_same_axis(axis: FmuAxis, tmp_path: Path) -> None:
    pytest.importorskip("pythonfmu3")
    replaced = (("pythonfmu import", "pythonfmu3 import"), ("Fmi2", "Fmi3"), ("Real", "Float64"))
    third = open_simulator(built(tmp_path, "pythonfmu3", replaced))
    force = law(LOAD_FRICTION=20.0, LOAD_SMOOTHING=0.02)
    np.testing.assert_allclose(third.simulate(AT, U, force), axis.simulate(AT, U, force), atol=1e-9)
    np.testing.assert_allclose(third.linear.simulate(AT, U), third.simulate(AT, U), atol=1e-8)


@pytest.mark.parametrize(
    ("changed", "share"),
    [
        ({"RIPPLE": 50.0, "RIPPLE_PERIOD": 1.0, "RIPPLE_PHASE": 0.4}, 1e-6),
        ({"MESH_RIPPLE": 50.0, "MESH_RIPPLE_PERIOD": 1.0}, 1e-6),
        ({"LOAD_FRICTION": 20.0, "LOAD_SMOOTHING": 0.02}, 0.01),
        ({"MOTOR_FRICTION": 50.0, "MOTOR_SMOOTHING": 0.05, "MOTOR_ASYMMETRY": 0.2}, 0.02),
        ({"LOAD_FRICTION": 20.0, "LOAD_PRESLIDING": 4000.0}, 0.01),
    ],
)
def test_forces_enter_at_the_inputs(axis: FmuAxis, changed: dict[str, float], share: float) -> None:
    none = axis.linear.simulate(AT, U)
    full, linear = (each.simulate(AT, U, law(**changed)) for each in (axis, axis.linear))
    assert np.std(full - none) > 0.003
    assert np.std(full - linear) < share * np.std(full - none)


def test_columns_of_the_records_enter_with_the_forces_of_laws(path: Path, tmp_path: Path) -> None:
    """At the input that both share; the linear axis has the same of them."""
    declared = path.with_suffix(".toml").read_text() + '[known.gust]\ndoor = "load"\nfactor = 2.0\n'
    (tmp_path / "gust.toml").write_text(declared)
    windy = open_simulator(path, tmp_path / "gust.toml")
    force = law(LOAD_RIPPLE=20.0, LOAD_RIPPLE_PERIOD=1.0)
    given = np.column_stack([U, 5 * np.sin(np.arange(len(U)) / 7)])
    alone, both = windy.simulate(AT, given), windy.simulate(AT, given, force)
    still = windy.simulate(AT, given * [1, 0], force)
    assert min(np.std(both - alone), np.std(both - still)) > 0.003
    np.testing.assert_allclose(windy.linear.simulate(AT, given), alone, atol=1e-8)
    linear = windy.linear.simulate(AT, given, force)
    assert np.std(linear - both) < 1e-3 * np.std(both - alone)


def corrected_folder(axis: FmuAxis, folder: Path, changed: dict[str, float]) -> FloatArray:
    """A corrected simulator's files, and the settings (COUNT,) that are in it."""
    settings = law(**changed).settings[0]
    one = {
        "base": axis.named(AT[0]),
        "around": {"EXTRA_DELAY": 1.5, "ECCENTRICITY": 0.01, "ECCENTRICITY_PERIOD": 0.7},
        "laws": axis.laws_of(AT[0], settings).tolist(),
    }
    shutil.copyfile(axis.path, folder / INNER)
    loop = {
        "unit": INNER,
        "input_factor": axis.declaration.input_factor,
        "output_factor": axis.declaration.output_factor,
        "commands": ["command"],
        "output": "angle",
        "substeps": axis.substeps,
        "step_s": axis.step_s,
        "doors": [list(door) for door in axis.doors_of.values()],
        "known": [],
        "count": len(axis.doors_of),
    }
    numbers = {"sample_rate_hz": 50.0, "loop": loop, "mean": one, "draws": [{**one, "laws": []}]}
    write_text_atomically(folder / "corrected.json", json.dumps(numbers))
    return settings


def test_the_wrapper_is_the_unit_with_the_effect(axis: FmuAxis, tmp_path: Path) -> None:
    """As an FMU, as a program of its own, and as the axis within this package."""
    changed = {"LOAD_FRICTION": 20.0, "LOAD_SMOOTHING": 0.02}
    settings = corrected_folder(axis, tmp_path, changed)
    own = run_fmu.simulate(U, 0, tmp_path)
    delayed = 0.5 * np.concatenate([[0.0], U[:-1]]) + 0.5 * np.concatenate([[0.0, 0.0], U[:-2]])
    angle = axis.simulate(AT, delayed, ForceLaw(settings[None]))[0]
    np.testing.assert_allclose(own, angle + 0.01 * np.sin(2 * np.pi * angle / 0.7), atol=1e-12)

    assert write_wrapper(tmp_path)
    wrapper = tmp_path / "corrected_axis.fmu"
    description = fmpy.read_model_description(str(wrapper))
    references = {v.name: v.valueReference for v in description.modelVariables}
    place = fmpy.extract(str(wrapper))
    try:
        unit = FMU2Slave(
            guid=description.guid,
            unzipDirectory=place,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="corrected",
        )
        unit.instantiate()
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        shown = []
        for k in range(200):
            shown += unit.getReal([references["angle"]])
            unit.setReal([references["command"]], [float(U[k])])
            unit.doStep(0.02 * k, 0.02)
        unit.terminate()
        unit.freeInstance()
    finally:
        shutil.rmtree(place, ignore_errors=True)
    np.testing.assert_allclose(shown, own[:200], atol=1e-12)

    text = program(run_fmu, (laws, unit_loop))
    assert "bayes_hw import" not in text
    assert "from bayes_hw" not in text
    compile(text, "simulate.py", "exec")
    without = run_fmu.simulate(U, 1, tmp_path)
    assert np.std(without - own) > 0.01


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('variable = "angle"', 'variable = "tilt"', "no variable 'tilt' in the FMU; it has: motor_inertia"),
        ('variable = "angle"', 'joint = "angle"', "measured.joint is for MuJoCo; give variable"),
        ('input = "dish_torque"\n', "", "of an FMU give motor or load, with input, position and speed"),
        ("step_s = 0.004", "step_s = 0.003", "no whole part of a sample"),
        ('parameter = "stiffness"', 'parameter = "angle"', "has no positive start value"),
    ],
)
def test_what_does_not_fit_the_unit_is_named(
    path: Path, tmp_path: Path, old: str, new: str, said: str
) -> None:
    declared = UNIT_DECLARED + DOORS
    assert old in declared
    declaration = tmp_path / "wrong.toml"
    declaration.write_text(declared.replace(old, new, 1))
    with pytest.raises(InputError) as refused:
        open_simulator(path, declaration)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_unit_is_refused(path: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "axis.fmu"
    wrong.write_text("no archive")
    with pytest.raises(InputError, match="FMPy cannot open it"):
        open_simulator(wrong, path.with_suffix(".toml"))
