"""Binary logs: FITS tables, TDMS channels, ROS bags, HDF5 and Parquet with dates or a clock a signal."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from bayes_hw.errors import InputError
from bayes_hw.reading_options import Columns, ReadingOptions
from bayes_hw.record import Record, Units

fits = pytest.importorskip("astropy.io.fits")
nptdms = pytest.importorskip("nptdms")

SAMPLES = 200
T = np.arange(SAMPLES) / 20
U, Y = np.sin(T), np.cumsum(np.sin(T)) / 20
START_NS = 1_773_528_067_000_000_000
NS = START_NS + 50_000_000 * np.arange(SAMPLES)


def read(path: Path, time: str, u: str, y: str, **options: object) -> Record:
    return Record.read(path, options=ReadingOptions(Columns(time, u, y), **options))  # type: ignore[arg-type]


def assert_same(record: Record, y: np.ndarray = Y) -> None:
    np.testing.assert_allclose(record.t - record.t[0], T, atol=1e-6)
    np.testing.assert_allclose(record.u, U, atol=1e-12)
    np.testing.assert_allclose(record.y, y, atol=1e-9)
    assert record.sample_rate_hz == 20.0


def write_fits(path: Path, columns: dict[str, tuple[str, str, np.ndarray]], header: dict[str, str]) -> Path:
    made = [
        fits.Column(name, form, unit or None, array=values) for name, (form, unit, values) in columns.items()
    ]
    table = fits.BinTableHDU.from_columns(made, name="LOG")
    table.header.update(header)
    fits.HDUList([fits.PrimaryHDU(), table]).writeto(path)
    return path


@pytest.mark.parametrize(("unit", "time"), [
    ("s", T), ("d", 61113.9 + T / 86400), ("", 61113.9 + T / 86400), ("ms", 1000 * T), ("", 1.7e9 + T),
])  # fmt: skip
def test_a_fits_table(tmp_path: Path, unit: str, time: np.ndarray) -> None:
    columns = {"TIME": ("D", unit, time), "CMD": ("D", "deg/s", U), "ANGLE": ("D", "arcsec", 3600 * Y)}
    path = write_fits(tmp_path / "night.fits", columns, {"TIMESYS": "TAI"})
    record = read(path, "TIME", "cmd", "ANGLE", units={"output": "deg"})
    assert_same(record)
    assert record.units == Units()
    assert "no column 'AZ' for the output; it has 'TIME', 'CMD', 'ANGLE'" in refusal(
        path, "TIME", "CMD", "AZ"
    )


def test_damaged_fits_files_are_refused(tmp_path: Path) -> None:
    columns = {"TIME": ("D", "s", T), "CMD": ("D", "", U), "ANGLE": ("D", "", Y)}
    path = write_fits(tmp_path / "night.fits", columns, {})
    good = path.read_bytes()
    path.write_bytes(good[: len(good) - 2880])
    assert "is not a sound FITS file" in refusal(path, "TIME", "CMD", "ANGLE")
    for at in range(2880, 6000, 61):
        path.write_bytes(good[:at] + b"\xff" + good[at + 1 :])
        try:
            read(path, "TIME", "CMD", "ANGLE")
        except InputError as error:
            assert "\n" not in str(error)


def refusal(path: Path, time: str, u: str, y: str, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read(path, time, u, y, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(("module", "name", "extra"), [
    ("astropy.io", "a.fits", "fits"), ("nptdms", "a.tdms", "tdms"), ("rosbags", "a.mcap", "ros"),
])  # fmt: skip
def test_without_its_library_a_format_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, name: str, extra: str
) -> None:
    (tmp_path / name).write_bytes(b"SIMPLE")
    monkeypatch.setitem(sys.modules, module, None)
    assert f"pip install 'bayes-hw[{extra}]'" in refusal(tmp_path / name, "t", "u", "y")


@pytest.mark.parametrize("by", ["waveform", "channel", "date"])
def test_tdms_channels(tmp_path: Path, by: str) -> None:
    path = tmp_path / "log.tdms"
    wave = {"wf_increment": 0.05, "wf_start_offset": 0.0} if by == "waveform" else {}
    channels = [
        nptdms.ChannelObject("axis", "cmd", U, {**wave, "unit_string": "deg/s"}),
        nptdms.ChannelObject("axis", "angle", Y, {**wave, "unit_string": "deg"}),
    ]
    if by != "waveform":
        stamps = T if by == "channel" else NS.astype("datetime64[ns]").astype("datetime64[us]")
        channels.append(nptdms.ChannelObject("axis", "Time", stamps, {}))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)
    assert_same(read(path, "Time", "cmd", "axis/angle"))
    assert "no channel 'az'" in refusal(path, "Time", "cmd", "az")


def test_a_ros_bag(tmp_path: Path) -> None:
    """Two topics, each with stamps of its own; fields by name."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    Float64 = store.types["std_msgs/msg/Float64"]  # noqa: N806
    Vector3 = store.types["geometry_msgs/msg/Vector3"]  # noqa: N806
    folder = tmp_path / "bag"
    with rosbag2.Writer(folder, version=9) as writer:
        cmd = writer.add_connection("/cmd", Float64.__msgtype__, typestore=store)
        enc = writer.add_connection("/enc", Vector3.__msgtype__, typestore=store)
        for stamp, u, y in zip(NS, U, Y, strict=True):
            writer.write(cmd, int(stamp), store.serialize_cdr(Float64(float(u)), Float64.__msgtype__))
            writer.write(
                enc, int(stamp), store.serialize_cdr(Vector3(0.0, 0.0, float(y)), Vector3.__msgtype__)
            )
    assert_same(read(folder, "time", "/cmd.data", "/enc.z"))
    assert "they have x, y, z" in refusal(folder, "time", "/cmd.data", "/enc.angle")


def test_hdf5_with_a_clock_a_signal(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["cmd/time"], file["cmd/value"] = NS, U
        file["enc/time"], file["enc/value"] = NS[5:] - 10_000_000, np.interp(T[5:] - 0.01, T, Y)
    record = read(path, "time", "cmd/value", "enc/value")
    assert len(record) == SAMPLES - 6
    np.testing.assert_allclose(record.y, Y[5:-1], atol=1e-3)
    assert any("clock of its own" in said for said in record.treatment)


def test_parquet_with_dates_text_and_empty_cells(tmp_path: Path) -> None:
    y = np.where(np.arange(SAMPLES) == 50, np.nan, Y)
    stamps = pd.to_datetime(NS)
    for name, column in (("a", stamps), ("b", stamps.tz_localize("Europe/Rome")), ("c", stamps.astype(str))):
        path = tmp_path / f"{name}.parquet"
        pd.DataFrame({"when": column, "u [deg/s]": U, "y": y}).to_parquet(path)
        record = read(path, "when", "u", "y", gaps="bridge")
        np.testing.assert_array_equal(np.flatnonzero(~record.measured_samples), [50])
        np.testing.assert_allclose(record.t, T, atol=1e-9)


def test_an_output_with_a_clock_of_its_own_in_one_table(tmp_path: Path) -> None:
    """As TwinCAT's Scope and LabVIEW with several X columns write it."""
    path = tmp_path / "scope.csv"
    rows = "".join(f"{1000 * a}\t{b}\t{1000 * a + 10}\t{c}\n" for a, b, c in zip(T, U, Y, strict=True))
    path.write_text("t_u [ms]\tu\tt_y [ms]\ty\n" + rows)
    record = read(path, "t_u", "u", "y", output_time="t_y")
    np.testing.assert_allclose(record.y, np.interp(T[1:], T + 0.01, Y), atol=1e-9)
    path.write_text("X_Value\tu\tX_Value\ty\tComment\n" + rows)
    record = read(path, "X_Value", "u", "y", time_unit="ms")
    np.testing.assert_allclose(record.y, np.interp(T[1:], T + 0.01, Y), atol=1e-9)


def test_a_labview_measurement_file(tmp_path: Path) -> None:
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\tNo\nOperator\tnobody\n"
        "***End_of_Header***\t\n\t\nChannels\t2\nSamples\t200\t200\nDelta_X\t0.05\t0.05\n***End_of_Header***\n"
    )
    rows = "".join(f"\t{u}\t{y}\n" for u, y in zip(U, Y, strict=True))
    (tmp_path / "log.lvm").write_text(head + "X_Value\tcmd\tangle\tComment\n" + rows)
    assert_same(read(tmp_path / "log.lvm", "X_Value", "cmd", "angle"))
