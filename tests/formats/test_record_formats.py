"""Every format holds a record to the last digit, and refuses in one line what is none.

HDF5 is tried in this process, but where MATLAB's is read: no file is damaged.
"""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from simulated_records import measured

from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Columns, Record, Units

ENDINGS = (".csv", ".mat", ".h5", ".hdf5", ".parquet", ".pq")
SAMPLES = 50
T = np.arange(SAMPLES) / 20
U, Y = np.sin(T), np.cos(T)


def refusal(path: Path, columns: Columns | None = None) -> str:
    with pytest.raises(InputError) as caught:
        Record.read(path, columns=columns)
    message = str(caught.value)
    assert "\n" not in message and message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


@pytest.mark.usefixtures("tried_here")
@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.lists(st.floats(-1e12, 1e12), min_size=SAMPLES, max_size=SAMPLES),
    suffix=st.sampled_from(ENDINGS),
    start=st.sampled_from([0.0, -3.0, 1_685_543_398.0]),
)
def test_every_finite_record_survives_a_round_trip(
    tmp_path: Path, values: list[float], suffix: str, start: float
) -> None:
    y = np.array(values)
    y[:2] = 0.0, 1.0
    written = Record("axis", start + T, U, y, 20.0, Units())
    written.write(tmp_path / f"axis{suffix}")
    read = Record.read(tmp_path / f"axis{suffix}")
    is_epoch = start > 1e8
    np.testing.assert_array_equal(read.t, T if is_epoch else written.t)
    for column in ("u", "y"):
        np.testing.assert_array_equal(getattr(read, column), getattr(written, column))
    assert read.sample_rate_hz == 20.0 and len(read.treatment) == is_epoch


@pytest.mark.usefixtures("tried_here")
@pytest.mark.parametrize("suffix", [".h5", ".parquet"])
def test_columns_are_mapped_and_the_missing_ones_named(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"axis{suffix}"
    if suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["night/t"], file["night/command"], file["angle"] = T, U, Y
        names = Columns("night.t", "night/command", "angle")
    else:
        pd.DataFrame({"when": T, "command": U.astype("f4"), "label": "x", "angle": Y}).to_parquet(path)
        names = Columns("when", "command", "angle")
    record = Record.read(path, columns=names)
    np.testing.assert_allclose(record.u, U, rtol=1e-6, atol=1e-7)
    assert 'give columns=Columns(input="NAME")' in refusal(path)
    message = refusal(path, columns=Columns("stamp"))
    assert (
        "for the time" in message and "'angle'" in message and "map one with columns=Columns(time=" in message
    )


def hdf5_faults(file: h5py.File) -> dict[str, str]:
    """Data sets that are no vector of numbers, and what is said of each."""
    file["matrix"] = np.zeros((3, 4))
    file["text"] = "text"
    file["complex"] = U + 0j
    file["hole"] = np.where(np.arange(SAMPLES) == 3, np.nan, U)
    file["link"] = h5py.SoftLink("/u")
    file["elsewhere"] = h5py.ExternalLink("other.h5", "/u")
    file.create_dataset("vast", shape=(10**10,), chunks=(1000,), compression="gzip", dtype="f8")
    file.create_dataset("thick", shape=(100,), chunks=(10**8,), maxshape=(None,), dtype="f8")
    file.create_dataset("outside", shape=(SAMPLES,), dtype="f8", external=[("raw.bin", 0, 8 * SAMPLES)])
    return {
        "matrix": "is 3 x 4; name a vector",
        "text": "does not hold real numbers",
        "complex": "does not hold real numbers",
        "hole": "sample 4, data set 'hole': empty cell or NaN, so not measured (1 in all); give options=",
        "link": "is a link",
        "elsewhere": "is a link",
        "vast": "takes 76294 MB, more than the 256 MB",
        "thick": "takes 763 MB, more than the 256 MB",
        "outside": "lies in other files",
    }


@pytest.mark.usefixtures("tried_here")
def test_a_data_set_that_is_no_plain_vector_is_refused(tmp_path: Path) -> None:
    """What it declares is checked before it is read: a terabyte of nothing takes no memory."""
    path = tmp_path / "axis.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["u"] = T, U
        faults = hdf5_faults(file)
    for name, said in faults.items():
        assert said in refusal(path, Columns("t", "u", name)), name


def test_a_parquet_column_that_is_no_number_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "axis.parquet"
    whole = pd.array([*range(SAMPLES - 1), None], dtype="Int64")
    frame = {"t": T, "u": U, "text": "a", "empty": whole, "hole": np.where(T[3] == T, np.inf, U)}
    pd.DataFrame(frame).to_parquet(path)
    for name, said in (
        ("text", "column 'text' is of type"),
        ("empty", f"row {SAMPLES}, column 'empty': empty cell or NaN, so not measured"),
        ("hole", "row 4, column 'hole': inf is not a finite number"),
        ("y", "no column 'y' for the output"),
    ):
        assert said in refusal(path, Columns("t", "u", name))


def test_parquet_without_pyarrow_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "axis.parquet"
    pd.DataFrame({"t": T, "u": U, "y": Y}).to_parquet(path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "pip install 'bayes-hw[parquet]'" in refusal(path)
    with pytest.raises(InputError, match="bayes-hw\\[parquet\\]"):
        Record("a", T, U, Y, 20.0, Units()).write(tmp_path / "b.parquet")
    assert not (tmp_path / "b.parquet").exists()


def test_matlab_of_version_7_3_is_read(tmp_path: Path) -> None:
    """A user block of 512 bytes, then HDF5 with arrays transposed and structures as groups."""
    path = tmp_path / "axis.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"], file["exp/u"], file["exp/y"] = T[None, :], U[None, :], Y[:, None]
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    record = Record.read(path, columns=Columns("t", "exp.u", "exp.y"))
    np.testing.assert_array_equal(record.y, Y)


def iddata(**changes: object) -> dict[str, object]:
    """What MATLAB's get(iddata) gives, as scipy writes it."""
    empty = np.zeros((0, 0))
    fields: dict[str, object] = {
        "Domain": "Time",
        "Name": "",
        "OutputData": Y[:, None],
        "y": "Same as OutputData",
        "OutputName": np.array(["y1"], dtype=object),
        "InputData": U[:, None],
        "u": "Same as InputData",
        "InterSample": "zoh",
        "Ts": 0.05,
        "Tstart": empty,
        "SamplingInstants": empty,
        "TimeUnit": "seconds",
        "UserData": empty,
    }
    return {name: value for name, value in (fields | changes).items() if value is not None}


@pytest.mark.parametrize("compressed", [False, True])
def test_an_iddata_structure_is_a_record(tmp_path: Path, compressed: bool) -> None:
    """As MATLAB has it, its first sample lies at Ts where no Tstart is given."""
    path = tmp_path / "axis.mat"
    content = {"data": iddata(), "other": {"a": 1.0}, "n": 5.0}
    scipy.io.savemat(path, content, do_compression=compressed)
    record = Record.read(path)
    np.testing.assert_array_equal(record.y, Y)
    np.testing.assert_array_equal(record.u, U)
    assert record.sample_rate_hz == 20.0 and record.t[0] == pytest.approx(0.05)


@pytest.mark.parametrize(
    "changes",
    [
        {"Tstart": 0.0},
        {"OutputData": None, "y": Y, "InputData": None, "u": U, "Tstart": 0.0},
        {"Ts": np.zeros((0, 0)), "SamplingInstants": T[:, None]},
    ],
)
def test_iddata_by_its_short_names_and_with_instants(tmp_path: Path, changes: dict[str, object]) -> None:
    path = tmp_path / "axis.mat"
    scipy.io.savemat(path, {"data": iddata(**changes)})
    record = Record.read(path)
    np.testing.assert_allclose(record.t, T, atol=1e-12)
    np.testing.assert_array_equal(record.u, U)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"Ts": -1.0}, "data.Ts is -1; give a positive sample time"),
        ({"Ts": np.zeros((0, 0))}, "data.Ts is empty; give the sample time"),
        ({"Ts": np.array([0.1, 0.2])}, "data.Ts is not one finite number"),
        ({"TimeUnit": "minutes"}, "data.TimeUnit is 'minutes'; export with times in seconds"),
        ({"OutputData": np.zeros((SAMPLES, 2))}, "data.OutputData is 50 x 2; export one input"),
        ({"InputData": np.array([U, U], dtype=object)}, "data.InputData"),
        (
            {"InputData": np.where(T[5] == T, np.nan, U)},
            "sample 6, variable 'u': empty cell or NaN, so not measured",
        ),
        ({"InputData": "text", "u": "text"}, "data.InputData holds no numbers"),
        ({"InputData": U[:-1, None]}, "'u' has 49, 'y' has 50 samples"),
        ({"OutputData": {"exp1": Y}}, "data.OutputData holds a structure"),
    ],
)
def test_iddata_that_is_no_record_is_refused(tmp_path: Path, changes: dict[str, object], said: str) -> None:
    path = tmp_path / "axis.mat"
    scipy.io.savemat(path, {"data": iddata(**changes)})
    assert said in refusal(path)


CELL = np.array([1.0, "a"], dtype=object)
VALUES = st.sampled_from([CELL, {"a": 1.0}, {}, "", "text", np.zeros((0, 0)), np.eye(3), 1j, U + 0j]) | (
    st.floats() | st.integers(-(2**31), 2**31 - 1) | st.lists(st.floats(), max_size=3)
)


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(value=VALUES, field=st.sampled_from(["OutputData", "InputData", "Ts", "Tstart", "TimeUnit", "y"]))
@example(value=3.6e306, field="Ts")
def test_any_value_in_an_iddata_is_used_or_refused(tmp_path: Path, value: object, field: str) -> None:
    path = tmp_path / "axis.mat"
    scipy.io.savemat(path, {"data": iddata(**{field: value})})
    try:
        assert len(Record.read(path)) == SAMPLES
    except InputError as error:
        assert "\n" not in str(error)


def test_several_iddata_are_named(tmp_path: Path) -> None:
    path = tmp_path / "axis.mat"
    scipy.io.savemat(path, {"night": iddata(), "day": iddata()})
    message = refusal(path)
    assert (
        "2 iddata structures (night, day)" in message
        and 'columns=Columns(input="night.InputData")' in message
    )
    by_name = Columns(None, "day.InputData", "day.OutputData")
    np.testing.assert_array_equal(Record.read(path, columns=by_name, sample_rate_hz=20).y, Y)


@pytest.mark.usefixtures("tried_here")
def test_a_simulated_record_goes_through_every_format(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    """From one format to the next and back: the same numbers."""
    record = measured(small_axis, 200, seed=1)
    for suffix in ENDINGS:
        path = tmp_path / f"axis{suffix}"
        record.write(path)
        record = Record.read(path)
    np.testing.assert_array_equal(record.y, measured(small_axis, 200, seed=1).y)


RADIANS = Units(input="rad/s", output="rad")


@pytest.mark.usefixtures("tried_here")
@pytest.mark.parametrize("suffix", [".h5", ".parquet"])
def test_units_survive_a_round_trip_and_are_converted_to_those_asked_for(tmp_path: Path, suffix: str) -> None:
    """A record in radians is never taken for one in degrees without a word."""
    path = tmp_path / f"axis{suffix}"
    Record("axis", T, U, Y, 20.0, RADIANS).write(path)
    assert Record.read(path).units == RADIANS
    assert Record.read(path, units=RADIANS).units == RADIANS
    assert Record.read(path, units={"output": "radians"}).units == Units(input="rad/s", output="radians")
    read = Record.read(path, units=Units())
    np.testing.assert_allclose(read.y, np.degrees(Y), rtol=1e-14)
    np.testing.assert_allclose(read.u, np.degrees(U), rtol=1e-14)
    assert read.treatment == ("input converted from rad/s to deg/s", "output converted from rad to deg")
    with pytest.raises(InputError, match=r"'rad' cannot be converted to 'V'"):
        Record.read(path, units={"output": "V"})


@pytest.mark.usefixtures("tried_here")
@pytest.mark.parametrize(("stated", "read"), [
    ("degrees", "deg"), (b"deg", "deg"), ("counts", "counts"), ("", "deg"), (5.0, "deg"), ("d\neg", "deg"),
    ("x" * 40, "deg"),
])  # fmt: skip
def test_units_of_other_programs(tmp_path: Path, stated: object, read: str) -> None:
    """The attribute `units` or `unit` of a data set; what is no short text is no unit."""
    for name in ("units", "unit"):
        path = tmp_path / f"{name}.h5"
        with h5py.File(path, "w") as file:
            for column, values in {"t": T, "u": U, "y": Y}.items():
                file[column] = values
            file["y"].attrs[name] = stated
        assert Record.read(path).units == Units(output=read)


@pytest.mark.usefixtures("tried_here")
def test_times_in_another_unit_are_converted_and_in_none_refused(tmp_path: Path) -> None:
    path = tmp_path / "axis.h5"
    with h5py.File(path, "w") as file:
        for column, values in {"t": 1000 * T, "u": U, "y": Y}.items():
            file[column] = values
        file["t"].attrs["units"] = "ms"
    np.testing.assert_allclose(Record.read(path).t, T, atol=1e-12)
    with h5py.File(path, "r+") as file:
        file["t"].attrs["units"] = "furlong"
    assert refusal(path).startswith("states its times in 'furlong'; give options=ReadingOptions(time_unit=")


@pytest.mark.parametrize("unit", ["rad", np.array(["rad"], dtype=object)], ids=["text", "cell"])
def test_units_of_an_iddata(tmp_path: Path, unit: object) -> None:
    path = tmp_path / "axis.mat"
    scipy.io.savemat(path, {"data": iddata(OutputUnit=unit, InputUnit="")})
    assert Record.read(path).units == Units(output="rad")
