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


@pytest.mark.parametrize(("options", "name", "units", "factor"), [
    ((), "radians", Units(), 180 / np.pi),
    (("--output-unit", "deg", "--input-unit", "deg/s"), "radians", None, 180 / np.pi),
    (("--output-unit", "rad", "--input-unit", "rad/s"), "plain", Units(), 180 / np.pi),
    ((), "plain", RADIANS, 1.0),
])  # fmt: skip
def test_units_that_differ_are_converted(
    paths: dict[str, str], options: tuple[str, ...], name: str, units: Units | None, factor: float
) -> None:
    """To those of the model, or of the options; what nobody states is in the model's."""
    (record,) = read_records(parsed(*options, "--accept", "scale"), [paths[name]], units)
    np.testing.assert_allclose(record.y, factor * np.cos(T), rtol=1e-12)
    assert record.units == (units or Units())


def test_records_after_the_first_are_in_its_units(paths: dict[str, str]) -> None:
    first, second = read_records(parsed(), [paths["radians"], paths["degrees"]])
    assert first.units == second.units == RADIANS
    np.testing.assert_allclose(second.y, np.radians(np.cos(T)), rtol=1e-12)


def test_units_of_something_else_are_refused(paths: dict[str, str]) -> None:
    with pytest.raises(InputError, match=r"convert the record"):
        read_records(parsed(), [paths["radians"]], Units(output="V"))
