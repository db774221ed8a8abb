"""bayes-hw inspect: what it takes for what is what reads the file, and what is open is asked by option."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from bayes_hw.cli import main
from bayes_hw.column_roles.column_facts import quantisation_step
from bayes_hw.record import Record

T = np.arange(1200) / 20
U = 0.5 * np.sin(0.9 * T) + 0.2 * np.sin(4.1 * T)
Y = np.round(np.cumsum(U) / 20, 4)


def write(path: Path, header: str, *columns: np.ndarray) -> Path:
    rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text(f"{header}\n{rows}\n")
    return path


def commands(out: str) -> list[list[str]]:
    return [shlex.split(line)[1:] for line in out.splitlines() if line.startswith("  bayes-hw")]


@pytest.mark.parametrize(("header", "columns"), [
    ("t,u,y", (T, U, Y)),
    ("Time [s],Cmd [deg/s],Pos [deg]", (T, U, Y)),
    ("time_ms,temperature,demand,encoder", (1000 * T, 20 + 0.01 * T, U, Y)),
    ("encoder,demand,clock_s", (Y, U, T)),
    ("time,target,actual", (T, np.concatenate([[0.0], np.cumsum(U[:-1]) / 20]), Y)),
    ("t,u,y", (T, U, (359.9 + Y) % 360)),
    ("t,u,y", (T, U, (0.0002 * np.sin(900 * T) + Y) % 360)),
    ("t,u,y", (np.delete(T, [100, 333]), np.delete(U, [100, 333]), np.delete(Y, [100, 333]))),
])  # fmt: skip
def test_the_command_that_it_prints_reads_the_record(
    tmp_path: Path,
    header: str,
    columns: tuple[np.ndarray, ...],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    write(Path("log.csv"), header, *columns)
    assert main(["inspect", "log.csv"]) == 0
    convert, identify = commands(capsys.readouterr().out)
    assert identify[0] == "identify"
    assert main([*convert, "--quiet"]) == 0
    record = Record.read(convert[-1]) if "--gaps" not in convert else None
    if record is not None:
        np.testing.assert_allclose(record.u[:1198], U[:1198], atol=2e-4)
        np.testing.assert_allclose(record.y[:1198] - record.y[0], Y[:1198] - Y[0], atol=2e-4)


@pytest.mark.parametrize(("header", "columns", "asked"), [
    ("a,b,c", (np.cos(T), U, Y), "give --time NAME"),
    ("t,u,enc_1,enc_2", (T, U, Y, Y + 1e-4 * np.sin(T)), "give --output 'enc_"),
    ("t,x,z", (T, U, np.random.default_rng(1).normal(size=1200)), "give --input NAME and --output NAME"),
])  # fmt: skip
def test_what_is_open_is_asked_for_by_option(
    tmp_path: Path,
    header: str,
    columns: tuple[np.ndarray, ...],
    asked: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = write(tmp_path / "log.csv", header, *columns)
    assert main(["inspect", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert asked in line


@pytest.mark.parametrize("step", [0.0001, 0.3, 5.0, 360 / 2**14])
def test_the_step_of_readings(step: float) -> None:
    """That of an encoder is found in its readings, and none in numbers that have none."""
    readings = step * np.round(np.random.default_rng(2).normal(0, 50, 3000))
    assert quantisation_step(readings) == pytest.approx(step, rel=1e-4)
    assert quantisation_step(np.random.default_rng(3).normal(size=3000)) is None


@pytest.mark.parametrize(("header", "columns", "option"), [
    ("t,u,y", (T, Y, U), "--input y --output u"),
    ("t,u,y", (T, U, -Y), "--reverse"),
    ("t,u [deg/s],y [h]", (T, U, Y / 15), "--output-unit deg"),
    ("t,u,y", (T, U, np.where(np.arange(1200) < 900, Y + 0.01, Y[900] + 0.01)), "--part 0 45"),
    ("t,u,y", (T, np.concatenate([[0.0], np.cumsum(U[:-1]) / 20]), Y), "--input-position u"),
])  # fmt: skip
def test_what_one_option_mends_is_mended_in_the_command(
    tmp_path: Path,
    header: str,
    columns: tuple[np.ndarray, ...],
    option: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Not the command that would be refused."""
    path = write(tmp_path / "log.csv", header, *columns)
    assert main(["inspect", str(path)]) == 0
    convert, _ = commands(capsys.readouterr().out)
    assert option in shlex.join(convert)
    out = str(tmp_path / "out.csv")
    assert main([*convert[:-1], out, "--quiet"]) == 0
    if option not in ("--output-unit deg", "--input-position u"):
        assert main(["convert", str(path), "--out", out]) == 0
        assert f"next: bayes-hw convert {path} {option} --out {out}" in capsys.readouterr().out


@pytest.mark.parametrize(("header", "columns", "right"), [
    ("t [s],u [deg/s],y [deg]", (T, U, np.radians(Y)), "--output-unit rad --ignore-units"),
    ("t,u,y", (T / 60, U, Y), "--time-unit min"),
])  # fmt: skip
def test_what_may_be_several_units_has_a_command_for_each(
    tmp_path: Path,
    header: str,
    columns: tuple[np.ndarray, ...],
    right: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The right one among them reads the record without a question."""
    path = write(tmp_path / "log.csv", header, *columns)
    assert main(["inspect", str(path)]) == 2
    found = [one for one in commands(capsys.readouterr().out) if right in shlex.join(one)]
    assert len(found) == 1
    assert main([*found[0][:-1], str(tmp_path / "out.csv")]) == 0
    shown = capsys.readouterr()
    assert "warning" not in shown.err and "next: bayes-hw report" in shown.out


@pytest.mark.parametrize(("columns", "asked"), [
    ((T, U, np.radians(Y)), "--output-unit 'rad'"),
    ((T / 60, U, Y), "--time-unit min"),
    ((10 * T, U, Y), "--sample-rate 20"),
    ((T, U, 12 + 0 * Y), "'y' is 12 throughout"),
    ((T[:1], U[:1], Y[:1]), "1 rows of data"),
])  # fmt: skip
def test_what_would_be_refused_is_asked_about(
    tmp_path: Path, columns: tuple[np.ndarray, ...], asked: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "log.csv", "t,u,y", *columns)
    assert main(["inspect", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert asked in line


def test_a_file_with_a_clock_of_its_own_is_joined(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = write(tmp_path / "log.csv", "t,demand", T, U)
    other = write(tmp_path / "other.csv", "t,angle", T + 0.013, Y)
    assert main(["inspect", str(log), "--join", str(other)]) == 0
    convert, _ = commands(capsys.readouterr().out)
    assert convert[-2:][0] == "--out"
    assert "--output angle" in shlex.join(convert)
    assert "--join" in convert


def test_the_clock_of_the_output_is_found_beside_that_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "log.csv", "t_cmd,cmd,t_enc,enc", T, U, T + 0.013, Y)
    assert main(["inspect", str(path)]) == 0
    convert, _ = commands(capsys.readouterr().out)
    assert "--output-time t_enc" in shlex.join(convert)


def test_counts_without_their_worth_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "log.csv", "t,u [deg/s],enc [counts]", T, U, np.round(1e4 * Y))
    assert main(["inspect", str(path)]) == 0
    assert "say what one is worth" in capsys.readouterr().out


def log_of(kind: str) -> Path:
    path = Path(f"log.{kind}")
    columns = {"t": T, "u": U, "y": Y}
    if kind == "h5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file[name] = values
    elif kind == "mat":
        pytest.importorskip("scipy.io").savemat(path, columns)
    else:
        pytest.importorskip("pyarrow")
        pytest.importorskip("pandas").DataFrame(columns).to_parquet(path)
    return path


@pytest.mark.parametrize("kind", [pytest.param("h5", marks=pytest.mark.slow), "mat", "parquet"])
def test_a_file_that_is_no_text_is_looked_into_too(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    path = log_of(kind)
    assert main(["inspect", str(path)]) == 0
    convert, _ = commands(capsys.readouterr().out)
    assert main([*convert, "--quiet"]) == 0
    np.testing.assert_allclose(Record.read(convert[-1]).u, U, atol=1e-9)


def hdf5_clocks(path: Path) -> Path:
    """The angle twice as often as the command, its clock begun at another moment."""
    with h5py.File(path.with_suffix(".h5"), "w") as file:
        twice = np.arange(2 * len(T) - 40) / 40 + 0.1
        file["axis/cmd/time"], file["axis/cmd/value"] = 1.773e9 + T, U
        file["axis/enc/time"], file["axis/enc/value"] = 1.773e9 + twice, np.interp(twice, T, Y)
    return path.with_suffix(".h5")


def tdms_waves(path: Path) -> Path:
    nptdms = pytest.importorskip("nptdms")
    wave = {"wf_increment": 0.05}
    with nptdms.TdmsWriter(path.with_suffix(".tdms")) as writer:
        writer.write_segment(
            [nptdms.ChannelObject("az", "cmd", U, wave), nptdms.ChannelObject("az", "enc", Y, wave)]
        )
    return path.with_suffix(".tdms")


def bag_without_headers(path: Path) -> Path:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    number, vector = store.types["std_msgs/msg/Float64"], store.types["std_msgs/msg/Float64MultiArray"]
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    with rosbag2.Writer(path, version=9) as writer:
        cmd = writer.add_connection("/cmd", number.__msgtype__, typestore=store)
        state = writer.add_connection("/state", vector.__msgtype__, typestore=store)
        for t, u, y in zip(T, U, Y, strict=True):
            stamp = 1_773_000_000_000_000_000 + round(1e9 * t)
            writer.write(cmd, stamp, store.serialize_cdr(number(float(u)), number.__msgtype__))
            message = vector(layout, np.array([float(y), 0.3]))
            writer.write(state, stamp, store.serialize_cdr(message, vector.__msgtype__))
    return path


@pytest.mark.parametrize(
    "write_log",
    [
        pytest.param(hdf5_clocks, marks=pytest.mark.slow),
        tdms_waves,
        pytest.param(bag_without_headers, marks=pytest.mark.slow),
    ],
)
def test_signals_with_clocks_of_their_own(
    tmp_path: Path,
    write_log: Callable[[Path], Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    path = write_log(Path("log"))
    assert main(["inspect", str(path)]) == 0
    out = capsys.readouterr().out
    assert "every signal has a clock of its own" in out
    assert "state[1]', 1" not in out
    convert, _ = commands(out)
    assert main([*convert, "--quiet"]) == 0
    record = Record.read(convert[-1])
    first = round(record.t[0] * 20)
    assert len(record) > 1170
    np.testing.assert_allclose(record.u, U[first : first + len(record)], atol=1e-9)
    np.testing.assert_allclose(record.y - record.y[0], (Y - Y[first])[first : first + len(record)], atol=2e-3)


def sexagesimal(angle: float) -> str:
    minutes = 60 * angle
    return f"{int(angle)}:{int(minutes) % 60:02d}:{60 * (minutes - int(minutes)):08.5f}"


def annotated(path: Path) -> None:
    stamps = [f"2026-03-01T12:00:{t:09.6f}Z" if t < 60 else "" for t in T]
    head = "#datatype,string,long,dateTime:RFC3339,double,string\n#group,false,false,false,false,true\n"
    lines = [
        f",,{number},{stamp},{value:.6f},{field}"
        for number, (field, values) in enumerate((("demand", U), ("actual", Y)))
        for stamp, value in zip(stamps, values, strict=True)
        if stamp
    ]
    path.write_text(head + ",result,table,_time,_value,_field\n" + "\n".join(lines) + "\n")


def by_turns(path: Path) -> None:
    rows = [
        f"{t:.2f},{name},{v:.6f}" for t, u, y in zip(T, U, Y, strict=True) for name, v in (("u", u), ("y", y))
    ]
    path.write_text("time,signal,value\n" + "\n".join(rows) + "\n")


def in_words(path: Path) -> None:
    rows = [f"{t:.2f},{u:.6f} deg/s,{sexagesimal(100 + y)}" for t, u, y in zip(T, U, Y, strict=True)]
    path.write_text("t,demand,actual\n" + "\n".join(rows) + "\n")


def framed(path: Path) -> None:
    """As tables of Markdown and of data bases are printed."""
    rows = [f"| {t:.2f} | {u:.6f} | {100 + y:.6f} |" for t, u, y in zip(T, U, Y, strict=True)]
    path.write_text("\n".join(["| t | demand | actual |", "|---|---|---|", *rows]) + "\n")


@pytest.mark.parametrize("write_log", [annotated, by_turns, in_words, framed])
def test_logs_of_other_forms_are_looked_into(
    tmp_path: Path,
    write_log: Callable[[Path], None],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    write_log(Path("log.csv"))
    assert main(["inspect", "log.csv"]) == 0
    convert, _ = commands(capsys.readouterr().out)
    assert main([*convert, "--quiet"]) == 0
    record = Record.read(convert[-1])
    np.testing.assert_allclose(record.u, U[: len(record)], atol=1e-6)
    np.testing.assert_allclose(record.y - record.y[0], (Y - Y[0])[: len(record)], atol=1e-6)


def test_several_files_one_after_the_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [str(write(tmp_path / f"{name}.csv", "t,u,y", T, U, Y)) for name in ("one", "two")]
    assert main(["inspect", *paths]) == 0
    out = capsys.readouterr().out
    assert [command[1] for command in commands(out)] == [path for path in paths for _ in range(2)]


def test_rows_are_counted_as_where_one_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The last row of the extent is that of the file's last line, and a gap is named in the same count."""
    kept = np.delete(np.arange(1200), 700)
    path = write(tmp_path / "log.csv", "t,u,y", T[kept], U[kept], Y[kept])
    assert main(["inspect", str(path)]) == 0
    out = capsys.readouterr().out
    assert "3 columns, 1199 rows of values, row 2 to row 1200 of the file" in out
    assert "row 702: time step changes" in out
    lines = path.read_text().splitlines()
    assert lines[702 - 1].startswith(f"{T[701]:.9g},") and len(lines) == 1200


def test_step_of_the_encoder_beneath_finer_decimals() -> None:
    """Degrees of 0.001, read as rad with eight decimals."""
    rng = np.random.default_rng(1)
    angle = 134 + np.cumsum(0.2 * np.sin(T)) / 20 + 0.0012 * rng.standard_normal(len(T))
    step = np.deg2rad(0.001)
    printed = np.round(np.round(np.deg2rad(angle) / step) * step, 8)
    assert quantisation_step(printed) == pytest.approx(step, rel=1e-3)
