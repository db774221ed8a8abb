"""HDF5 files appear whole or not at all."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from bayes_hw.formats.hdf5_output import hdf5_written_atomically


def test_a_file_is_there_when_the_block_ends_and_not_before(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.h5"
    with hdf5_written_atomically(path) as file:
        file["x"] = np.arange(5)
        assert not path.exists()
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["x"], np.arange(5))


def test_an_error_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with hdf5_written_atomically(path) as file:
        file["x"] = 1
    good = path.read_bytes()
    with pytest.raises(KeyboardInterrupt), hdf5_written_atomically(path) as file:
        file["x"] = 2
        raise KeyboardInterrupt
    assert path.read_bytes() == good
    assert list(tmp_path.iterdir()) == [path]
