"""No damaged file ends in a traceback, a crash, a hang or a gigabyte.

BAYES_HW_FUZZ_SECONDS makes the search longer, BAYES_HW_FUZZ_SEED another one.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from drawn_posterior import posterior_of
from own_process import run_python

from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SECONDS = float(os.environ.get("BAYES_HW_FUZZ_SECONDS", "1"))
LONG_SECONDS = 30.0
SEED = os.environ.get("BAYES_HW_FUZZ_SEED", "1")


@pytest.fixture
def posterior(small_axis: HammersteinWiener, small_record: Record, tmp_path: Path) -> Path:
    """A folder with a small posterior.nc and model.json."""
    posterior_of(small_axis).write(tmp_path / "posterior", [small_record])
    small_axis.write(tmp_path / "posterior" / "model.json")
    return tmp_path / "posterior"


@pytest.mark.timeout(SECONDS + LONG_SECONDS + 120)
@pytest.mark.parametrize("seconds", [SECONDS, LONG_SECONDS])
@pytest.mark.slow
def test_damaged_files_are_read_or_refused(posterior: Path, tmp_path: Path, seconds: float) -> None:
    """Every reader: CSV, MATLAB vectors, iddata, idnlhw, HDF5, MATLAB 7.3, Parquet, posterior, the JSON of
    models, controllers and cases."""
    work = tmp_path / "fuzz"
    work.mkdir()
    script = Path(__file__).with_name("fuzz.py")
    done = run_python(script, seconds, SEED, work, posterior)
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["peak_mb"] < 1024
    assert len(found["counts"]) == 17
    for name, counts in found["counts"].items():
        assert counts["refused"] >= 1, name
