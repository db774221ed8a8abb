"""Records: what they refuse to hold, and what their parts keep."""

import dataclasses

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.record import Record, Units


@pytest.fixture
def record() -> Record:
    k = np.arange(200)
    return Record("axis", 5 + k / 20, np.sin(k), np.cos(k), 20.0, Units(), "a.csv", "digest", ("x",))


def test_columns_become_float_arrays_of_one_length(record):
    whole = dataclasses.replace(record, u=[1] * 200)
    assert whole.u.dtype == np.float64
    with pytest.raises(InputError, match="axis: y has shape"):
        dataclasses.replace(record, y=record.y[:-1])


@pytest.mark.parametrize("column", ["t", "u", "y"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(record, column, value):
    values = getattr(record, column).copy()
    values[7] = value
    with pytest.raises(InputError, match=f"axis: {column} holds NaN or inf"):
        dataclasses.replace(record, **{column: values})


@pytest.mark.parametrize("rate_hz", [0.0, -20.0, np.nan, np.inf])
def test_a_sample_rate_that_is_none_is_refused(record, rate_hz):
    with pytest.raises(InputError, match="sample rate"):
        dataclasses.replace(record, sample_rate_hz=rate_hz)


def test_a_window_is_half_open_in_seconds_after_the_first_sample(record):
    part = record.window(1.0, 2.5)
    np.testing.assert_array_equal(part.t, record.t[20:50])
    np.testing.assert_array_equal(part.u, record.u[20:50])
    np.testing.assert_array_equal(part.y, record.y[20:50])
    assert part.name == "axis_1-2.5s"
    assert part.treatment == ("x", "cut to 1 s to 2.5 s after the first sample")
    assert (part.source, part.sha256) == ("a.csv", "digest")


def test_windows_that_touch_share_no_sample_and_lose_none(record):
    for cut in (0.05, 0.1, 0.15, 3.3333, 9.95):
        parts = record.window(0, cut), record.window(cut, np.inf)
        np.testing.assert_array_equal(np.concatenate([p.t for p in parts]), record.t)


@pytest.mark.parametrize("limits", [(2, 1), (1, 1), (10, 20), (-5, 0), (np.nan, np.nan)])
def test_an_empty_window_is_refused_with_the_length_of_the_record(record, limits):
    with pytest.raises(InputError, match="lasts 10 s"):
        record.window(*limits)


def test_a_split_keeps_every_sample_once(record):
    first, second = record.split(0.7)
    assert (len(first), len(second)) == (140, 60)
    np.testing.assert_array_equal(np.concatenate([first.y, second.y]), record.y)
    assert first.name != second.name


@pytest.mark.parametrize("fraction", [0.0, 1.0, -0.1, np.nan, 1e-6])
def test_a_split_with_an_empty_part_is_refused(record, fraction):
    with pytest.raises(InputError, match="axis"):
        record.split(fraction)


@pytest.mark.parametrize(
    ("units", "complaint"),
    [
        ([], "must be an object"),
        ({"inputs": "V"}, "unknown key 'inputs'"),
        ({"input": 3}, "units.input: must be text"),
        ({"time": "ms"}, "give times in s"),
    ],
)
def test_wrong_units_are_refused_with_the_key(units, complaint):
    with pytest.raises(InputError, match=complaint):
        Units.from_dict(units)


def test_units_survive_a_round_trip():
    units = Units(input="V", output="m")
    assert Units.from_dict(units.to_dict()) == units


@pytest.mark.parametrize("text", ["de\0g", "\ud800"])
def test_a_unit_that_no_file_can_hold_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"units\.output"):
        Units.from_dict({"output": text})


@pytest.mark.parametrize(("units", "gain"), [
    (Units(), "(deg/s)/(deg/s)"),
    (Units(input="V", output="m"), "(m/s)/V"),
    (Units(input="m/s^2", output="rad"), "(rad/s)/(m/s^2)"),
])  # fmt: skip
def test_unit_of_the_velocity_gain(units: Units, gain: str) -> None:
    assert units.velocity_gain == gain


def test_unmeasured_samples_go_with_every_part(record):
    measured = np.arange(200) % 7 != 3
    known = {"wind": np.arange(200.0)}
    holed = dataclasses.replace(record, measured=measured, known=known, known_units={"wind": "m/s"})
    part = holed.window(1.0, 2.5)
    np.testing.assert_array_equal(part.measured, measured[20:50])
    np.testing.assert_array_equal(part.known["wind"], np.arange(20.0, 50.0))
    first, rest = holed.split(0.5)
    np.testing.assert_array_equal(np.concatenate([first.measured, rest.measured]), measured)
    assert holed.window(0.0, 0.15).measured is None
    np.testing.assert_array_equal(np.isnan(holed.y_or_nan), ~measured)
    np.testing.assert_array_equal(holed.measured_samples, measured)


def test_a_resampled_hole_stays_a_hole(record):
    """A new sample between two old ones is measured where both were."""
    measured = np.ones(200, dtype=bool)
    measured[100] = False
    finer = dataclasses.replace(record, measured=measured).resampled(40.0)
    np.testing.assert_array_equal(np.flatnonzero(~finer.measured_samples), [199, 200, 201])
    coarser = dataclasses.replace(record, measured=measured, known={"w": np.arange(200.0)}).resampled(10.0)
    np.testing.assert_array_equal(np.flatnonzero(~coarser.measured_samples), [50])
    np.testing.assert_allclose(coarser.known["w"], 2 * np.arange(100.0), atol=1e-9)


@pytest.mark.parametrize("measured", [np.ones(199, dtype=bool), np.ones(200)])
def test_a_mask_of_another_shape_or_type_is_refused(record, measured):
    with pytest.raises(InputError, match="True or False for every sample"):
        dataclasses.replace(record, measured=measured)


def test_a_command_alone_has_no_output_to_write(record, tmp_path):
    alone = dataclasses.replace(record, measured=np.zeros(200, dtype=bool), y=np.zeros(200))
    assert not alone.has_output and record.has_output
    alone.write(tmp_path / "command.csv")
    assert (tmp_path / "command.csv").read_text().splitlines()[0] == "t,u"


def test_unmeasured_samples_are_written_as_empty_cells(record, tmp_path):
    measured = np.ones(200, dtype=bool)
    measured[[5, 9]] = False
    dataclasses.replace(record, measured=measured).write(tmp_path / "holed.csv")
    lines = (tmp_path / "holed.csv").read_text().splitlines()
    assert [number for number, line in enumerate(lines) if line.endswith(",")] == [6, 10]


def test_the_angle_that_was_measured_is_converted_with_its_origin() -> None:
    record = Record.from_arrays(np.arange(4) / 10, np.ones(4), np.arange(4.0))
    found = dataclasses.replace(record, origin=134.0).converted(Units(output="arcsec"))
    np.testing.assert_allclose(found.columns()["y"], 3600 * (np.arange(4.0) + 134.0))
