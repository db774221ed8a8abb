"""One axis in many spellings: separators, decimal signs, headers, units, stamps, zones, gaps; the same
numbers."""

from __future__ import annotations

import datetime as dt
import json
from collections.abc import Callable
from pathlib import Path
from typing import Literal
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.log.clock import read_stamps
from bayes_hw.reading_options import Columns, ReadingOptions
from bayes_hw.record import Record

RATE_HZ = 20.0
SAMPLES = 400
K = np.arange(SAMPLES)
T = np.round(K / RATE_HZ, 6)
U = np.round(0.5 * np.sin(0.9 * T) + 0.2 * np.sin(4.1 * T), 6)
Y = np.round(np.cumsum(U) / RATE_HZ, 6)
START = dt.datetime(2026, 3, 14, 22, 41, 7, tzinfo=dt.UTC)
EPOCH = round(START.timestamp())

any_file = settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def moments(zone: dt.tzinfo | None = dt.UTC) -> list[dt.datetime]:
    return [(START + dt.timedelta(milliseconds=50 * int(k))).astimezone(zone) for k in K]


def iso(
    separator: str, fraction: Callable[[dt.datetime], str], zone: str, offset_h: float = 0.0
) -> list[str]:
    local = moments(dt.timezone(dt.timedelta(hours=offset_h)))
    return [f"{m:%Y-%m-%d}{separator}{m:%H:%M:%S}{fraction(m)}{zone}" for m in local]


def milliseconds(moment: dt.datetime) -> str:
    return f".{moment.microsecond // 1000:03d}"


def shortest(moment: dt.datetime) -> str:
    """As many programs write them: no fraction where it is zero."""
    return f".{moment.microsecond // 1000:03d}".rstrip("0").rstrip(".")


STAMPS: dict[str, list[str]] = {
    "s": [f"{t:.6f}" for t in T],
    "s_short": [f"{t:g}" for t in T],
    "unix_s": [f"{EPOCH + t:.6f}" for t in T],
    "unix_ms": [str(1000 * EPOCH + 50 * int(k)) for k in K],
    "unix_us": [str(10**6 * EPOCH + 50_000 * int(k)) for k in K],
    "unix_ns": [str(10**9 * EPOCH + 50_000_000 * int(k)) for k in K],
    "iso_z": iso("T", milliseconds, "Z"),
    "iso_blank": iso(" ", milliseconds, ""),
    "iso_offset": iso("T", milliseconds, "+02:00", 2),
    "iso_half_hour": iso(" ", milliseconds, "+0530", 5.5),
    "iso_no_fraction": iso("T", shortest, "Z"),
    "iso_ns": iso("T", lambda m: f".{m.microsecond * 1000:09d}", "Z"),
    "iso_utc": iso(" ", milliseconds, " UTC"),
    "matlab": [f"{m:%d-%b-%Y %H:%M:%S}{milliseconds(m)}" for m in moments()],
    "matlab_duration": [f"{t:g} sec" for t in T],
    "ctime": [f"{m:%a %b %d %H:%M:%S}{milliseconds(m)} {m:%Y}" for m in moments()],
    "date": [f"{m:%a %b %d %H:%M:%S}{milliseconds(m)} UTC {m:%Y}" for m in moments()],
    "mail": [f"{m:%a %d %b %Y %H:%M:%S}{milliseconds(m)} +0000" for m in moments()],
    "web_server": [f"{m:%d/%b/%Y:%H:%M:%S}{milliseconds(m)} +0000" for m in moments()],
    "named_half_day": [f"{m:%B %d %Y %I:%M:%S}{milliseconds(m)} {m:%p}" for m in moments()],
    "year_first": [f"{m:%Y-%b-%d %H:%M:%S}{milliseconds(m)}" for m in moments()],
    "slashes": [f"{m:%d/%m/%Y %H:%M:%S}{milliseconds(m)}" for m in moments()],
    "american": [f"{m:%m/%d/%Y %I:%M:%S}{milliseconds(m)} {m:%p}" for m in moments()],
    "dots": [f"{m:%d.%m.%Y %H:%M:%S}{milliseconds(m)}" for m in moments()],
    "time_of_day": [
        f"{m:%H:%M:%S}{milliseconds(m)}" for m in moments(dt.timezone(dt.timedelta(hours=1.315)))
    ],
    "day_of_year": [f"{m:%Y-%jT%H:%M:%S}{milliseconds(m)}" for m in moments()],
    "mjd": [f"{40587 + (EPOCH + t) / 86400:.11f}" for t in T],
    "julian": [f"{2440587.5 + (EPOCH + t) / 86400:.11f}" for t in T],
    "datenum": [f"{719529 + (EPOCH + t) / 86400:.11f}" for t in T],
    "file_time": [str(10**7 * (EPOCH + 11_644_473_600) + 500_000 * int(k)) for k in K],
}
TIME_NAMES = {"mjd": "MJD", "julian": "jd"}
COARSE = {"mjd": 1e-6, "julian": 5e-5, "datenum": 1e-5, "unix_s": 1e-6}


def assert_same(record: Record, tolerance_s: float = 1e-9) -> None:
    np.testing.assert_allclose(record.t - record.t[0], T, atol=tolerance_s)
    np.testing.assert_allclose(record.u, U, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(record.y, Y, rtol=1e-12, atol=1e-12)
    assert record.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-6)


def table(
    stamps: list[str],
    *,
    separator: str = ",",
    decimal: str = ".",
    header: tuple[str, ...] | None = ("time", "u", "y"),
    units: tuple[str, ...] = (),
    before: str = "",
    end: str = "\n",
    encoding: str = "utf-8",
    u: np.ndarray = U,
    y: np.ndarray = Y,
) -> bytes:
    def number(value: float) -> str:
        return "" if np.isnan(value) else f"{value:.9f}".replace(".", decimal)

    lines = [separator.join(header)] if header else []
    lines += [separator.join(units)] if units else []
    lines += [
        separator.join(
            [stamp.replace(".", decimal) if stamp.replace(".", "").isdigit() else stamp, number(a), number(b)]
        )
        for stamp, a, b in zip(stamps, u, y, strict=True)
    ]
    return (before + end.join(lines) + end).encode(encoding)


def read(path: Path, content: bytes, **options: object) -> Record:
    path.write_bytes(content)
    options.setdefault("columns", Columns("time"))
    return Record.read(path, options=ReadingOptions(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", STAMPS)
def test_every_kind_of_stamp(tmp_path: Path, kind: str) -> None:
    name = TIME_NAMES.get(kind, "time")
    content = table(STAMPS[kind], header=(name, "u", "y"))
    assert_same(read(tmp_path / "log.csv", content, columns=Columns(name)), COARSE.get(kind, 1e-9))


KINDS = ["s", "unix_ms", "unix_ns", "iso_z", "iso_blank", "matlab", "slashes", "iso_offset"]
LAYOUTS = [(",", "."), (";", "."), ("\t", "."), ("|", "."), (";", ","), ("\t", ","), ("  ", "."), (", ", ".")]
PREAMBLES = [
    *("", "# a night\n", "% one\n%\n% two: 3\n", "; x\n; y\n", "Operator: nobody\nRate: 20 Hz\n\n"),
    *("Drive log\nDate,2026-03-14\n", "// c\n", "[Header]\nversion = 1.2\n[Data]\n"),
]
HEADERS = [
    *(("time", "u", "y"), ("Time [s]", "u [deg/s]", "y [deg]"), ("time", "u (deg/s)", "y (deg)")),
    *(("TIME", "U", "Y"), ("time_s", "u_deg_s", "y_deg")),
]


@any_file
@given(
    kind=st.sampled_from(KINDS),
    layout=st.sampled_from(LAYOUTS),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    before=st.sampled_from(PREAMBLES),
    header=st.sampled_from(HEADERS),
    units=st.sampled_from([(), ("s", "deg/s", "deg"), ("[s]", "[deg/s]", "[deg]"), ("-", "deg/s", "deg")]),
)  # fmt: skip
def test_every_layout(
    tmp_path: Path,
    kind: str,
    layout: tuple[str, str],
    end: str,
    encoding: str,
    before: str,
    header: tuple[str, ...],
    units: tuple[str, ...],
) -> None:
    separator, decimal = layout
    if separator == "  ":
        header, units = tuple(name.replace(" ", "") for name in header), tuple(filter(None, units))
    if "s" not in (kind, units[:1] and kind):
        header, units = ("time", *header[1:]), (("-", *units[1:]) if units else ())
    content = table(
        STAMPS[kind], separator=separator, decimal=decimal, header=header, units=units, before=before,
        end=end,
        encoding=encoding,
    )  # fmt: skip
    name = "time" if header[0] != "TIME" else "TIME"
    record = read(tmp_path / "log.csv", content, columns=Columns(name, "u", "y"))
    assert_same(record)


@pytest.mark.parametrize("separator", [" ", "   ", "\t", ",", ";"])
@pytest.mark.parametrize("kind", ["s", "unix_ms", "iso_z"])
def test_without_a_header_columns_have_numbers(tmp_path: Path, separator: str, kind: str) -> None:
    content = table(STAMPS[kind], separator=separator, header=None, before="# no names here\n")
    assert_same(read(tmp_path / "log.txt", content, columns=Columns("1", "2", "3")))


@pytest.mark.parametrize("mark", ["#", "%", "# ", "% "])
def test_a_header_in_a_comment(tmp_path: Path, mark: str) -> None:
    content = table(STAMPS["s"], separator=" ", header=None, before=f"{mark}made by hand\n{mark}time u y\n")
    assert_same(read(tmp_path / "log.dat", content))


@pytest.mark.parametrize(("header", "factor_u", "factor_y"), [
    (("time", "u [rad/s]", "y [rad]"), np.pi / 180, np.pi / 180),
    (("time", "u (deg/s)", "y (arcsec)"), 1, 3600),
    (("time", "u [arcmin/s]", "y [arcmin]"), 60, 60),
    (("time", "u [mrad/s]", "y [mrad]"), np.pi / 0.18, np.pi / 0.18),
    (("time", "u [rpm]", "y [rev]"), 1 / 6, 1 / 360),
    (("time", "u_deg_s", "y_arcsec"), 1, 3600),
    (("time", "u, deg/s", "y, rad"), 1, np.pi / 180),
    (("time", "u [°/s]", "y [°]"), 1, 1),
    (("time", "u [deg/sec]", "y [degrees]"), 1, 1),
    (("time", "u [arcsec/s]", "y [″]"), 3600, 3600),
    (("time", "u [deg s^-1]", "y [hourangle]"), 1, 1 / 15),
    (("time", "u [arcsec/s]", "y [h]"), 3600, 1 / 15),
    (("time", "u / (deg/s)", "y / arcsec"), 1, 3600),
    (("time", "u [deg/s]", "y [0.01 deg]"), 1, 100),
])  # fmt: skip
def test_units_are_converted(
    tmp_path: Path, header: tuple[str, ...], factor_u: float, factor_y: float
) -> None:
    path = tmp_path / "log.csv"
    rows = [
        f"{t!r};{u!r};{y!r}"
        for t, u, y in zip(T.tolist(), (factor_u * U).tolist(), (factor_y * Y).tolist(), strict=True)
    ]
    path.write_text(";".join(header) + "\n" + "\n".join(rows))
    options = ReadingOptions(Columns("time"), units={"input": "deg/s", "output": "deg"})
    assert_same(Record.read(path, options=options))


@pytest.mark.parametrize(
    ("unit", "scale"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9), ("min", 1 / 60), ("h", 1 / 3600)]
)
@pytest.mark.parametrize("form", ["time [{}]", "time ({})", "time_{}", "time, {}"])
def test_units_of_time(tmp_path: Path, unit: str, scale: float, form: str) -> None:
    if unit == "h" and "_" in form:
        return
    path = tmp_path / "log.csv"
    rows = [
        f"{t!r};{u!r};{y!r}" for t, u, y in zip((scale * T).tolist(), U.tolist(), Y.tolist(), strict=True)
    ]
    path.write_text(f"{form.format(unit)};u;y\n" + "\n".join(rows))
    assert_same(Record.read(path, options=ReadingOptions(Columns("time"))), 1e-6)


@pytest.mark.slow
@any_file
@given(
    missing=st.sets(st.integers(10, SAMPLES - 10), min_size=1, max_size=30),
    style=st.sampled_from(["rows", "", "NaN", "NULL", "nan", "N/A"]),
    kind=st.sampled_from(["s", "unix_ns", "iso_z"]),
)
def test_single_samples_that_are_missing_are_bridged(
    tmp_path: Path, missing: set[int], style: str, kind: str
) -> None:
    """However many, as long as no more than three follow each other."""
    out = np.zeros(SAMPLES, dtype=bool)
    for k in missing:
        if out[k - 3 : k].sum() < 3 and not out[k : k + 4].any():
            out[k] = True
    content = table(STAMPS[kind], y=np.where(out, np.nan, Y)).decode()
    lines = content.splitlines()
    if style == "rows":
        lines = [line for line, gone in zip(lines, [False, *out], strict=True) if not gone]
    else:
        lines = [line + style if gone else line for line, gone in zip(lines, [False, *out], strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"gaps=\"bridge\""):
        Record.read(path, options=ReadingOptions(Columns("time")))
    record = Record.read(path, options=ReadingOptions(Columns("time"), gaps="bridge"))
    np.testing.assert_array_equal(record.measured_samples, ~out)
    np.testing.assert_allclose(record.t - record.t[0], T, atol=1e-9)
    np.testing.assert_allclose(record.y[~out], Y[~out], atol=1e-12)
    written = tmp_path / "out.csv"
    record.write(written)
    again = Record.read(written, options=ReadingOptions(gaps="bridge"))
    np.testing.assert_array_equal(again.measured_samples, ~out)


@any_file
@given(
    cuts=st.lists(
        st.tuples(st.integers(1, 9), st.integers(4, 15)), min_size=1, max_size=4, unique_by=lambda c: c[0]
    )
)
def test_gaps_make_records(tmp_path: Path, cuts: list[tuple[int, int]]) -> None:
    keep = np.ones(SAMPLES, dtype=bool)
    for place, length in cuts:
        keep[40 * place : 40 * place + length] = False
    rows = [
        row
        for row, kept in zip(table(STAMPS["unix_ms"]).decode().splitlines(), [True, *keep], strict=True)
        if kept
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(rows))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], keep.astype(int), [0]])))
    parts = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 32]
    for gaps in ("split", "bridge"):
        records = Record.read_all(path, ReadingOptions(Columns("time"), gaps=gaps))
        assert len(records) == len(parts)
        for record, (a, b) in zip(records, parts, strict=True):
            np.testing.assert_allclose(record.y, Y[a:b])
            np.testing.assert_allclose(record.t, T[a:b] - T[a], atol=1e-9)
            assert record.measured is None and record.sample_rate_hz == RATE_HZ


@any_file
@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([0.02, 0.1, 0.3]), lost=st.booleans())
def test_jitter_below_a_third_of_a_step_is_taken_for_a_grid(
    tmp_path: Path, seed: int, size: float, lost: bool
) -> None:
    rng = np.random.default_rng(seed)
    t = T + size / RATE_HZ * rng.uniform(-1, 1, SAMPLES)
    keep = np.ones(SAMPLES, dtype=bool)
    if lost:
        keep[rng.integers(5, SAMPLES - 5, 5)] = False
    path = tmp_path / "log.csv"
    path.write_text(
        "t,u,y\n" + "".join(f"{a:.6f},{b},{c}\n" for a, b, c, k in zip(t, U, Y, keep, strict=True) if k)
    )
    record = Record.read(path, options=ReadingOptions(gaps="bridge"))
    assert record.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-3)
    np.testing.assert_array_equal(record.measured_samples, keep)
    np.testing.assert_allclose(np.diff(record.t), 1 / record.sample_rate_hz, rtol=1e-9)
    assert any("off a uniform grid" in said for said in record.treatment)


def test_repeated_rows_are_dropped_and_said_and_contradictions_refused(tmp_path: Path) -> None:
    lines = table(STAMPS["iso_z"]).decode().splitlines()
    doubled = [*lines[:50], lines[49], *lines[50:200], *lines[150:200], *lines[200:]]
    record = read(tmp_path / "log.csv", "\n".join(doubled).encode())
    assert_same(record)
    assert any("51 rows dropped that repeat" in said and "row 51" in said for said in record.treatment)
    stamp, u, _ = lines[49].split(",")
    doubled[50] = f"{stamp},{u},77"
    with pytest.raises(InputError, match=r"row 51: time stamp repeats .* with other values"):
        read(tmp_path / "log.csv", "\n".join(doubled).encode())


@pytest.mark.parametrize("turn", [360.0, 2 * np.pi, 1_296_000.0, 4096.0])
@pytest.mark.parametrize("centred", [False, True])
def test_wrapped_angles(tmp_path: Path, turn: float, centred: bool) -> None:
    y = turn * ((0.49 if centred else 0.99) + 0.05 * Y)
    wrapped = (y + turn / 2) % turn - turn / 2 if centred else y % turn
    path = tmp_path / "log.csv"
    path.write_text(
        "t,u,y\n"
        + "".join(
            f"{a!r},{b!r},{c!r}\n" for a, b, c in zip(T.tolist(), U.tolist(), wrapped.tolist(), strict=True)
        )
    )
    with pytest.raises(InputError, match=r"jumps from .* it wraps at .*give options=ReadingOptions\(unwrap"):
        Record.read(path)
    record = Record.read(path, options=ReadingOptions(unwrap=turn))
    np.testing.assert_allclose(record.y, y - y[0], atol=1e-9 * turn)


@pytest.mark.parametrize("unit", ["deg", "arcsec", "rad"])
def test_a_turn_is_in_the_unit_of_the_file(tmp_path: Path, unit: str) -> None:
    """Whatever the angle is converted to: 90 deg/s at 20 Hz are 16,200 arcsec a sample. A turn that leaves
    jumps is refused."""
    y = 350 + 100 * Y
    path = tmp_path / "log.csv"
    path.write_bytes(table(STAMPS["s"], header=("time", "u [deg/s]", "y [deg]"), u=100 * U, y=y % 360))
    options = ReadingOptions(columns=Columns("time"), unwrap=360, units={"output": unit})
    worth = {"deg": 1.0, "arcsec": 3600.0, "rad": np.pi / 180}[unit]
    found = Record.read(path, options=options)
    np.testing.assert_allclose(found.y, (y - y[0]) * worth, atol=2e-9 * worth)
    with pytest.raises(InputError, match=r"jumps from .* it wraps at 360 deg"):
        Record.read(path, options=ReadingOptions(columns=Columns("time"), unwrap=1_296_000))


@pytest.mark.parametrize("kinds", [("s", "s"), ("unix_ms", "iso_z"), ("iso_offset", "unix_ns")])
def test_a_second_clock_is_joined(tmp_path: Path, kinds: tuple[str, str]) -> None:
    shift = 7
    first = "\n".join(["time,demand", *(f"{a},{b}" for a, b in zip(STAMPS[kinds[0]], U, strict=True))])
    second = ["stamp;time;actual", *(f"x;{a};{b}" for a, b in zip(STAMPS[kinds[1]], Y, strict=True))]
    (tmp_path / "u.csv").write_text(first)
    (tmp_path / "y.csv").write_text("\n".join(second[:1] + second[1 + shift :]))
    options = ReadingOptions(Columns("time", "demand", "actual"), join=(tmp_path / "y.csv",))
    record = Record.read(tmp_path / "u.csv", options=options)
    np.testing.assert_allclose(record.y, Y[shift:], atol=1e-9)
    np.testing.assert_allclose(record.u, U[shift:], atol=1e-9)
    with pytest.raises(InputError, match="no column 'actual' for the output"):
        Record.read(tmp_path / "u.csv", options=ReadingOptions(Columns("time", "demand", "actual")))


def test_known_signals_and_parts_and_signs(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "t,u,y,wind [m/s]\n" + "".join(f"{a},{b},{c},{a * 2}\n" for a, b, c in zip(T, U, Y, strict=True))
    )
    record = Record.read(path, options=ReadingOptions(known=("wind",), part_s=(5.0, 15.0), reverse=True))
    np.testing.assert_allclose(record.known["wind"], 2 * T[100:300])
    np.testing.assert_allclose(record.y, -Y[100:300])
    assert record.known_units == {"wind": "m/s"}


@pytest.mark.parametrize("form", ["influx", "influx_iso", "series", "records", "columns", "lines", "nested"])
def test_json(tmp_path: Path, form: str) -> None:
    ns = [int(stamp) for stamp in STAMPS["unix_ns"]]
    rows = [list(row) for row in zip(ns, U.tolist(), Y.tolist(), strict=True)]
    if form in ("influx", "influx_iso"):
        values = (
            rows
            if form == "influx"
            else [[s, *row[1:]] for s, row in zip(STAMPS["iso_no_fraction"], rows, strict=True)]
        )
        content: object = {
            "results": [
                {"series": [{"name": "m", "columns": ["time", "demand", "actual"], "values": values}]}
            ]
        }
    elif form == "series":
        content = {"results": [{"series": [
            {"name": "demand", "columns": ["time", "value"], "values": [row[:2] for row in rows]},
            {"name": "actual", "columns": ["time", "value"], "values": [[row[0], row[2]] for row in rows]},
        ]}]}  # fmt: skip
    elif form == "columns":
        content = {"time": ns, "demand": U.tolist(), "actual": Y.tolist()}
    else:
        content = [dict(zip(("time", "demand", "actual"), row, strict=True)) for row in rows]
    if form == "nested":
        content = {"status": "ok", "data": content}
    text = "\n".join(map(json.dumps, content)) if form == "lines" else json.dumps(content)
    (tmp_path / "log.json").write_text(text)
    assert_same(
        Record.read(tmp_path / "log.json", options=ReadingOptions(Columns("time", "demand", "actual")))
    )


def test_annotated_csv(tmp_path: Path) -> None:
    head = (
        "#datatype,string,long,dateTime:RFC3339,double,string,string\r\n#group,false,false,false,false,true,true\r\n"
        "#default,_result,,,,,\r\n,result,table,_time,_value,_field,_measurement\r\n"
    )
    blocks = [
        head
        + "".join(
            f",,{i},{stamp},{value},{name},mount\r\n"
            for stamp, value in zip(STAMPS["iso_z"], values, strict=True)
        )
        for i, (name, values) in enumerate((("demand", U), ("actual", Y)))
    ]
    (tmp_path / "log.csv").write_text("\r\n".join(blocks), newline="")
    assert_same(
        Record.read(tmp_path / "log.csv", options=ReadingOptions(Columns("_time", "demand", "actual")))
    )


@any_file
@given(
    content=st.binary(max_size=300),
    head=st.sampled_from([b"t,u,y\n", b"[1, ", b'{"results": [', b"#datatype\n", b"", b"SIMPLE"]),
    suffix=st.sampled_from([".csv", ".txt", ".json", ".fits", ".tdms"]),
    gaps=st.sampled_from(["refuse", "split", "bridge"]),
)
def test_anything_is_read_or_refused_in_one_line(
    tmp_path: Path, content: bytes, head: bytes, suffix: str, gaps: str
) -> None:
    path = tmp_path / f"log{suffix}"
    path.write_bytes(head + content)
    with pytest.raises(InputError) as caught:
        Record.read_all(path, ReadingOptions(gaps=gaps))  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("mark", ["-", "---", "#N/A", "#VALUE!", "N/A", "null"])
def test_marks_of_nothing_are_unmeasured(tmp_path: Path, mark: str) -> None:
    lines = table(STAMPS["s"]).decode().splitlines()
    lines[101] = lines[101].rsplit(",", 1)[0] + f",{mark}"
    record = read(tmp_path / "log.csv", "\n".join(lines).encode(), gaps="bridge")
    assert np.flatnonzero(~record.measured_samples).tolist() == [100]


def test_signs_and_exponents_of_other_programs(tmp_path: Path) -> None:
    """The typeset minus, and Fortran's D."""
    minus = table(STAMPS["s"]).decode().replace("-", "\u2212")
    assert_same(read(tmp_path / "minus.csv", minus.encode()))
    rows = [
        f"{t:.10e} {u:.10e} {y:.10e}".replace("e", "D")
        for t, u, y in zip(T.tolist(), U.tolist(), Y.tolist(), strict=True)
    ]
    record = read(tmp_path / "fortran.dat", ("time u y\n" + "\n".join(rows)).encode())
    np.testing.assert_allclose(record.y, Y, atol=1e-10)


@pytest.mark.parametrize("end", ["EOF", "Total samples: 400", "End of log"])
def test_a_line_after_the_last_row_is_no_row(tmp_path: Path, end: str) -> None:
    for kind in ("s", "iso_z"):
        assert_same(read(tmp_path / f"{kind}.csv", table(STAMPS[kind]) + f"{end}\n".encode()))


def test_a_row_of_types_is_no_row(tmp_path: Path) -> None:
    lines = table(STAMPS["s"]).decode().splitlines()
    assert_same(
        read(tmp_path / "log.csv", "\n".join([lines[0], "double,double,double", *lines[1:]]).encode())
    )


@pytest.mark.parametrize("kind", ["s", "unix_ms", "iso_z"])
def test_the_newest_first(tmp_path: Path, kind: str) -> None:
    header, *rows = table(STAMPS[kind]).decode().splitlines()
    record = read(tmp_path / "log.csv", "\n".join([header, *rows[::-1]]).encode())
    np.testing.assert_allclose(record.y, Y, atol=1e-12)
    assert any("newest stood first" in said for said in record.treatment)


def test_an_abbreviated_zone(tmp_path: Path) -> None:
    """Left out; two are a clock that went over to summer time, whose hour the option takes out."""
    assert_same(read(tmp_path / "log.csv", table(iso(" ", milliseconds, " CET"))))
    stamps = iso(" ", milliseconds, " CET", 1)
    stamps[200:] = iso(" ", milliseconds, " CEST", 2)[200:]
    with pytest.raises(
        InputError, match=r'row 202: the clock jumps forward by an hour.* give .*gaps="bridge"'
    ):
        read(tmp_path / "log.csv", table(stamps))
    assert_same(read(tmp_path / "log.csv", table(stamps), gaps="bridge"))


@pytest.mark.parametrize("start", [
    dt.datetime(2026, 3, 29, 0, 59, 50, tzinfo=dt.UTC),
    dt.datetime(2026, 10, 25, 0, 59, 50, tzinfo=dt.UTC),
    dt.datetime(2026, 7, 1, 21, 4, 7, tzinfo=dt.UTC),
])  # fmt: skip
@pytest.mark.parametrize("form", ["{} Europe/Berlin", "{}[Europe/Berlin]", "{}+{}[Europe/Berlin]"])
def test_a_zone_named_by_a_place(tmp_path: Path, start: dt.datetime, form: str) -> None:
    """The record is in UTC, also where summer time begins or ends within it."""
    local = [
        (start + dt.timedelta(milliseconds=50 * int(k))).astimezone(ZoneInfo("Europe/Berlin")) for k in K
    ]
    stamps = [form.format(f"{m:%Y-%m-%d %H:%M:%S}{milliseconds(m)}", f"{m:%z}"[1:3] + ":00") for m in local]
    assert_same(read(tmp_path / "log.csv", table(stamps)))
    assert read_stamps(np.array(stamps)).origin_ns == round(start.timestamp() * 1e9)


def test_a_place_without_a_zone_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"row 2, .*Nowhere/City' names a zone that is not known"):
        read(tmp_path / "log.csv", table(iso(" ", milliseconds, " Nowhere/City")))


@pytest.mark.parametrize(("header", "units"), [
    (("seconds", "deg/s", "deg"), ("deg/s", "deg")),
    (("time", "rpm", "rad"), ("rpm", "rad")),
    (("time", "deg/sec", "degrees"), ("deg/s", "deg")),
])  # fmt: skip
def test_columns_named_by_their_units(
    tmp_path: Path, header: tuple[str, ...], units: tuple[str, str]
) -> None:
    record = read(tmp_path / "log.csv", table(STAMPS["s"], header=header), columns=Columns(*header))
    assert_same(record)
    assert (record.units.input, record.units.output) == units


def test_a_name_that_is_a_unit_of_time(tmp_path: Path) -> None:
    hours = [f"{t / 3600:.12f}" for t in T]
    content = table(hours, header=("hours", "u", "y"))
    assert_same(read(tmp_path / "log.csv", content, columns=Columns("hours")), 1e-5)


@pytest.mark.parametrize("cut", [4, 9, 12])
def test_a_row_cut_off_in_its_midst_is_left_out_and_said(tmp_path: Path, cut: int) -> None:
    record = read(tmp_path / "log.csv", table(STAMPS["s"])[:-cut])
    np.testing.assert_allclose(record.y, Y[:-1], atol=1e-12)
    assert "the last row, cut off in its midst, left out" in record.treatment
    whole = read(tmp_path / "log.csv", table(STAMPS["s"])[:-1])
    assert_same(whole)


def test_json_under_another_ending(tmp_path: Path) -> None:
    rows = [{"time": float(t), "u": float(a), "y": float(b)} for t, a, b in zip(T, U, Y, strict=True)]
    assert_same(read(tmp_path / "log.txt", json.dumps(rows, indent=1).encode()))


@pytest.mark.parametrize("gaps", ["bridge", "split"])
@pytest.mark.parametrize("hour", [1, -1])
def test_summer_time_leaves_no_gap(tmp_path: Path, hour: int, gaps: Literal["bridge", "split"]) -> None:
    """Begun or ended within the log: one record, and a row that is missing besides is still missing."""
    content = table([*iso("T", milliseconds, "")[:150], *iso("T", milliseconds, "", hour)[150:]])
    with pytest.raises(InputError, match=r"row 152: the clock jumps .* by an hour.*ReadingOptions"):
        read(tmp_path / "log.csv", content)
    record = read(tmp_path / "log.csv", content, gaps=gaps)
    assert_same(record)
    assert any("row 152 taken out" in said for said in record.treatment)
    rows = content.splitlines(keepends=True)
    holed = read(tmp_path / "log.csv", b"".join(rows[:60] + rows[61:]), gaps="bridge")
    assert list(np.flatnonzero(~holed.measured_samples)) == [59]


def test_stamps_cut_to_whole_seconds_are_named_with_their_rate(tmp_path: Path) -> None:
    content = table(iso("T", lambda _: "", "Z"))
    with pytest.raises(InputError, match=r"cut to whole seconds, some 20 rows .* sample_rate_hz=20"):
        read(tmp_path / "log.csv", content)
    record = read(tmp_path / "log.csv", content, columns=Columns(None), sample_rate_hz=20.0)
    np.testing.assert_array_equal(record.y, Y)


@pytest.mark.parametrize(
    ("first", "said"), [(b"\x1f\x8b\x08", "gunzip"), (b"PK\x03\x04", "CSV"), (b"\x93NUMPY", "from_arrays")]
)
def test_files_that_are_no_text_say_what_they_are(tmp_path: Path, first: bytes, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(tmp_path / "log.csv", first + bytes(range(256)) * 4)
