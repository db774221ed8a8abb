"""An output folder belongs to one process at a time, and is left as it was found."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from command_files import write_axis

from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.folder_claim import claimed_folder
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

HOLD = """
import sys, time
from pathlib import Path
from bayes_hw.folder_claim import claimed_folder
with claimed_folder(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def other(tmp_path: Path) -> subprocess.Popen[str]:
    """Another process that holds tmp_path / "out"."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "out")], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stdout.readline() == "held\n"
    return process


def test_two_processes_are_told_apart(
    other: subprocess.Popen[str],
    tmp_path: Path,
    small_axis: HammersteinWiener,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A command refuses the folder that another holds, writes nothing, and takes it once that was killed."""
    folder = write_axis(tmp_path, small_axis)
    command = ["identify", str(folder / "train_1.csv"), "--out", str(tmp_path / "out"), "--quiet"]
    assert main(command) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "out: another bayes-hw is writing there; wait until it ends, or give another --out" in line
    assert list((tmp_path / "out").iterdir()) == []
    other.send_signal(signal.SIGKILL)
    other.communicate(timeout=20)
    assert main(command) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"model.json", "fit.json"}


def test_a_folder_made_in_vain_is_removed_and_one_with_results_kept(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing"), claimed_folder(tmp_path / "a" / "b"):
        raise InputError("nothing to write")
    assert list(tmp_path.iterdir()) == []
    with claimed_folder(tmp_path / "a" / "b"):
        (tmp_path / "a" / "b" / "x").write_text("")
    with claimed_folder(tmp_path / "a" / "b"), claimed_folder(tmp_path / "a" / "c"):
        pass
    assert sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*")) == ["a", "a/b", "a/b/x"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir(mode=0o555)
    with (
        pytest.raises(InputError, match="no permission to write there; give another --out"),
        claimed_folder(tmp_path / "out"),
    ):
        pass


def test_a_folder_without_permission_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As above for those whom the system lets write everywhere."""
    monkeypatch.setattr(os, "access", lambda *_: False)
    with (
        pytest.raises(InputError, match="no permission to write there; give another --out"),
        claimed_folder(tmp_path / "out"),
    ):
        pass
    assert list(tmp_path.iterdir()) == []
