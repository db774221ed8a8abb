"""Structures of a MATLAB file are read together within one limit of memory."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from bayes_hw.errors import InputError
from bayes_hw.formats import matlab_structures
from bayes_hw.formats.matlab_structures import read_structures

LIMIT = 2**20


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Eight structures of 400 kB each, which deflate to almost nothing."""
    path = tmp_path / "many.mat"
    content = {f"s{i}": {"y": np.full(50_000, float(i))} for i in range(8)}
    scipy.io.savemat(path, content, do_compression=True)
    return path


def test_all_structures_with_their_fields(file: Path) -> None:
    found = read_structures(file)
    assert [structure.name for structure in found] == [f"s{i}" for i in range(8)]
    np.testing.assert_array_equal(np.ravel(found[3].value("y", 50_000)), np.full(50_000, 3.0))


def test_structures_that_take_too_much_together_are_refused_before_they_are_inflated(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each alone is within the limit."""
    monkeypatch.setattr(matlab_structures, "MOST_BYTES", LIMIT)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"'s2' takes 0 MB, with the structures before it more than"):
            read_structures(file)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 1.5 * LIMIT
