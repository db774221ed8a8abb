"""A file is tried in another process, which runs nothing of the folder that it happens to be in."""

from __future__ import annotations

import os
import subprocess
import sys
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from own_process import run_python

from bayes_hw.formats import hdf5_probe
from bayes_hw.formats.hdf5_probe import is_sound_hdf5


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    path = tmp_path / "sound.h5"
    with h5py.File(path, "w") as file:
        file["y"] = np.arange(5.0)
    return path


def test_no_module_of_the_working_folder_is_run(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A record is data: an h5py.py beside it is not a library."""
    for name in ("h5py", "numpy", "bayes_hw"):
        (tmp_path / f"{name}.py").write_text("open('EXECUTED', 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    assert is_sound_hdf5(sound)
    assert not (tmp_path / "EXECUTED").exists()


def test_all_of_several_files_must_be_sound(sound: Path, tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.h5"
    damaged.write_bytes(sound.read_bytes()[:-200])
    assert is_sound_hdf5(sound, sound)
    assert not is_sound_hdf5(sound, damaged)


@pytest.mark.slow
def test_a_machine_that_is_busy_with_other_things_damages_no_file(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that stands still for longer than a file of this size may take of the processor."""
    (tmp_path / "sitecustomize.py").write_text("import time\ntime.sleep(1.5)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(hdf5_probe, "PROBE_SECONDS", 1.0)
    assert is_sound_hdf5(sound)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limit of processor time there")
def test_a_library_that_loops_is_ended(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After the seconds of the processor that it may take, not after the patience of the clock."""
    (tmp_path / "h5py.py").write_text("while True:\n    pass\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(hdf5_probe, "PROBE_SECONDS", 1.0)
    before = os.times()
    assert not is_sound_hdf5(sound)
    after = os.times()
    assert 0.5 < after.children_user - before.children_user < 3.0


def with_chunk(path: Path, chunk: bytes) -> Path:
    """A sound data set y, and a data set bad of 1000 numbers whose only chunk holds these bytes."""
    with h5py.File(path, "w") as file:
        file["y"] = np.arange(5.0)
        bad = file.create_dataset("bad", (1000,), "f8", chunks=(1000,), compression="gzip")
        bad.id.write_direct_chunk((0,), chunk)
    return path


def test_what_nobody_asks_for_is_not_read(tmp_path: Path) -> None:
    """So a large file is as soon tried as the record in it; names with a point are found either way."""
    path = with_chunk(tmp_path / "bad.h5", b"no deflated numbers")
    assert not is_sound_hdf5(path)
    assert is_sound_hdf5(path, only=["y", "absent", "bad.y"])
    assert not is_sound_hdf5(path, only=["y", "bad"])
    with h5py.File(tmp_path / "grouped.h5", "w") as file, h5py.File(path, "r") as bad:
        bad.copy("bad", file.create_group("axis"))
    assert not is_sound_hdf5(tmp_path / "grouped.h5", only=["axis.bad"])
    assert not is_sound_hdf5(tmp_path / "grouped.h5", only=["/axis/bad"])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited by what Linux counts")
def test_a_chunk_that_inflates_without_end_is_given_no_more_than_a_gigabyte(tmp_path: Path) -> None:
    """8 kB are stated, 1.5 GB would come out."""
    deflater, zeros = zlib.compressobj(1), bytes(2**24)
    head, again = (deflater.compress(zeros) + deflater.flush(zlib.Z_FULL_FLUSH) for _ in range(2))
    chunk = head + 95 * again + deflater.flush()
    path = with_chunk(tmp_path / "bomb.h5", chunk)
    code = (
        "import resource, sys; from pathlib import Path;"
        "from bayes_hw.formats.hdf5_probe import is_sound_hdf5;"
        "sound = is_sound_hdf5(Path(sys.argv[1]));"
        "print(sound, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = run_python("-c", code, path, check=True)
    sound, kilobytes = done.stdout.split()
    assert sound == "False"
    assert int(kilobytes) * 1024 < 1e9


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited by what Linux counts")
def test_a_sound_file_is_read_where_the_system_grants_less_memory(sound: Path) -> None:
    """As under `ulimit -v`: the limit stands, and is no fault of the file."""
    code = (
        "import resource, sys; from pathlib import Path;"
        "from bayes_hw.formats.hdf5_probe import is_sound_hdf5;"
        "resource.setrlimit(resource.RLIMIT_AS, (3 * 2**29, 3 * 2**29));"
        "print(is_sound_hdf5(Path(sys.argv[1])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(sound)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "True"
