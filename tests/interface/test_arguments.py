"""Arguments of the interface that are no good are refused in one line that says what to give."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

import bayes_hw
from bayes_hw.errors import InputError
from bayes_hw.interface.arguments import generator, records_given, struck, threads
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units

T = np.arange(100) / 20
RECORD = Record("axis", T, np.sin(T), np.cos(T), 20.0, Units())


def test_what_is_as_good_as_asked_for() -> None:
    """One record for several, one label for several, a seed of numpy's."""
    assert records_given(RECORD) == records_given([RECORD]) == (RECORD,)
    assert struck("friction") == struck(["friction"]) == {"friction"}
    assert generator(np.int64(3)).integers(99) == np.random.default_rng(3).integers(99)
    assert threads(2) == 2 and threads(None) >= 1


@pytest.mark.parametrize(("arguments", "options", "said"), [
    (([],), {}, "records: is empty"),
    ((["axis.csv"],), {}, "records: holds a str; give Record.read(path)"),
    (("axis.csv",), {}, "records: is of type str; give Record.read(path)"),
    ((pd.DataFrame({"t": T}),), {}, "records: is of type DataFrame; give Record.from_dataframe(table)"),
    ((T,), {}, "records: is of type ndarray; give Record.from_arrays(t, u, y)"),
    ((7,), {}, "records: is of type int; give what Record.read or Record.from_arrays returns"),
    ((RECORD,), {"seed": -1}, "seed: is -1; give a whole number"),
    ((RECORD,), {"seed": 1.5}, "seed: is 1.5"),
    ((RECORD,), {"start": "soon"}, "start='soon': unknown; use one of auto, rest, free"),
])  # fmt: skip
def test_identify_refuses(arguments: tuple[Any, ...], options: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        bayes_hw.identify(*arguments, **options)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(("changes", "said"), [
    ({"model": 3.0}, "model: is of type float; give a HammersteinWiener"),
    ({"model": "axis.xml"}, "axis.xml: is not there; give `simulator` an MJCF, URDF or FMU file"),
    ({"train": []}, "train: is empty"),
    ({"holdout": [1.0]}, "holdout: holds a float"),
    ({"without": ["bakclash"]}, "without: 'bakclash' is not in the catalogue; use one of"),
    ({"without": "bakclash"}, "without: 'bakclash' is not in the catalogue; use one of"),
    ({"jobs": 0}, "jobs: is 0; give a whole number, 1 or more"),
    ({"seed": True}, "seed: is True"),
])  # fmt: skip
def test_diagnose_refuses(small_axis: HammersteinWiener, changes: dict[str, Any], said: str) -> None:
    record = Record("axis", T, np.sin(T), np.cos(T), small_axis.sample_rate_hz, small_axis.units)
    given = {"model": small_axis, "train": record, "holdout": record} | changes
    with pytest.raises(InputError) as caught:
        bayes_hw.diagnose(**given)
    assert str(caught.value).startswith(said)


def test_sample_refuses_what_is_no_model() -> None:
    with pytest.raises(InputError, match=r"model: is of type Record; give a HammersteinWiener"):
        bayes_hw.sample(RECORD, RECORD)  # type: ignore[arg-type]
