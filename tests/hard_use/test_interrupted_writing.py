"""A full disk or a killed process leaves the last good state of every kind of file."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_files import write_axis

from bayes_hw.cli import main
from bayes_hw.infer import pilot
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

FULL = """
import resource, sys
from bayes_hw.cli import main
from bayes_hw.infer import pilot
from numba.core.caching import Cache
Cache.save_overload = lambda *ignored: None
pilot.PILOT_STEPS, pilot.TRIAL_PROPOSALS = 20, 256
_, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), hard))
sys.exit(main(sys.argv[2:]))
"""
"""The command line with room for files of so many bytes.

What numba compiles is not written: whether its cache holds the kernels depends on what ran before and what
runs beside, and a kernel that finds no room would be the first to fail.
"""

WRITE = """
import sys
from pathlib import Path
from bayes_hw.files import write_text_atomically
number = 0
while True:
    number += 1
    write_text_atomically(Path(sys.argv[1]), str(number % 10) * 4_000_000)
"""


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Records, a model, a posterior and a report, in the working folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pilot, "PILOT_STEPS", 20)
        patch.setattr(pilot, "TRIAL_PROPOSALS", 256)
        folder = write_axis(tmp_path_factory.mktemp("full"), small_axis)
        patch.chdir(folder)
        assert main(sampling()) == 0
        yield folder


def sampling(*more: str) -> list[str]:
    model = ("--model", "model/model.json")
    short = ("--walkers", "32", "--max-steps", "50", "--quiet")
    return ["sample", *model, "train_1.csv", "--out", "posterior", *short, *more]


@pytest.mark.parametrize("room", [pytest.param(60_000, marks=pytest.mark.slow), 300_000])
def test_sampling_on_a_full_disk_keeps_the_last_posterior(folder: Path, room: int) -> None:
    """Whether there is room for a checkpoint or not: status 1, one line with the remedy, no crash of HDF5,
    the posterior of the last run whole."""
    files = {path: path.read_bytes() for path in (folder / "posterior").glob("posterior.*")}
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(room), *sampling("--seed", "2")],
        capture_output=True,
        text=True,
        timeout=120,
    )
    *_, line = done.stderr.splitlines()
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "File too large" in line and "posterior" in line and "that file is as before" in line
    assert {path: path.read_bytes() for path in files} == files
    assert not list(folder.rglob(".posterior*"))
    Posterior.read(folder / "posterior")


@pytest.mark.parametrize("ending", [".mat", ".h5"])
def test_converting_on_a_full_disk_keeps_the_last_record(
    folder: Path, ending: str, capfd: pytest.CaptureFixture[str]
) -> None:
    out = f"converted{ending}"
    assert main(["convert", "train_1.csv", "--out", out, "--quiet"]) == 0
    good = (folder / out).read_bytes()
    command = [sys.executable, "-c", FULL, "1000", "convert", "train_2.csv", "--out", out, "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert (folder / out).read_bytes() == good
    assert done.stdout == ""
    assert capfd.readouterr().out == f"{out}: 400 samples at 20 Hz\n"


def test_a_killed_process_leaves_a_whole_file(tmp_path: Path) -> None:
    """Killed at three moments while it writes four megabytes over and over: the file is one of them."""
    path = tmp_path / "result.json"
    for wait_s in (0.05, 0.11, 0.17):
        process = subprocess.Popen([sys.executable, "-c", WRITE, str(path)])
        deadline = time.monotonic() + 30
        while not path.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(wait_s)
        process.kill()
        process.wait(timeout=30)
        text = path.read_text()
        assert text == text[0] * 4_000_000


def test_a_killed_run_leaves_the_last_posterior(folder: Path) -> None:
    """SIGKILL between two blocks: the posterior of the last run is whole, and so is every block written."""
    more = ("--max-steps", "5000", "--target-ess", "1e9", "--seed", "3", "--jobs", "1")
    before = json.loads((folder / "posterior" / "posterior.json").read_text())
    process = subprocess.Popen([sys.executable, "-c", FULL, str(2**40), *sampling(*more)])
    checkpoint = folder / "posterior" / "checkpoint"
    deadline = time.monotonic() + 60
    while not (checkpoint / "block_00003.h5").exists():
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait(timeout=30)
    assert json.loads((folder / "posterior" / "posterior.json").read_text()) == before
    for path in checkpoint.glob("block_*.h5"):
        with h5py.File(path) as file:
            assert np.isfinite(file["chain"][:]).all()
