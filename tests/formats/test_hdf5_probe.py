"""A file is tried in another process, which runs nothing of the folder that it happens to be in."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

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
