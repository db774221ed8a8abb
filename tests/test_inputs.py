"""Records as the options of the commands ask for them."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest

from bayes_hw.commands.inputs import read_records
from bayes_hw.commands.options import add_record_options
from bayes_hw.errors import InputError
from bayes_hw.record import Record, Units

T = np.arange(50) / 20
RADIANS = Units(input="rad/s", output="rad")


@pytest.fixture
def paths(tmp_path: Path) -> dict[str, str]:
    """Records that state radians and degrees, and one that states nothing."""
    for name, units in (("radians.h5", RADIANS), ("degrees.h5", Units()), ("plain.csv", Units())):
        Record(name, T, np.sin(T), np.cos(T), 20.0, units).write(tmp_path / name)
    return {path.stem: str(path) for path in tmp_path.iterdir()}


def parsed(*options: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_record_options(parser)
    return parser.parse_args(list(options))


def test_the_units_that_a_file_states_hold_for_those_after_it(paths: dict[str, str]) -> None:
    first, second = read_records(parsed(), [paths["radians"], paths["plain"]])
    assert first.units == second.units == RADIANS
    (alone,) = read_records(parsed("--output-unit", "arcsec"), [paths["plain"]])
    assert alone.units == Units(output="arcsec")


@pytest.mark.parametrize(("options", "names", "units"), [
    ((), ("radians", "degrees"), None),
    (("--output-unit", "deg"), ("radians",), None),
    ((), ("radians",), Units()),
    (("--output-unit", "rad"), ("plain",), Units()),
])  # fmt: skip
def test_units_that_differ_are_refused(
    paths: dict[str, str], options: tuple[str, ...], names: tuple[str, ...], units: Units | None
) -> None:
    """Of two records, of a record and an option or a model, of an option and a model."""
    with pytest.raises(InputError, match=r"convert the record|in the model's unit"):
        read_records(parsed(*options), [paths[name] for name in names], units)
