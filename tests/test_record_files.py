"""Files to records: what is refused, in one line with the remedy, and what is said of the rest."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.record import Columns, ReadingOptions, Record, Units
from bayes_hw.record_files import FEWEST_SAMPLES

SHARED = Path(__file__).resolve().parents[2] / "shared"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason=f"the measured records are not at {SHARED}")

files_from_hypothesis = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def write_csv(path: Path, t, u, y, header: str = "t,u,y") -> Path:
    rows = zip(t, u, y, strict=True)
    cells = "".join(f"{float(a)!r},{float(b)!r},{float(c)!r}\n" for a, b, c in rows)
    path.write_text(f"{header}\n{cells}")
    return path


def columns(samples: int = 100, rate_hz: float = 20.0):
    t = np.round(np.arange(samples) / rate_hz, 6)
    return t, np.sin(t), np.cos(t)


def refusal(path: Path, **options) -> str:
    with pytest.raises(InputError) as caught:
        Record.read(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


finite = st.floats(-1e12, 1e12)


@files_from_hypothesis
@given(
    data=st.data(),
    samples=st.integers(FEWEST_SAMPLES, 60),
    rate_hz=st.sampled_from([10.0, 12.5, 20.0, 50.0, 1000.0]),
    start=st.sampled_from([0.0, -3.0, 1_685_543_398.0]),
)
def test_every_finite_record_survives_a_round_trip_through_csv(tmp_path, data, samples, rate_hz, start):
    u, y = (np.array(data.draw(st.lists(finite, min_size=samples, max_size=samples))) for _ in "uy")
    t = start + np.arange(samples) / rate_hz
    u[:2] = y[:2] = 0.0, 1.0
    record = Record.read(write_csv(tmp_path / "axis.csv", t, u, y))
    for read, written in ((record.u, u), (record.y, y)):
        np.testing.assert_array_equal(read, written)
    is_epoch = start > 1e8
    np.testing.assert_array_equal(record.t, (np.arange(samples) / rate_hz if is_epoch else t))
    assert record.sample_rate_hz == rate_hz
    assert [said[:13] for said in record.treatment] == ["time: Unix st"] * is_epoch


def test_a_record_carries_its_provenance_and_units(tmp_path):
    path = write_csv(tmp_path / "night 1.csv", *columns())
    record = Record.read(str(path), units=Units(input="V", output="m"))
    assert record.name == "night 1"
    assert record.source == str(path)
    assert record.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert record.units == Units(input="V", output="m")


def test_columns_are_mapped_by_name(tmp_path):
    path = write_csv(tmp_path / "a.csv", *columns(), header="time,command,angle")
    names = Columns("time", "command", "angle")
    np.testing.assert_array_equal(Record.read(path, columns=names).u, columns()[1])


def test_a_missing_column_is_answered_with_those_there_are_and_the_option(tmp_path):
    path = write_csv(tmp_path / "a.csv", *columns(), header="time,command,angle")
    message = refusal(path, columns=Columns("time", "v"))
    assert message == (
        "no column 'v' for the input; it has 'time', 'command', 'angle': map one with "
        'columns=Columns(input="NAME")'
    )
    assert "columns=Columns(time=None), sample_rate_hz=RATE" in refusal(path, columns=Columns("stamp"))


def test_columns_that_nobody_named_are_found_where_there_is_no_choice(tmp_path):
    """And said; where there is one, an option is asked for by name."""
    t = np.arange(400) / 20
    u = np.sin(0.9 * t) + 0.4 * np.sin(4.1 * t)
    y = np.cumsum(u) / 20
    path = write_csv(tmp_path / "a.csv", t, u, y, header="time,command,angle")
    for names in (Columns(), Columns("time"), Columns(output="angle")):
        record = Record.read(path, columns=names)
        np.testing.assert_array_equal(record.y, y)
        assert record.options.columns == Columns("time", "command", "angle")
        assert record.treatment[0].startswith("columns taken by their names and numbers: ")
    path = tmp_path / "a.txt"
    np.savetxt(path, np.column_stack([t, u, y]))
    np.testing.assert_array_equal(Record.read(path).y, y)
    assert "there is no header; name columns by number, from 1 to 3" in refusal(path, columns=Columns("9"))
    rows = np.column_stack([t, u, y, y + 1e-4 * np.sin(t)])
    path = tmp_path / "b.csv"
    np.savetxt(path, rows, delimiter=",", header="t,u,enc_1,enc_2", comments="")
    message = refusal(path)
    assert message.startswith("no column 'y' for the output; it has 't', 'u', 'enc_1', 'enc_2': ")
    assert "columns=Columns(output='enc_1')" in message or "columns=Columns(output='enc_2')" in message


def test_columns_that_were_named_are_taken_whatever_their_names_say(tmp_path):
    """Only the clock is found: called `time`, not `t`."""
    t = np.arange(400) / 20
    u = np.sin(0.9 * t) + 0.4 * np.sin(4.1 * t)
    y = np.cumsum(u) / 20
    path = write_csv(tmp_path / "a.csv", t, u, y, header="time,output,input")
    record = Record.read(path, columns=Columns(input="output", output="input"))
    np.testing.assert_array_equal(record.u, u)
    np.testing.assert_array_equal(record.y, y)
    assert record.options.columns.time == "time"


def test_one_column_cannot_play_two_parts(tmp_path):
    path = write_csv(tmp_path / "a.csv", *columns())
    assert "named twice" in refusal(path, columns=Columns("t", "y", "y"))


def test_without_time_stamps_the_given_rate_counts_the_time(tmp_path):
    path = write_csv(tmp_path / "a.csv", *columns())
    record = Record.read(path, columns=Columns(time=None), sample_rate_hz=40.0)
    np.testing.assert_allclose(record.t, np.arange(100) / 40)
    assert record.sample_rate_hz == 40.0
    assert record.treatment == ("time counted from 0 s at the given rate of 40 Hz",)
    assert "sample_rate_hz" in refusal(path, columns=Columns(time=None))


def test_a_given_rate_replaces_that_of_the_stamps_within_one_percent_and_is_refused_beyond(tmp_path):
    t, u, y = columns()
    path = write_csv(tmp_path / "a.csv", t * 1.005, u, y)
    record = Record.read(path, sample_rate_hz=20.0)
    assert record.sample_rate_hz == 20.0
    assert "taken at the given 20 Hz, the time stamps saying 19.9" in record.treatment[0]
    message = refusal(path, sample_rate_hz=25.0)
    assert "say 19.9005 Hz, `sample_rate_hz` says 25 Hz" in message


@pytest.mark.parametrize("option", ["sample_rate_hz", "resample_hz"])
@pytest.mark.parametrize("rate_hz", [0.0, -1.0, np.nan, np.inf])
def test_a_rate_that_is_none_is_refused(tmp_path, option, rate_hz):
    path = write_csv(tmp_path / "a.csv", *columns())
    assert "positive rate in Hz" in refusal(path, **{option: rate_hz})


def test_uneven_stamps_are_refused_with_the_row_and_both_steps_and_the_remedy(tmp_path):
    kept = np.delete(np.arange(100), 50)
    path = write_csv(tmp_path / "a.csv", *(column[kept] for column in columns()))
    message = refusal(path)
    assert message.startswith("row 52: time step changes from 0.05 s to 0.1 s: samples are missing (1 single")
    for option in ('ReadingOptions(gaps="bridge")', 'ReadingOptions(gaps="split")', "resample_hz=RATE"):
        assert option in message


def test_uneven_stamps_are_put_on_a_grid_when_asked(tmp_path):
    kept = np.delete(np.arange(200), np.arange(50, 60))
    t, u, y = (column[kept] for column in columns(200))
    record = Record.read(write_csv(tmp_path / "a.csv", t, u, y), resample_hz=20.0)
    assert len(record) == 200
    np.testing.assert_allclose(record.t, np.arange(200) / 20)
    np.testing.assert_allclose(record.y, np.interp(record.t, t, y), atol=1e-12)
    assert "longest 0.55 s ending at row 52" in record.treatment[0]
    assert "gaps longer than 3 median steps: 1," in record.treatment[0]


def test_a_record_that_is_gaps_for_the_most_part_is_refused(tmp_path):
    t, u, y = columns()
    t[50:] += 6.0
    message = refusal(write_csv(tmp_path / "a.csv", t, u, y), resample_hz=20.0)
    assert message.startswith("row 52: a gap of 6.05 s; gaps are 55 % of the record")


def test_asking_for_the_rate_that_a_record_has_changes_nothing(tmp_path):
    path = write_csv(tmp_path / "a.csv", *columns())
    record = Record.read(path, resample_hz=20.0)
    np.testing.assert_array_equal(record.u, columns()[1])
    assert record.treatment == ()


@pytest.mark.parametrize("rate_hz", [1.0, 1e9])
def test_resampling_to_no_record_is_refused(tmp_path, rate_hz):
    path = write_csv(tmp_path / "a.csv", *columns())
    assert f"resample_hz={rate_hz:g}" in refusal(path, resample_hz=rate_hz)


@pytest.mark.parametrize("resample_hz", [None, 10.0])
@pytest.mark.parametrize(
    ("stamp", "complaint"),
    [(1.95, "time stamp repeats 1.95"), (1.5, "time stamp goes back from 1.95 to 1.5")],
)
def test_repeated_and_backward_stamps_are_refused_with_the_row(tmp_path, stamp, complaint, resample_hz):
    t, u, y = columns()
    t[40] = stamp
    message = refusal(write_csv(tmp_path / "a.csv", t, u, y), resample_hz=resample_hz)
    assert (
        message.startswith(f"row 42: {complaint}")
        and "columns=Columns(time=None), sample_rate_hz=RATE" in message
    )


@pytest.mark.parametrize(("scale", "unit"), [(1e3, "ms"), (1e9, "ns"), (1 / 86400 / 1000, "")])
def test_stamps_that_are_not_in_seconds_are_refused(tmp_path, scale, unit):
    """With the option that reads them where they may be in a finer unit, at the rate that they have then."""
    t, u, y = columns()
    said = refusal(write_csv(tmp_path / "a.csv", t * scale, u, y))
    assert "give times in s" in said
    remedy = f'if they are in {unit}, which makes 20 Hz, give options=ReadingOptions(time_unit="{unit}")'
    assert said.endswith(remedy) == bool(unit)


@pytest.mark.parametrize(("role", "column"), [("input", 1), ("output", 2)])
def test_a_constant_column_is_refused(tmp_path, role, column):
    table = list(columns())
    table[column] = np.full(100, 0.25)
    message = refusal(write_csv(tmp_path / "a.csv", *table))
    assert message.startswith(f"column '{'tuy'[column]}' is 0.25 throughout")
    assert f'columns=Columns({role}="NAME")' in message


def test_a_column_that_changes_by_rounding_alone_is_constant(tmp_path):
    t, _, y = columns()
    path = write_csv(tmp_path / "a.csv", t, 0.1 + 1e-17 * np.arange(100), y)
    assert "'u' is 0.1 throughout" in refusal(path)


@pytest.mark.parametrize("column", [0, 1, 2])
@pytest.mark.parametrize("value", [1e13, -1e308])
def test_a_value_that_no_axis_reaches_is_refused_with_its_row(tmp_path, column, value):
    table = columns()
    table[column][60] = value
    message = refusal(write_csv(tmp_path / "a.csv", *table), resample_hz=10)
    assert message.startswith(f"row 62, column '{'tuy'[column]}': {value:g} is beyond 1e+12")


def test_too_few_samples_are_refused(tmp_path):
    assert "has 31 samples of the 32" in refusal(write_csv(tmp_path / "a.csv", *columns(31)))
    assert len(Record.read(write_csv(tmp_path / "a.csv", *columns(32)))) == 32


def test_what_is_no_file_is_refused(tmp_path):
    assert "is a directory" in refusal(tmp_path)
    assert "No such file" in refusal(tmp_path / "none.csv")
    assert "File name too long" in refusal(tmp_path / ("a" * 300))
    (tmp_path / "empty.csv").touch()
    assert "is empty" in refusal(tmp_path / "empty.csv")
    assert "not a regular file" in refusal(Path("/dev/null"))


def test_a_file_too_large_is_refused_unread(tmp_path):
    path = tmp_path / "a.csv"
    with path.open("wb") as stream:
        stream.truncate(600 * 2**20)
    assert "600 MB is more than the 512 MB" in refusal(path)


def test_matlab_variables_make_a_record(tmp_path):
    path = tmp_path / "axis.MAT"
    t, u, y = columns()
    with path.open("wb") as stream:
        scipy.io.savemat(stream, {"t": t, "exp": {"u": u, "y": y}}, do_compression=True)
    record = Record.read(path, columns=Columns("t", "exp.u", "exp.y"))
    np.testing.assert_array_equal(record.y, y)
    assert record.sample_rate_hz == 20.0
    assert "it has 't', 'exp.FIELD'" in refusal(path)


def test_matlab_faults_name_the_sample_and_lengths(tmp_path):
    path = tmp_path / "axis.mat"
    t, u, y = columns()
    scipy.io.savemat(path, {"t": t, "u": u[:-1], "y": y})
    assert "'t' has 100, 'u' has 99, 'y' has 100 samples" in refusal(path)
    t[3] = t[2]
    scipy.io.savemat(path, {"t": t, "u": u, "y": y})
    assert refusal(path).startswith("sample 4: time stamp repeats")


@files_from_hypothesis
@given(content=st.binary(max_size=400), suffix=st.sampled_from([".csv", ".mat", ""]))
def test_random_bytes_are_refused(tmp_path, content, suffix):
    path = tmp_path / f"record{suffix}"
    path.write_bytes(content)
    refusal(path)


def test_a_name_alone_is_no_log(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("t")
    refusal(path)


@pytest.mark.slow
@files_from_hypothesis
@given(
    steps=st.lists(st.floats(1e-6, 100) | st.just(0.05), min_size=31, max_size=60),
    scale=st.floats(-1e12, 1e12),
    resample_hz=st.none() | st.floats(1e-3, 50),
)
def test_any_increasing_stamps_make_a_record_or_are_refused(tmp_path, steps, scale, resample_hz):
    t = np.concatenate([[0.0], np.cumsum(steps)])
    u = scale * np.sin(np.arange(len(t)))
    path = write_csv(tmp_path / "axis.csv", t, u, -u)
    try:
        record = Record.read(path, resample_hz=resample_hz)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        np.testing.assert_allclose(np.diff(record.t), 1 / record.sample_rate_hz, rtol=0.011, atol=1e-6)


@needs_shared
def test_the_rubin_azimuth_is_refused_as_it_is_and_read_when_resampled():
    path = SHARED / "data/rubin_tma/20230531_azimuth.csv"
    names = Columns("timestamp", "demandVelocity", "actualPosition")
    assert "row 3: time step changes from 0.05043 s to 0.09985 s: samples are missing" in refusal(
        path, columns=names
    )
    record = Record.read(path, columns=names, resample_hz=10)
    assert record.sample_rate_hz == 10
    assert record.t[0] == 0.0
    assert "2023-05-31T14:29:58.585310Z" in record.treatment[0]
    assert record.y[0] == -28.7293094221051
    assert "uneven stamps" in record.treatment[1]


@needs_shared
def test_a_rubin_axis_that_is_not_commanded_is_refused():
    path = SHARED / "data/rubin_tma/20230531_elevation.csv"
    names = Columns("timestamp", "demandVelocity", "actualPosition")
    assert "'demandVelocity' is 0 throughout" in refusal(path, columns=names, resample_hz=10)


@needs_shared
def test_the_emps_axis_is_read_as_scipy_reads_it():
    path = SHARED / "data/emps/DATA_EMPS.mat"
    record = Record.read(path, columns=Columns("t", "vir", "qm"))
    reference = scipy.io.loadmat(path)
    for values, name in ((record.t, "t"), (record.u, "vir"), (record.y, "qm")):
        np.testing.assert_array_equal(values, reference[name].ravel())
    assert record.sample_rate_hz == 1000.0
    decimated = Record.read(path, columns=Columns(None, "vir", "qm"), sample_rate_hz=1000, resample_hz=50)
    assert len(decimated) == 1243
    np.testing.assert_allclose(decimated.y, record.y[::20], atol=1e-12)
    assert len(decimated.treatment) == 2


@needs_shared
def test_the_dc_motor_is_read_beside_its_text_column():
    path = SHARED / "data/dc_motor_deadzone/run_minimal.csv"
    record = Record.read(path, columns=Columns("time", "voltage", "rpm"))
    assert (len(record), record.sample_rate_hz) == (6601, 100.0)


@pytest.mark.slow
@needs_shared
def test_every_practice_record_is_read_at_a_whole_rate_without_treatment():
    paths = sorted(SHARED.glob("practice*/case_*/*.csv"))
    assert paths
    for path in paths:
        record = Record.read(path)
        assert record.sample_rate_hz in (20.0, 25.0, 40.0, 50.0)
        assert record.treatment == ()


@pytest.mark.parametrize("dates", [False, True])
def test_an_xarray_dataset_is_a_record(dates):
    xarray = pytest.importorskip("xarray")
    t, u, y = columns()
    when = np.datetime64("2026-03-14T22:41:07", "ns") + (1e9 * t).astype("timedelta64[ns]") if dates else t
    attributes = {"units": "rad"}
    data = {
        "cmd": ("time", u),
        "angle": ("time", y, attributes),
        "image": (("time", "x"), np.zeros((100, 2))),
    }
    dataset = xarray.Dataset(data, coords={"time": when})
    options = ReadingOptions(Columns("time", "cmd", "angle"), units={"output": "deg"})
    record = Record.from_xarray(dataset, options=options, name="night")
    np.testing.assert_allclose(record.y, np.degrees(y))
    np.testing.assert_allclose(record.t, t, atol=1e-9)
    assert (record.name, record.units) == ("night", Units())
    with pytest.raises(
        InputError, match="night: no variable 'wind' for the output; it has 'time', 'cmd', 'angle'"
    ):
        Record.from_xarray(dataset, options=ReadingOptions(Columns("time", "cmd", "wind")), name="night")
