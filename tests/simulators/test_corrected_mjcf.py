"""From a MuJoCo model and records to the model with the effect in it, run outside the program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from example_axis import commands, record, write_mjcf

pytest.importorskip("mujoco")

from bayes_hw.cli import main
from bayes_hw.files import write_csv
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.fit import draws
from bayes_hw.simulators.edits import Edit
from bayes_hw.simulators.mjcf_axis import MjcfAxis
from bayes_hw.simulators.simulator_diagnosis import open_simulator

pytestmark = pytest.mark.slow

SAMPLES, SIGMA, TORQUE = 500, 0.002, 2.0
FEW = [label for label in LABEL_BLOCKS if label not in ("friction", "encoder_eccentricity")]
OWN = ["dead_zone", "saturation", "lag"]


def write_records(folder: Path, path: Path) -> None:
    """a.csv and b.csv of the axis with dry friction of the dish, its parameters off the nominal."""
    axis = open_simulator(path)
    assert isinstance(axis, MjcfAxis)
    true = [1.08 * parameter.nominal for parameter in axis.parameters]
    friction = Edit("joint", "azimuth", "frictionloss", TORQUE)
    model = axis.with_edits([*axis.base_edits(np.array(true)), friction])
    rng = np.random.default_rng(5)
    for name in ("a", "b"):
        u = commands(rng, SAMPLES)
        y = axis.motion(model, u, np.zeros((0, 11))) + SIGMA * rng.standard_normal(SAMPLES)
        found = record(name, u, y)
        write_csv(folder / f"{name}.csv", {"t": found.t, "u": found.u, "y": found.y})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of one diagnosis from the command line, with fewer posterior draws and longer steps."""
    folder = tmp_path_factory.mktemp("corrected")
    path = write_mjcf(folder)
    path.write_text(path.read_text().replace('timestep="0.002"', 'timestep="0.004"'))
    write_records(folder, path)
    train, held_out = (str(folder / f"{name}.csv") for name in ("a", "b"))
    given = ["--simulator", str(path), "--train", train, "--holdout", held_out]
    options = ["--out", str(folder / "out"), "--no-report", "--jobs", "1", "--without", *FEW, *OWN]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(draws, "WALKERS", 20)
        patch.setattr(draws, "STEPS", 12)
        patch.setattr(draws, "ROUNDS", 2)
        patch.setattr(draws, "DRAWS_A_DIMENSION", 16)
        assert main(["diagnose", *given, *options]) == 0
    return folder


def test_the_effect_is_found_and_sized_on_the_simulator(folder: Path) -> None:
    verdict = json.loads((folder / "out" / "verdict.json").read_text())
    assert verdict["answer"] == ["friction"]
    assert verdict["gap"]["holdout"]["closed"] > 0.98
    stiffness = verdict["base"]["tendon/gear/stiffness"]
    assert abs(stiffness["mean"] - 1.08 * 4000) < 4 * stiffness["sd"]


def test_the_corrected_model_has_the_effect_by_means_of_mujoco(folder: Path) -> None:
    import mujoco

    numbers = json.loads((folder / "out" / "corrected" / "corrected.json").read_text())
    assert numbers["mean"]["laws"] == []
    assert len(numbers["draws"]) == 20
    losses = []
    for one in (numbers["mean"], *numbers["draws"]):
        model = mujoco.MjModel.from_xml_path(str(folder / "out" / "corrected" / one["model"]))
        losses.append(float(model.joint("azimuth").frictionloss[0]))
        np.testing.assert_allclose(
            model.tendon_stiffness[0], one["parameters"]["tendon/gear/stiffness"], rtol=1e-5
        )
    assert abs(losses[0] - TORQUE) < 0.1
    assert np.std(losses[1:]) > 0


def test_it_closes_the_gap_outside_the_program_as_the_verdict_says(folder: Path) -> None:
    """In a Python of its own, from another folder, without this package on its path and nothing compiled."""
    given = json.loads((folder / "out" / "verdict.json").read_text())["gap"]["holdout"]
    program = folder / "out" / "corrected" / "simulate.py"
    assert "import bayes_hw" not in program.read_text()
    assert "from bayes_hw" not in program.read_text()
    command = [sys.executable, "-E", str(program), str(folder / "b.csv"), str(folder / "repaired.csv")]
    subprocess.run(command, check=True, cwd=folder, env={**os.environ, "NUMBA_DISABLE_JIT": "1"})
    measured = np.loadtxt(folder / "b.csv", delimiter=",", skiprows=1)
    repaired = np.loadtxt(folder / "repaired.csv", delimiter=",", skiprows=1)
    floor = given["noise_floor"] ** 2
    before = given["rmse_before"] ** 2 - floor
    closed = float(1 - (np.mean((measured[:, 2] - repaired[:, 2]) ** 2) - floor) / before)
    low, high = given["closed_hdi94"]
    slack = 0.005
    assert low - slack <= closed <= high + slack
    said = json.loads((folder / "out" / "corrected" / "corrected.json").read_text())["holdout"]
    np.testing.assert_allclose(closed, said["closed"], atol=slack)
