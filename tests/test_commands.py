"""Bad input is refused in one line that names its place, with status 2, and leaves nothing behind."""

from __future__ import annotations

import json
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from command_files import changed_model, copied_axis, files_below
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from short_sampling import sample_shortly

from bayes_hw.cli import main
from bayes_hw.commands.estimate_files import band_file_names
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

NAN = float("nan")
MODEL_KEYS = [
    *("name", "sample_rate_hz", "units", "dominant_modes", "normalization"),
    *("saturation", "saturation.lower", "dead_zone", "dead_zone.half_width", "noise", "noise.sigma"),
    *("linear", "linear.zeros", "linear.poles", "linear.gain", "linear.delay_samples"),
]


@pytest.fixture(scope="module", autouse=True)
def _short_pilot() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        yield


@pytest.fixture
def folder(axis_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A model and three records, in the working folder."""
    monkeypatch.chdir(tmp_path)
    return copied_axis(axis_files, tmp_path)


@pytest.fixture
def refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Runs a command that must be refused; the line it says."""

    def run(*arguments: str) -> str:
        before = files_below(folder)
        assert main(arguments) == 2
        printed = capsys.readouterr()
        assert printed.out == ""
        (line,) = printed.err.splitlines()
        assert line.startswith("bayes-hw: error: ") and line.isprintable()
        assert files_below(folder) == before
        return line

    return run


def simulate(record: str = "train_1.csv", model: str = "model/model.json", *more: str) -> list[str]:
    return ["simulate", "--model", model, record, "--out", "new/run.csv", *more]


def lines_of(path: Path) -> list[str]:
    return path.read_text().splitlines()


def with_row(row: int, cells: str) -> Callable[[list[str]], list[str]]:
    return lambda lines: [*lines[: row - 1], cells, *lines[row:]]


def with_header(names: str) -> Callable[[list[str]], list[str]]:
    return lambda lines: [names, *lines[1:]]


def with_column(column: int, value: Callable[[int], str]) -> Callable[[list[str]], list[str]]:
    def change(lines: list[str]) -> list[str]:
        rows = [line.split(",") for line in lines]
        for k, row in enumerate(rows[1:]):
            row[column] = value(k)
        return [",".join(row) for row in rows]

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (with_header("t,command,command"), "no column 'u' for the input"),
        (with_row(7, "0.25,nan,0"), "row 7, column 'u': empty cell or NaN, so not measured"),
        (with_row(7, "0.25,0,fast"), "row 7, column 'y': 'fast' is not a finite number"),
        (with_row(7, "0.25,0,"), "row 7, column 'y': empty cell"),
        (with_row(7, "0.20,0,0"), "row 7: time stamp repeats 0.2"),
        (with_row(7, "0.28,0,0"), "row 7: time step changes"),
        (with_row(7, "0.25,0,1e13"), "row 7, column 'y': 1e+13 is beyond 1e+12"),
        (with_column(1, lambda _: "0.5"), "column 'u' is 0.5 throughout"),
        (with_column(2, lambda _: "0"), "column 'y' is 0 throughout"),
        (with_column(0, lambda k: str(50 * k)), "give times in s"),
        (with_column(0, lambda k: str(k / 25)), "sampled at 25 Hz but the model is for 20 Hz"),
        (lambda lines: lines[:20], "has 19 samples of the 32"),
        (lambda lines: lines[:1], "has 0 samples"),
        (lambda _: [], "is empty"),
    ],
)
def test_bad_record(
    refused: Callable[..., str], folder: Path, change: Callable[[list[str]], list[str]], said: str
) -> None:
    """Whatever the command; the line names the file and the row or column."""
    changed = change(lines_of(folder / "train_1.csv"))
    (folder / "bad.csv").write_text("".join(f"{line}\n" for line in changed))
    for command in (simulate("bad.csv"), ["sample", *simulate("bad.csv")[1:], "--quiet"]):
        line = refused(*command)
        assert "bad.csv" in line and said in line


def test_bad_record_among_good_ones(refused: Callable[..., str], folder: Path) -> None:
    """Found before any work begins, in training and hold-out records alike."""
    (folder / "bad.csv").write_text("t,u,y\n0,1,x\n")
    for arguments in (
        ["identify", "train_1.csv", "bad.csv"],
        ["identify", "train_1.csv", "--holdout", "bad.csv"],
        ["report", "train_1.csv", "--holdout", "bad.csv"],
    ):
        assert "bad.csv: row 2, column 'y'" in refused(*arguments, "--out", "new")


@pytest.mark.parametrize("record", ["missing.csv", ".", "line\nbreak\x1b]0;title\x07<b>#x.csv", "x" * 300])
def test_a_record_that_is_no_file(refused: Callable[..., str], record: str) -> None:
    assert "give a CSV" in (line := refused(*simulate(record))) or "cannot be read" in line


@pytest.mark.slow
def test_a_small_file_that_holds_a_large_variable(refused: Callable[..., str], folder: Path) -> None:
    """A .mat of 80 million zeros, packed into 80 kB, is not taken for a record."""
    zeros = np.zeros(40_000_000, np.int8)
    scipy.io.savemat(folder / "bomb.mat", {"u": zeros, "y": zeros}, do_compression=True)
    assert (folder / "bomb.mat").stat().st_size < 100_000
    counted = ("--time", "none", "--sample-rate", "20")
    assert "bomb.mat: has more than" in refused(*simulate("bomb.mat", "model/model.json", *counted))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"saturation.lower": NAN}, "saturation.lower: must be finite"),
        ({"saturation.upper": None}, "saturation.upper: missing or not a number"),
        ({"saturation.lower": 2}, "saturation: needs lower < 0 < upper"),
        ({"saturation": []}, "saturation: missing"),
        ({"linear.gain": 1e300}, "linear.gain: is beyond 1e+12"),
        ({"linear.gain": 10**400}, "linear.gain: is beyond 1e+12"),
        ({"linear.poles": [[1.1, 0], [0.5, 0], [0.2, 0]]}, "unstable, |pole| = 1.1"),
        ({"linear.poles": [[1, 0], [1, 0], [0.2, 0]]}, "2 poles on the unit circle"),
        ({"linear.poles": [[0.1, 0.2], [0, 0]]}, "conjugate pairs"),
        ({"linear.zeros": [[0.1, 0]] * 9}, "improper"),
        ({"linear.zeros": [[0.1]]}, "linear.zeros[0]: must be a pair"),
        ({"linear.poles": [[0.5, 0]] * 1000}, "linear.poles: has 1000 entries"),
        ({"linear.delay_samples": 1e9}, "linear.delay_samples: must be at most"),
        ({"linear.delay_samples": 0.5}, "linear.delay_samples: must be a whole number"),
        ({"linear": {"numerator": [0, 1]}}, "linear.denominator"),
        ({"linear": {"numerator": [1e-320, 1], "denominator": [1, 0.1]}}, "overflow"),
        ({"dead_zone.half_width": -1}, "dead_zone.half_width"),
        ({"noise.sigma": -1}, "noise.sigma"),
        ({"normalization": {"c4": 1}}, "normalization: unknown key 'c4'"),
        ({"units": {"inputs": "deg/s"}}, "units: unknown key 'inputs'"),
        ({"units": {"time": "ms"}}, "units.time: 'ms'"),
        ({"sample_rate_hz": 25, "dominant_modes": []}, "train_1.csv: sampled at 20 Hz"),
        ({"dominant_modes": [{"frequency_hz": 7, "damping_ratio": 0.1}]}, "dominant_modes[0]"),
        ({"dominant_modes": "two"}, "dominant_modes: a list was expected"),
    ],
)
def test_bad_model(refused: Callable[..., str], folder: Path, changes: dict[str, Any], said: str) -> None:
    line = refused(*simulate(model=changed_model(folder, changes).name))
    assert said in line
    assert "changed.json" in line or "train_1.csv" in line


@pytest.mark.parametrize(
    "content", [b"", b"{", b"hello", b"[1]", b"\xff\xfe", b"[" * 100_000, b'{"a": 1' + b"0" * 5000 + b"}"]
)
def test_a_model_that_is_no_json_object(refused: Callable[..., str], folder: Path, content: bytes) -> None:
    (folder / "bad.json").write_bytes(content)
    assert "bad.json: " in refused(*simulate(model="bad.json"))


SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    SCALARS | st.lists(SCALARS, max_size=3) | st.dictionaries(st.text(max_size=5), SCALARS, max_size=3),
    st.sampled_from(MODEL_KEYS),
)
def test_any_value_in_a_model_is_used_or_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], value: Any, key: str
) -> None:
    """No value under any key of model.json ends in a traceback or in half a file."""
    status = main(simulate(model=changed_model(folder, {key: value}).name))
    assert status in (0, 2)
    assert len(capsys.readouterr().err.splitlines()) == (1 if status else 0)
    (folder / "new" / "run.csv").unlink(missing_ok=status == 2)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--seed", "-1"], "--seed -1"),
        (["--jobs", "0"], "--jobs 0"),
        (["--ensembles", "2"], "--ensembles 2"),
        (["--walkers", "17"], "--walkers 17"),
        pytest.param(
            ["--walkers", "16", "--free", "all", "--start", "free"], "--walkers 16", marks=pytest.mark.slow
        ),
        (["--max-steps", "10"], "--max-steps 10"),
        (["--target-ess", "nan"], "--target-ess nan"),
        (["--resample", "0"], "--resample 0"),
        (["--resample", "nan"], "--resample nan"),
        (["--resample", "1e-6"], "--resample 1e-06"),
        (["--sample-rate", "-5"], "--sample-rate -5"),
        (["--sample-rate", "inf"], "--sample-rate inf"),
        (["--sample-rate", "30"], "the time stamps say 20 Hz"),
        (["--time", "none"], "give --sample-rate"),
        (["--input", "y"], "named twice"),
        (["--input", "velocity"], "no column 'velocity'"),
        (["--input-unit", "V"], "its input is in V, deg/s is asked for; 'V' cannot be converted"),
        (["--model", "missing.json"], "missing.json: cannot be read"),
        (["--out", ""], "--out"),
        (["--out", "train_1.csv"], "train_1.csv: is a file where a folder is to be"),
        (["--out", "train_1.csv/deep/er"], "train_1.csv: is a file where a folder is to be"),
    ],
)
def test_bad_option(refused: Callable[..., str], options: list[str], said: str) -> None:
    command = ["sample", "--model", "model/model.json", "train_1.csv", "--out", "new", "--quiet"]
    assert said in refused(*command, *options)


@pytest.mark.parametrize(
    ("out", "said"),
    [
        (".", ".: is a folder"),
        ("train_1.csv", "train_1.csv: would overwrite an input"),
        ("model/../model/model.json", "would overwrite an input"),
        ("train_1.csv/run.csv", "is a file where a folder is to be"),
    ],
)
def test_bad_output_file(refused: Callable[..., str], out: str, said: str) -> None:
    assert said in refused(*simulate(), "--out", out)


@pytest.mark.parametrize("content", [None, b"", b"not a file of HDF5"])
def test_bad_posterior(refused: Callable[..., str], folder: Path, content: bytes | None) -> None:
    (folder / "posterior").mkdir()
    if content is not None:
        (folder / "posterior" / "posterior.nc").write_bytes(content)
    line = refused("predict", "--posterior", "posterior", "train_1.csv", "--out", "new/bands.csv")
    assert "posterior.nc: " in line and "sample" in line


def test_columns_and_rates_can_be_mapped(folder: Path) -> None:
    """Other names, no time stamps, and another rate give the record that they say."""
    lines = lines_of(folder / "train_1.csv")
    (folder / "named.csv").write_text("\n".join(with_header("when,demand,angle")(lines)) + "\n")
    names = ("--input", "demand", "--output", "angle")
    assert main(simulate("named.csv", "model/model.json", *names, "--time", "when")) == 0
    mapped = lines_of(folder / "new" / "run.csv")
    assert main(simulate()) == 0
    assert lines_of(folder / "new" / "run.csv") == mapped
    counted = ("--time", "none", "--sample-rate", "20")
    assert main(simulate("named.csv", "model/model.json", *names, *counted)) == 0
    assert lines_of(folder / "new" / "run.csv")[-1].split(",")[3:] == mapped[-1].split(",")[3:]


def test_uneven_time_stamps_are_resampled_when_asked(folder: Path) -> None:
    lines = lines_of(folder / "train_1.csv")
    (folder / "uneven.csv").write_text("\n".join(with_row(7, "0.28,0,0")(lines)) + "\n")
    assert main(simulate("uneven.csv")) == 2
    assert main(simulate("uneven.csv", "model/model.json", "--resample", "20")) == 0
    steps = np.diff(np.loadtxt(folder / "new" / "run.csv", delimiter=",", skiprows=1)[:, 0])
    np.testing.assert_allclose(steps, 0.05, rtol=1e-9)


def test_coefficients_are_the_same_model(folder: Path, small_axis: HammersteinWiener) -> None:
    """The numerator and denominator form simulates as poles and zeros do."""
    assert main(simulate()) == 0
    expected = np.loadtxt(folder / "new" / "run.csv", delimiter=",", skiprows=1)
    numerator, denominator = small_axis.linear.coefficients()
    linear = {"numerator": numerator.tolist(), "denominator": denominator.tolist()}
    assert main(simulate(model=changed_model(folder, {"linear": linear}).name)) == 0
    found = np.loadtxt(folder / "new" / "run.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_units_pass_through(folder: Path) -> None:
    """Units of model.json are those of the posterior."""
    units = {"time": "s", "input": "rpm", "output": "mrad"}
    model = changed_model(folder, {"units": units}).name
    options = ["--walkers", "32", "--max-steps", "50", "--quiet", "--out", "post"]
    assert main(["sample", "--model", model, "train_1.csv", *options]) == 0
    parameters = json.loads((folder / "post" / "posterior.json").read_text())["parameters"]
    assert parameters["saturation.upper"]["unit"] == "rpm"
    assert parameters["dead_zone.half_width"]["unit"] == "mrad"


@pytest.mark.parametrize(
    ("u", "y"),
    [
        pytest.param("steps", "spike", marks=pytest.mark.slow),
        pytest.param("steps", "noise", marks=pytest.mark.slow),
        pytest.param("spike", "step", marks=pytest.mark.slow),
        pytest.param("step", "step", marks=pytest.mark.slow),
        pytest.param("steps", "vast", marks=pytest.mark.slow),
        ("steps", "minute"),
    ],
)
def test_records_that_show_no_axis(folder: Path, capsys: pytest.CaptureFixture[str], u: str, y: str) -> None:
    """A least-squares estimate that says what it does not know, or one line; never a traceback."""
    rng = np.random.default_rng(1)
    k = np.arange(128)
    columns = {
        "steps": np.repeat(rng.standard_normal(16), 8),
        "noise": rng.standard_normal(128),
        "spike": (k == 60) * 1.0,
        "step": (k > 20) * 1.0,
    }
    walk = np.cumsum(columns["steps"]) / 20
    columns |= {"vast": 1e11 * walk, "minute": 1e-11 * walk}
    table = np.column_stack([k / 20, columns[u], columns[y]])
    np.savetxt(folder / "odd.csv", table, delimiter=",", header="t,u,y", comments="")
    options = ["--walkers", "48", "--max-steps", "50", "--quiet", "--out", "new"]
    status = main(["sample", "--model", "model/model.json", "odd.csv", *options])
    complaint = capsys.readouterr().err.splitlines()
    assert all(line.startswith("bayes-hw: ") for line in complaint)
    if status == 2:
        assert len(complaint) == 1 and not (folder / "new").exists()
    else:
        assert status == 0
        assert complaint, "neither refused nor warned"


def test_a_full_disk_leaves_the_last_good_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Writing fails half-way: status 1, one line, the older result untouched, nothing half-written."""
    assert main(simulate()) == 0
    before, good = files_below(folder), (folder / "new" / "run.csv").read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        status = main(simulate("train_2.csv"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert status == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "File too large" in line
    assert files_below(folder) == before
    assert (folder / "new" / "run.csv").read_bytes() == good


def test_band_files_never_overwrite_each_other() -> None:
    assert band_file_names(["a", "b"]) == ["bands_a.csv", "bands_b.csv"]
    assert band_file_names(["a", "a"]) == ["bands_1.csv", "bands_2.csv"]
    assert band_file_names(["é" * 120]) == ["bands_1.csv"]


@pytest.mark.parametrize("name", ["../up", "a/b", "C:\\x", "a\nb", "\x1b[31m", "\u202e", "nul\0"])
def test_band_files_stay_in_their_folder(name: str) -> None:
    """A name that would leave the folder, or show as another, is replaced by a number."""
    assert band_file_names([name]) == ["bands_1.csv"]


def test_a_command_alone_is_simulated(folder: Path) -> None:
    """Its file lacks y, and holds the numbers that the whole record gives."""
    rows = [line.split(",") for line in lines_of(folder / "train_1.csv")]
    (folder / "command.csv").write_text("".join(f"{row[0]},{row[1]}\n" for row in rows))
    for name in ("train_1", "command"):
        assert (
            main(["simulate", "--model", "model/model.json", f"{name}.csv", "--out", f"{name}_run.csv"]) == 0
        )
    alone, whole = (
        np.genfromtxt(folder / f"{n}_run.csv", delimiter=",", names=True) for n in ("command", "train_1")
    )
    assert alone.dtype.names == ("t", "u", "w", "y_model")
    np.testing.assert_array_equal(alone["y_model"], whole["y_model"])


def test_an_option_is_not_taken_for_another_that_begins_alike(capsys: pytest.CaptureFixture[str]) -> None:
    """--rate is no --rated-torque."""
    with pytest.raises(SystemExit) as ended:
        main(["diagnose", "record.csv", "--rate", "20"])
    assert ended.value.code == 2
    assert "unrecognized arguments: --rate" in capsys.readouterr().err
