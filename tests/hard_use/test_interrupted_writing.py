"""A full disk or a killed process leaves the last good state of every kind of file."""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_files import write_axis
from numba.core.caching import Cache
from short_sampling import sample_shortly

from bayes_hw.cli import main
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

WRITE = """
import sys
from pathlib import Path
from bayes_hw.files import write_text_atomically
number = 0
while True:
    number += 1
    write_text_atomically(Path(sys.argv[1]), str(number % 10) * 4_000_000)
"""


@contextmanager
def room(size: int) -> Iterator[None]:
    """Files have room for so many bytes.

    What numba compiles is not written: whether its cache holds the kernels depends on what ran before and
    what runs beside, and a kernel that finds no room would be the first to fail.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Cache, "save_overload", lambda *_: None)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Records, a model, a posterior and a report, in the working folder."""
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        folder = write_axis(tmp_path_factory.mktemp("full"), small_axis)
        patch.chdir(folder)
        assert main(sampling()) == 0
        yield folder


def sampling(*more: str) -> list[str]:
    model = ("--model", "model/model.json")
    short = ("--walkers", "32", "--max-steps", "50", "--quiet")
    return ["sample", *model, "train_1.csv", "--out", "posterior", *short, *more]


@pytest.mark.slow
@pytest.mark.parametrize("size", [60_000, 300_000])
def test_sampling_on_a_full_disk_keeps_the_last_posterior(
    folder: Path, size: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whether there is room for a checkpoint or not: status 1, one line with the remedy, no crash of HDF5,
    the posterior of the last run whole."""
    files = {path: path.read_bytes() for path in (folder / "posterior").glob("posterior.*")}
    with room(size):
        assert main(sampling("--seed", "2")) == 1
    complaint = capsys.readouterr().err
    *_, line = complaint.splitlines()
    assert "Traceback" not in complaint
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
    assert capfd.readouterr().out == f"{out}: 400 samples at 20 Hz\n"
    with room(1000):
        assert main(["convert", "train_2.csv", "--out", out, "--quiet"]) == 1
    printed = capfd.readouterr()
    assert len(printed.err.splitlines()) == 1
    assert (folder / out).read_bytes() == good
    assert printed.out == ""


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
