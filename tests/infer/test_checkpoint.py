"""An interrupted run goes on to the very numbers of an undisturbed one; a wrong checkpoint is refused."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from targets import Gaussian

from bayes_hw.errors import InputError
from bayes_hw.infer.checkpoint import Checkpoint, fingerprint
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample

SETTINGS = SamplerSettings(ensembles=2, walkers=16, block=20, max_steps=120, target_ess=1e9)


class Interrupted:
    """Makes Gaussian densities of which the first raises KeyboardInterrupt at call `at`."""

    def __init__(self, at: int | None) -> None:
        self.at = at

    def __call__(self) -> Gaussian:
        target = Gaussian(3)
        target.interrupt_at, self.at = self.at, None
        return target


def run(
    checkpoint: Checkpoint | None, *, interrupt_at: int | None = None, resume: bool = False, jobs: int = 1
) -> Sampling:
    target = Gaussian(3)
    return sample(
        Interrupted(interrupt_at),
        target.mean,
        target.covariance,
        np.random.default_rng(5),
        settings=SETTINGS,
        jobs=jobs,
        checkpoint=checkpoint,
        resume=resume,
    )


@pytest.fixture(scope="module")
def undisturbed() -> Sampling:
    return run(None)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The checkpoint of a finished run, fingerprint "a"."""
    folder = tmp_path_factory.mktemp("finished")
    run(Checkpoint(folder, "a"))
    return folder


def assert_same(found: Sampling, expected: Sampling) -> None:
    np.testing.assert_array_equal(found.chain, expected.chain)
    np.testing.assert_array_equal(found.log_probability, expected.log_probability)
    np.testing.assert_array_equal(found.acceptance, expected.acceptance)
    np.testing.assert_array_equal(found.convergence.r_hat, expected.convergence.r_hat)


def test_keeping_a_checkpoint_changes_nothing(tmp_path: Path, undisturbed: Sampling) -> None:
    folder = tmp_path / "new" / "folder"
    assert_same(run(Checkpoint(folder, "a")), undisturbed)
    assert len(list(folder.glob("block_*.h5"))) == 6


@pytest.mark.parametrize(
    ("interrupt_at", "jobs"),
    [(15, 1), pytest.param(70, 2, marks=pytest.mark.slow), pytest.param(150, 1, marks=pytest.mark.slow)],
)
def test_interrupted_and_resumed_to_the_same_bits(
    tmp_path: Path, undisturbed: Sampling, interrupt_at: int, jobs: int
) -> None:
    """Ctrl-C in the pilot, early and late in the run; twice in a row; with one job or two."""
    with pytest.raises(KeyboardInterrupt):
        run(Checkpoint(tmp_path, "a"), interrupt_at=interrupt_at)
    with pytest.raises(KeyboardInterrupt):
        run(Checkpoint(tmp_path, "a"), interrupt_at=5, resume=True)
    assert_same(run(Checkpoint(tmp_path, "a"), resume=True, jobs=jobs), undisturbed)
    assert not list(tmp_path.glob(".*")), "a temporary file is left"


def test_resuming_a_finished_run_gives_it_again(finished: Path, undisturbed: Sampling) -> None:
    assert_same(run(Checkpoint(finished, "a"), resume=True), undisturbed)


@pytest.mark.slow
def test_killed_and_resumed_to_the_same_bits(tmp_path: Path, undisturbed: Sampling) -> None:
    """kill -9 of a process in the middle of its run."""
    script = (
        "import sys; from pathlib import Path; import numpy as np\n"
        "from bayes_hw.infer.checkpoint import Checkpoint; from bayes_hw.infer.sampler import *\n"
        "from targets import Gaussian\n"
        "def slow():\n"
        "    target = Gaussian(3); target.delay_s = 0.001; return target\n"
        "t = Gaussian(3)\n"
        "settings = SamplerSettings(ensembles=2, walkers=16, block=20, max_steps=120, target_ess=1e9)\n"
        "sample(slow, t.mean, t.covariance, np.random.default_rng(5), settings=settings,\n"
        "       checkpoint=Checkpoint(Path(sys.argv[1]), 'a'))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent), "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], env=environment)
    deadline = time.monotonic() + 60
    while not (tmp_path / "block_00002.h5").exists():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.002)
    process.kill()
    assert process.wait() != 0
    assert not (tmp_path / "block_00006.h5").exists()
    assert_same(run(Checkpoint(tmp_path, "a"), resume=True), undisturbed)


@pytest.mark.slow
def test_without_resume_an_old_checkpoint_is_replaced(tmp_path: Path, undisturbed: Sampling) -> None:
    """Blocks of an earlier run do not leak into this one, and strangers' files stay."""
    run(Checkpoint(tmp_path, "old"))
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(KeyboardInterrupt):
        run(Checkpoint(tmp_path, "new"), interrupt_at=80)
    assert_same(run(Checkpoint(tmp_path, "new"), resume=True), undisturbed)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_resuming_without_a_checkpoint_starts_afresh(tmp_path: Path, undisturbed: Sampling) -> None:
    assert Checkpoint(tmp_path / "none", "a").load() is None
    assert_same(run(Checkpoint(tmp_path / "none", "a"), resume=True), undisturbed)


def test_foreign_checkpoint_is_refused(finished: Path) -> None:
    with pytest.raises(InputError, match=r"plan\.h5: the checkpoint belongs to another run"):
        run(Checkpoint(finished, "b"), resume=True)


@pytest.mark.parametrize("name", ["plan.h5", "block_00002.h5"])
@pytest.mark.parametrize(
    "damage", ["truncated", pytest.param("text", marks=pytest.mark.slow), "without data", "foreign HDF5"]
)
def test_damaged_checkpoint_is_refused(finished: Path, tmp_path: Path, name: str, damage: str) -> None:
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    path = tmp_path / name
    if damage == "truncated":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif damage == "text":
        path.write_text("not HDF5")
    else:
        with h5py.File(path, "a" if damage == "without data" else "w") as file:
            for key in list(file):
                del file[key]
    with pytest.raises(InputError, match=name) as caught:
        run(Checkpoint(tmp_path, "a"), resume=True)
    assert "\n" not in str(caught.value) and "--resume" in str(caught.value)


def test_fingerprint_tells_parts_apart() -> None:
    assert fingerprint("a", "b") == fingerprint("a", "b")
    assert (
        len({fingerprint("a", "b"), fingerprint("ab"), fingerprint("b", "a"), fingerprint("a", "b", "")}) == 4
    )


@pytest.mark.parametrize(
    "seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)]
)
def test_a_checkpoint_of_any_bytes_is_resumed_or_refused(finished: Path, tmp_path: Path, seed: int) -> None:
    """The HDF5 library can crash on a damaged file: it is tried in another process first."""
    copied = Path(shutil.copytree(finished, tmp_path / "copy"))
    rng = np.random.default_rng(seed)
    content = bytearray((copied / "plan.h5").read_bytes())
    for position in rng.integers(len(content), size=20):
        content[position] = rng.integers(256)
    (copied / "plan.h5").write_bytes(content)
    with suppress(InputError):
        Checkpoint(copied, "a").load()
