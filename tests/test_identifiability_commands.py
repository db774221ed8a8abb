"""bayes-hw identifiability and design-experiment: their examples run, and they refuse in one line."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from command_files import files_below, write_record
from identifiability.conftest import swinging
from short_sampling import sample_shortly
from strokes import draw_strokes
from tried_here import try_here

from bayes_hw.cli import main
from bayes_hw.commands import design_experiment, identifiability
from bayes_hw.identifiability import experiment_check
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SHORT = ("--walkers", "32", "--max-steps", "50", "--jobs", "1", "--quiet")


@pytest.fixture(scope="module", autouse=True)
def _short_pilot() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        draw_strokes(patch)
        try_here(patch)
        yield


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model, two records, and the posterior that the examples start from."""
    folder = tmp_path_factory.mktemp("axis")
    small_axis.write(folder / "model" / "model.json")
    for seed in (1, 2):
        write_record(folder / f"train_{seed}.csv", swinging(small_axis, seed, share=0.6))
    model, record, out = folder / "model" / "model.json", folder / "train_1.csv", folder / "posterior"
    assert main(["sample", "--model", str(model), str(record), "--out", str(out), *SHORT]) == 0
    return folder


def example(command: ModuleType) -> list[str]:
    program, *arguments = shlex.split(command.EXAMPLE)
    assert program == "bayes-hw"
    return arguments


def test_identifiability_writes_its_files(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setattr("bayes_hw.infer.convergence.ESS_LIMIT", 1e5)
    assert main([*example(identifiability), *SHORT]) == 0
    out = folder / "identifiability"
    assert files_below(out) == {"identifiability.json", "freed_draws.csv", "report.html", "report.pdf"}
    content = json.loads((out / "identifiability.json").read_text())
    assert content["schema"] == "bayes-hw/identifiability/1"
    assert content["structure"]["flat_directions"] == [2]
    assert content["verdicts"]["gain"]["verdict"] == "identified"
    kinds = [setting["kind"] for setting in content["structure"]["settings"]]
    assert kinds == ["normalization", "normalization", "assumption", "assumption"]
    page = (out / "report.html").read_text()
    for words in ("normalization: costs nothing", "assumption: data can contradict it", "exactly flat"):
        assert words in page
    assert "NOT CONVERGED" in capsys.readouterr().err


def test_design_experiment_writes_a_command_and_checks_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setattr(
        experiment_check, "DEFAULT_SETTINGS", SamplerSettings(ensembles=2, walkers=32, max_steps=50)
    )
    more = ["--duration", "20", "--evaluations", "16", "--check", "1", "--jobs", "1", "--stroke", "-4", "4"]
    assert main([*example(design_experiment), *more]) == 0
    out = folder / "next"
    assert files_below(out) == {"command.csv", "experiment.json", "report.html", "report.pdf"}
    u = np.genfromtxt(out / "command.csv", delimiter=",", names=True)["u"]
    assert len(u) == 400
    assert np.max(np.abs(u)) <= 1.5
    content = json.loads((out / "experiment.json").read_text())
    assert content["check"]["replicates"] == 1
    assert content["winner"]["expected_gain_nats"] > content["repeated"]["expected_gain_nats"]
    printed = capsys.readouterr().out
    assert "first record's command again" in printed
    assert "widths obtained over predicted" in printed


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--about", "nonsense"], "--about nonsense: is not a parameter"),
        (["--velocity", "-1"], "velocity limit: must be finite and positive"),
        (["--stroke", "2", "1"], "stroke: needs lowest < highest"),
        (["--evaluations", "3"], "--evaluations 3: must be 16 or more"),
        (["--duration", "0"], "duration"),
        (["--posterior", "nowhere"], "nowhere/posterior.nc: missing"),
    ],
)
def test_design_experiment_refuses_in_one_line(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    more: list[str],
    says: str,
) -> None:
    monkeypatch.chdir(folder)
    arguments = ["design-experiment", "--posterior", "posterior", "--out", "refused", "--quiet", *more]
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line
    assert not (folder / "refused").exists()


def test_identifiability_refuses_another_rate(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [str(folder / "model" / "model.json"), str(folder / "train_1.csv"), "--resample", "50"]
    assert main(["identifiability", *arguments, "--out", str(folder / "no"), "--quiet"]) == 2
    assert "--resample 20" in capsys.readouterr().err


@pytest.mark.parametrize("command", [identifiability, design_experiment])
def test_help_ends_with_the_example(command: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as done:
        main([command.NAME, "--help"])
    assert done.value.code == 0
    assert capsys.readouterr().out.rstrip().endswith(command.EXAMPLE)
