"""bayes-hw demo: it runs the commands that it prints, and says of their results what the files say."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from command_files import few_orders, files_below
from drawn_posterior import posterior_of
from strokes import draw_strokes

from bayes_hw.cli import build_parser, main
from bayes_hw.commands import demo
from bayes_hw.gap.blind import make
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.plant.kinds import KINDS

RUN_COMMAND = demo.run_command
FEW = set(LABEL_BLOCKS) - {"friction"}


def run_shorter(parsed: argparse.Namespace, *arguments: str) -> None:
    """The command, a diagnosis of one effect, which it prints as well; a posterior is drawn without a run."""
    run_other = draw_posterior if arguments[0] == "sample" else parsed.run_other
    shorter = ("--without", *FEW) if arguments[0] == "diagnose" else ()
    RUN_COMMAND(argparse.Namespace(**vars(parsed) | {"run_other": run_other}), *arguments, *shorter)


def draw_posterior(given: list[str]) -> int:
    parsed = build_parser().parse_args(given)
    posterior_of(HammersteinWiener.read(Path(parsed.model))).write(Path(parsed.out))
    return 0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "run_command", run_shorter)
        draw_strokes(patch)
        few_orders(patch)
        patch.setattr(make, "KINDS", {"easy": replace(KINDS["easy"], durations_s=(20.0,))})
        patch.chdir(tmp_path_factory.mktemp("demo"))
        yield Path.cwd()


def test_a_new_user_gets_from_records_to_a_verdict(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every command printed can be parsed and has left its files; the numbers said are those of the files."""
    assert main(["demo"]) == 0
    printed = capsys.readouterr().out
    out = folder / "bayes-hw-demo"
    commands = [
        shlex.split(line.partition("$ ")[2]) for line in printed.splitlines() if line.startswith("    $ ")
    ]
    assert [command[:2] for command in commands] == [
        ["bayes-hw", name] for name in ("identify", "sample", "diagnose")
    ]
    found = files_below(out)
    assert found > {
        "case/train_1.csv",
        "case/truth.json",
        "identified/model.json",
        "posterior/posterior.nc",
        "diagnosis/verdict.json",
        "diagnosis/report.html",
        "diagnosis/report.pdf",
    }
    verdict = json.loads((out / "diagnosis" / "verdict.json").read_text())
    truth = json.loads((out / "case" / "truth.json").read_text())
    assert verdict["answer"] == truth["effects"] == ["friction"]
    words = " ".join(printed.split())
    mean = verdict["base"]["mode1.frequency_hz"]["mean"]
    assert f"the simulator with it says {mean:.3f}" in words and "The verdict was friction: right." in words


def test_a_folder_that_cannot_be_used_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "file").write_text("")
    assert main(["demo", "--out", "file"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "is a file where a folder is to be" in line
