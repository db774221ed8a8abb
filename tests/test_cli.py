"""The command line: every command's example runs and writes the fixed formats, bad usage is one line."""

from __future__ import annotations

import csv
import json
import os
import pty
import shlex
import signal
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from command_files import few_orders, files_below, write_axis
from short_sampling import sample_shortly
from strokes import draw_strokes

from bayes_hw.cli import build_parser, main
from bayes_hw.infer.checkpoint import Checkpoint
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

COMMANDS = ("identify", "sample", "simulate", "predict", "report", "design", "diagnose", "convert", "demo")
SHORT = ("--walkers", "32", "--max-steps", "50")
"""A run too short to converge."""

PARAMETERS = [
    "saturation.lower",
    "saturation.upper",
    "dead_zone.half_width",
    "gain",
    "mode1.frequency_hz",
    "mode1.damping_ratio",
    "noise.sigma",
]
ENTRIES = {"mean", "sd", "median", "hdi94", "ess_bulk", "ess_tail", "r_hat", "mcse_mean", "unit"}


def example_of(command: str) -> list[str]:
    """The arguments of the example that the help of `command` ends with."""
    for action in build_parser()._actions:
        if isinstance(action.choices, dict):
            *_, line = action.choices[command].epilog.splitlines()
            program, *arguments = shlex.split(line)
            assert program == "bayes-hw"
            return arguments
    raise AssertionError


@pytest.fixture(scope="module", autouse=True)
def _short_pilot() -> Iterator[None]:
    """Sampling's pilot in a third of its steps, few poles looked for."""
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        few_orders(patch)
        yield


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records and a model, and what the examples of all commands but identify make of them."""
    folder = write_axis(tmp_path_factory.mktemp("axis"), small_axis)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        draw_strokes(patch)
        assert main([*example_of("simulate"), "--quiet"]) == 0
        assert main([*example_of("sample"), "--walkers", "64", "--target-ess", "500", "--quiet"]) == 0
        assert main([*example_of("predict"), "--quiet"]) == 0
        report = [*example_of("report"), "--model", "model/model.json", *SHORT, "--quiet"]
        assert main(report) == 0
    return folder


def read_table(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open() as stream:
        header, *rows = csv.reader(stream)
    return header, np.array(rows, dtype=float)


def read_json(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def without_seconds(path: Path) -> dict[str, Any]:
    content = read_json(path)
    assert content.pop("seconds") > 0
    return content


def sample_arguments(folder: Path, out: Path, *more: str) -> list[str]:
    model = folder / "model" / "model.json"
    return ["sample", "--model", str(model), str(folder / "train_1.csv"), "--out", str(out), *more]


def test_identify_writes_a_model_that_simulates(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its example runs; model.json can be read, and fit.json holds the four steps and the validation."""
    monkeypatch.chdir(folder)
    arguments = example_of("identify")
    arguments[arguments.index("--out") + 1] = str(tmp_path)
    assert main(arguments) == 0
    printed = capsys.readouterr()
    assert "holdout: Hammerstein-Wiener" in printed.out
    assert len(printed.err.splitlines()) == len(set(printed.err.splitlines()))
    model = HammersteinWiener.read(tmp_path / "model.json")
    assert model.saturation.upper == pytest.approx(1.0, rel=0.05)
    fit = read_json(tmp_path / "fit.json")
    assert len(fit["steps"]) == 4
    assert fit["validation"][0]["record"] == "holdout"
    assert files_below(tmp_path) == {"model.json", "fit.json"}


def test_simulate_writes_its_columns(folder: Path, small_axis: HammersteinWiener) -> None:
    header, values = read_table(folder / "run.csv")
    assert header == ["t", "u", "y", "w", "y_model"]
    simulation = small_axis.simulate(values[:, 1])
    np.testing.assert_allclose(values[:, 3], simulation.w, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(values[:, 4], simulation.y, rtol=1e-12, atol=1e-14)


def test_sample_writes_posterior_json(folder: Path) -> None:
    """Schema, names in the fixed order, every entry a number, units of the model; no checkpoint is left."""
    content = read_json(folder / "posterior" / "posterior.json")
    assert content["schema"] == "bayes-hw/posterior/1"
    assert [name for name in content["parameters"] if name in PARAMETERS] == PARAMETERS
    assert {"velocity_gain", "mode1.cosine", "mode1.sine"} <= set(content["parameters"])
    for name, entry in content["parameters"].items():
        assert set(entry) == ENTRIES, name
        numbers = [*entry["hdi94"], *(entry[key] for key in ENTRIES - {"hdi94", "unit"})]
        assert np.isfinite(numbers).all(), name
        assert entry["hdi94"][0] < entry["median"] < entry["hdi94"][1], name
    units = [content["parameters"][name]["unit"] for name in PARAMETERS]
    assert units == ["deg/s", "deg/s", "deg", "", "Hz", "", "deg"]
    assert content["converged"] is True
    assert content["seconds"] > 0
    assert files_below(folder / "posterior") == {"posterior.json", "posterior.nc"}


def test_predict_writes_its_columns(folder: Path) -> None:
    """The band with noise holds the one without, and about 94 % of the held-out samples."""
    header, values = read_table(folder / "bands.csv")
    assert header[:6] == ["t", "u", "y", "mean", "lo", "hi"]
    y, mean, low, high, low_parameters, high_parameters = values[:, 2:].T
    assert ((low < mean) & (mean < high)).all()
    assert ((low < low_parameters) & (low_parameters <= high_parameters) & (high_parameters < high)).all()
    assert 0.88 < np.mean((low <= y) & (y <= high)) < 0.99


def test_report_writes_everything_and_cleans_up(folder: Path) -> None:
    found = files_below(folder / "azimuth")
    assert found == {"report.html", "report.pdf", "posterior.json", "posterior.nc", "bands_holdout.csv"}
    assert (folder / "azimuth" / "report.pdf").read_bytes().startswith(b"%PDF")
    page = (folder / "azimuth" / "report.html").read_text()
    assert "bayes-hw report train_1.csv train_2.csv --holdout holdout.csv" in page


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_help_answers(command: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"] if command is None else [command, "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert "usage: bayes-hw" in text
    for option in () if command is None else ("--seed", "--jobs", "--quiet", "--out"):
        assert option in text


def test_every_example_is_good_usage() -> None:
    """The help of every command ends with lines that parse, each a call of that command."""
    parser = build_parser()
    (commands,) = (a.choices for a in parser._actions if isinstance(a.choices, dict))
    assert set(COMMANDS) < set(commands)
    for name, command in commands.items():
        lines = command.epilog.removeprefix("example:\n").splitlines()
        assert lines
        for line in lines:
            program, *arguments = shlex.split(line.split(" > ")[0])
            assert (program, arguments[0]) == ("bayes-hw", name)
            parser.parse_args(arguments)
        assert name in (parser.description or ""), f"{name}: not in the manual of --help"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["calibrate"],
        ["sample", "a.csv", "--out", "o"],
        ["identify", "--out", "o"],
        ["identify", "a.csv"],
        ["identify", "a.csv", "--out", "o", "--un\nknown\x1b[31m"],
        ["identify", "a.csv", "--out", "o", "--seed", "one"],
        ["identify", "a.csv", "--out", "o", "--start", "moving"],
        ["sample", "a.csv", "--model", "m", "--out", "o", "--free", "some"],
        ["simulate", "a.csv", "b.csv", "--model", "m", "--out", "o"],
    ],
)
def test_usage_errors_are_one_line(
    arguments: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    (line,) = printed.err.splitlines()
    assert line.startswith("bayes-hw") and "--help" in line and line.isprintable()
    assert files_below(tmp_path) == set()


@pytest.mark.slow
def test_same_seed_same_numbers_whatever_the_jobs(folder: Path, tmp_path: Path) -> None:
    def run(name: str, *more: str) -> dict[str, Any]:
        arguments = sample_arguments(folder, tmp_path / name, *SHORT, "--free", "all", "--quiet", *more)
        assert main(arguments) == 0
        return without_seconds(tmp_path / name / "posterior.json")

    alone = run("alone", "--jobs", "1")
    assert run("threads", "--jobs", "3") == alone
    assert set(PARAMETERS) <= set(alone["parameters"])
    assert run("other", "--seed", "2")["parameters"] != alone["parameters"]


@pytest.mark.slow
def test_quiet_keeps_the_answer_and_otherwise_progress_is_plain_lines(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = sample_arguments(folder, tmp_path, "--walkers", "64", "--target-ess", "500")
    assert main([*arguments, "--quiet"]) == 0
    answer, progress = capsys.readouterr()
    assert progress == "" and "noise.partial" not in answer and "next: " not in answer
    *_, noise, caveat = answer.splitlines()
    assert noise.split()[0] == "noise.sigma" and "would have been taken for dead zone" in caveat
    assert main(arguments) == 0
    printed = capsys.readouterr()
    assert "sampling ..." in printed.err.splitlines()
    assert "\r" not in printed.err and "\x1b" not in printed.err
    said = [line.split()[0] for line in printed.out.splitlines()]
    assert [name for name in said if name in PARAMETERS] == PARAMETERS


@pytest.mark.slow
def test_a_run_too_short_says_so_everywhere(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the file, on stderr (even when quiet), and again by predict; the exit status is 0. Fifty steps would
    do here: ten thousand effective samples are demanded."""
    monkeypatch.setattr("bayes_hw.infer.convergence.ESS_LIMIT", 1e4)
    short = ("--walkers", "32", "--max-steps", "50", "--quiet")
    assert main(sample_arguments(folder, tmp_path / "short", *short)) == 0
    content = read_json(tmp_path / "short" / "posterior.json")
    assert content["converged"] is False and content["problems"]
    assert "NOT CONVERGED: " + content["problems"][0] in capsys.readouterr().err
    record, out = str(folder / "holdout.csv"), str(tmp_path / "bands.csv")
    assert main(["predict", "--posterior", str(tmp_path / "short"), record, "--out", out, "--quiet"]) == 0
    assert "has not converged" in capsys.readouterr().err


@pytest.mark.slow
def test_interrupted_and_resumed_to_the_same_numbers(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Interrupted after 150 steps, between two looks at convergence (125 and 200 steps), when it has
    the effective samples asked for: resumed, it still ends where an undisturbed run does. The seed is the
    first with fewer of them after 125 steps."""

    def run(name: str, *more: str) -> int:
        few = ("--walkers", "32", "--jobs", "1", "--quiet")
        return main([*sample_arguments(folder, tmp_path / name, *few), *more])

    def reached(seed: str, steps: str) -> float:
        assert run("probe", "--seed", seed, "--max-steps", steps, "--target-ess", "1e9") == 0
        probed = read_json(tmp_path / "probe" / "posterior.json")["parameters"].values()
        return min(min(entry["ess_bulk"], entry["ess_tail"]) for entry in probed)

    tried = ((seed, reached(seed, "125"), reached(seed, "150")) for seed in "123456789")
    seed, before, then = next(one for one in tried if one[1] < 0.95 * one[2])
    target = ("--seed", seed, "--target-ess", str(0.5 * (before + then)))
    assert run("whole", *target) == 0
    capsys.readouterr()
    save_block = Checkpoint.save_block

    def interrupted(checkpoint: Checkpoint, number: int, *block: Any) -> None:
        save_block(checkpoint, number, *block)
        if number == 6:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Checkpoint, "save_block", interrupted)
        assert run("parts", *target) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "interrupted" in line and "--resume" in line
    assert run("parts", *target, "--resume") == 0
    whole, parts = (without_seconds(tmp_path / name / "posterior.json") for name in ("whole", "parts"))
    assert parts == whole
    assert whole["steps"] == 200


@pytest.mark.slow
def test_resume_without_a_checkpoint_starts_anew_and_says_so(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(sample_arguments(folder, tmp_path, "--walkers", "64", "--quiet", "--resume")) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert "no checkpoint" in line and "from the beginning" in line


def program(*arguments: str) -> subprocess.Popen[str]:
    """The installed program as a process of its own, its output read as text."""
    installed = Path(sys.executable).with_name("bayes-hw")
    return subprocess.Popen(
        [installed, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def test_installed_program_refuses_in_one_line(tmp_path: Path) -> None:
    """Exit status 2 and no traceback; a file name that would move the cursor is shown by its codes."""
    out = tmp_path / "run.csv"
    given = ("simulate", "--model", "no\nsuch\x1b[2J.json", "r.csv", "--out", str(out))
    process = program(*given)
    printed, complaint = process.communicate(timeout=60)
    assert (process.returncode, printed) == (2, "")
    (line,) = complaint.splitlines()
    assert line.startswith("bayes-hw: error: no such‹U+001B›[2J.json: cannot be read") and line.isprintable()
    assert not out.exists()


def test_ctrl_c_leaves_a_run_that_can_be_resumed(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """SIGINT while sampling: exit status 1, the last line says how to go on, and the blocks written are those
    of a checkpoint. That a resumed run keeps them and ends at the same numbers is shown above. A run killed
    at that moment would leave the posterior of the last run, and whole blocks."""
    checkpoint = tmp_path / "checkpoint"
    last = {name: (folder / "posterior" / name).read_bytes() for name in ("posterior.json", "posterior.nc")}
    for name, content in last.items():
        (tmp_path / name).write_bytes(content)
    seen: list[bool] = []

    def interrupt() -> None:
        wait_for(checkpoint / "block_00002.h5")
        seen.append({name: (tmp_path / name).read_bytes() for name in last} == last)
        for path in list(checkpoint.glob("block_*.h5")):
            with h5py.File(path) as file:
                seen.append(bool(np.isfinite(file["chain"][:]).all()))
        os.kill(os.getpid(), signal.SIGINT)

    options = ("--walkers", "32", "--max-steps", "2000", "--target-ess", "1e9", "--jobs", "1")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    pressed = threading.Thread(target=interrupt)
    pressed.start()
    try:
        assert main(sample_arguments(folder, tmp_path, *options)) == 1
    finally:
        pressed.join()
        signal.signal(signal.SIGINT, before)
    complaint = capsys.readouterr().err
    assert "Traceback" not in complaint
    assert "the same command with --resume goes on" in complaint.splitlines()[-1]
    blocks = len(list(checkpoint.glob("block_*.h5")))
    assert blocks < 80
    assert len(seen) > 2 and all(seen)
    assert {name: (tmp_path / name).read_bytes() for name in last} == last
    assert {path.name for path in checkpoint.iterdir()} >= {"plan.h5", f"block_{blocks:05d}.h5"}


def wait_for(path: Path) -> None:
    """Wait until `path` is written."""
    deadline = time.monotonic() + 120
    while not path.exists():
        assert time.monotonic() < deadline, f"{path} was not written"
        time.sleep(0.02)


@pytest.mark.slow
def test_a_bar_on_a_terminal(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With stderr a terminal, progress is a bar that is redrawn; results stay on stdout."""
    controller, terminal = pty.openpty()
    termios.tcsetwinsize(terminal, (24, 120))
    with os.fdopen(terminal, "w") as screen, monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", screen)
        assert main(sample_arguments(folder, tmp_path, *SHORT, "--jobs", "1")) == 0
        screen.flush()
        shown = os.read(controller, 65536).decode()
    os.close(controller)
    assert "\rsampling:" in shown and "| 50/50" in shown and "R-hat" in shown
    assert capsys.readouterr().out.startswith("saturation.lower")


def test_a_closed_pipe_is_no_traceback(folder: Path, tmp_path: Path) -> None:
    """`bayes-hw ... | true` leaves the results and a silent failure."""
    process = program("convert", str(folder / "train_1.csv"), "--out", str(tmp_path / "record.mat"))
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    complaint = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=120) == 1
    assert "Traceback" not in complaint and "Exception" not in complaint
    assert (tmp_path / "record.mat").stat().st_size > 0


def test_the_package_runs_as_a_module() -> None:
    """For those whose PATH lacks the folder of scripts: the same words as the command's."""
    done = subprocess.run(
        [sys.executable, "-m", "bayes_hw", "--version"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0 and done.stdout.startswith("bayes-hw ")


@pytest.mark.parametrize(
    ("out", "said"),
    [("posterior/posterior.nc", "overwrite"), ("train_1.csv", "overwrite"), ("bands.nc", "a name in .csv")],
)
def test_predict_overwrites_nothing_it_reads(
    folder: Path, capsys: pytest.CaptureFixture[str], out: str, said: str
) -> None:
    before = {path: path.read_bytes() for path in (folder / "posterior").iterdir()}
    paths = {"--posterior": folder / "posterior", "--out": folder / out}
    given = [text for option, path in paths.items() for text in (option, str(path))]
    assert main(["predict", *given, str(folder / "train_1.csv")]) == 2
    assert said in capsys.readouterr().err
    assert {path: path.read_bytes() for path in (folder / "posterior").iterdir()} == before
