"""Mistakes are named in one sentence before anything is fitted, on the command line as in Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulated_records import measured

import bayes_hw
from bayes_hw import record_checks
from bayes_hw.cli import main
from bayes_hw.entrance import enter
from bayes_hw.errors import InputError
from bayes_hw.identify import four_steps
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.python_words import python_words
from bayes_hw.record import Record, Units

Change = Callable[[Record], Record]

RADIANS = Units(input="rad/s", output="rad")


def at_rate(factor: float) -> Change:
    """The record as stamps that count `factor` times too slow, or a wrong --sample-rate, tell it."""
    return lambda r: replace(r, t=r.t / factor, sample_rate_hz=r.sample_rate_hz * factor)


MISTAKES: dict[str, tuple[Change, str]] = {
    "swapped": (lambda r: replace(r, u=r.y, y=r.u), "the two are swapped"),
    "radians": (lambda r: replace(r, y=np.radians(r.y)), "the angle is in radians"),
    "ten times too fast": (at_rate(10.0), "its rate is rather 20 Hz than 200 Hz"),
    "ten times too slow": (at_rate(0.1), "its rate is rather 20 Hz than 2 Hz"),
}
"""Made in a record without a model beside it."""

AGAINST_A_MODEL: dict[str, tuple[Change, str]] = {
    "swapped": MISTAKES["swapped"],
    "radians": (MISTAKES["radians"][0], "the angle is in radians"),
    "command in radians": (lambda r: replace(r, u=np.radians(r.u)), "the command is in radians"),
    "command in arcsec": (lambda r: replace(r, u=3600 * r.u), "it is in another unit"),
    "inverted": (lambda r: replace(r, y=-r.y), "moves against what the model says"),
    "rate": (at_rate(10.0), "its rate is rather 20 Hz than 200 Hz"),
    "another rate": (lambda r: r.resampled(16.0), "sampled at 16 Hz"),
    "wrapped": (lambda r: replace(r, y=(r.y - r.y.mean()) % 360), "it wraps at 360 deg"),
    "units": (lambda r: replace(r, units=RADIANS), "in rad/s, that of"),
}


@pytest.fixture(scope="module")
def records(small_axis: HammersteinWiener) -> tuple[Record, Record, Record]:
    """Two to train on and one to hold out, 60 s each."""
    first, second, third = (
        replace(measured(small_axis, 1200, seed=seed), name=name)
        for seed, name in ((1, "first"), (2, "second"), (3, "third"))
    )
    return first, second, third


def written(folder: Path, records: tuple[Record, ...], change: Change) -> list[str]:
    paths = [folder / f"{record.name}.csv" for record in records]
    for path, record in zip(paths, records, strict=True):
        change(record).write(path)
    return [str(path) for path in paths]


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The line with which a command that must be refused ends."""
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize("mistake", MISTAKES)
def test_identify_names_it_at_both_doors(
    records: tuple[Record, ...], mistake: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, said = MISTAKES[mistake]
    with pytest.raises(InputError, match=said) as caught:
        bayes_hw.identify([change(record) for record in records])
    assert "--" not in str(caught.value)
    paths = written(tmp_path, records, change)
    assert said in (line := refused(capsys, "identify", *paths, "--out", str(tmp_path / "new")))
    assert any(line.startswith(f"bayes-hw: error: {path}: ") for path in paths)


@pytest.mark.parametrize("mistake", AGAINST_A_MODEL)
def test_sample_and_diagnose_name_it_in_python(
    records: tuple[Record, ...], small_axis: HammersteinWiener, mistake: str
) -> None:
    change, said = AGAINST_A_MODEL[mistake]
    first, second, held_out = (change(record) for record in records)
    calls: tuple[Callable[[], Any], ...] = (
        lambda: bayes_hw.sample(small_axis, [first, second]),
        lambda: bayes_hw.diagnose(small_axis, [first, second], held_out),
    )
    for call in calls:
        with pytest.raises(InputError, match=said) as caught:
            call()
        assert "--" not in str(caught.value)


@pytest.mark.parametrize(
    "mistake",
    [
        "swapped",
        *(pytest.param(mistake, marks=pytest.mark.slow) for mistake in ("radians", "inverted", "rate")),
    ],
)
def test_sample_and_diagnose_name_it_on_the_command_line(
    records: tuple[Record, ...],
    small_axis: HammersteinWiener,
    mistake: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    change, said = AGAINST_A_MODEL[mistake]
    small_axis.write(tmp_path / "model.json")
    first, second, held_out = written(tmp_path, records, change)
    model = ("--model", str(tmp_path / "model.json"), "--out", str(tmp_path / "new"))
    assert said in refused(capsys, "sample", first, second, *model)
    assert said in refused(capsys, "diagnose", "--train", first, second, "--holdout", held_out, *model)


def test_a_record_twice_or_as_its_own_hold_out(
    records: tuple[Record, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second, _ = records
    with pytest.raises(InputError, match="first: holds the samples of first again; leave one out"):
        bayes_hw.identify([first, second, first])
    with pytest.raises(InputError, match="is held out but its samples are in first"):
        enter([first, second], [first.window(10.0, 30.0)])
    a, b, _ = written(tmp_path, records, lambda record: record)
    out = ("--out", str(tmp_path / "new"))
    assert "leave one out" in refused(capsys, "identify", a, b, a, *out)
    assert "hold out another record" in refused(capsys, "identify", a, b, "--holdout", b, *out)


def test_records_of_opposite_signs_are_refused_at_both_doors(
    records: tuple[Record, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second, third = records
    turned = replace(second, y=-second.y)
    with pytest.raises(InputError, match="inverted in one of them"):
        bayes_hw.diagnose([first, turned], third)
    a, b, c = written(tmp_path, (first, turned, third), lambda record: record)
    out = ("--out", str(tmp_path / "new"))
    assert "inverted in one of them" in refused(capsys, "diagnose", a, b, "--holdout", c, *out)
    assert "inverted in one of them" in refused(capsys, "identify", a, "--holdout", b, *out)


def test_a_training_record_held_out_of_a_diagnosis(
    records: tuple[Record, ...],
    small_axis: HammersteinWiener,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """With a model or without one, before anything is fitted."""
    first, second, _ = records
    with pytest.raises(InputError, match="is held out but its samples are in first"):
        bayes_hw.diagnose(small_axis, [first, second], first)
    with pytest.raises(InputError, match="is held out but its samples are in first"):
        bayes_hw.diagnose([first, second], first)
    small_axis.write(tmp_path / "model.json")
    a, b, _ = written(tmp_path, records, lambda record: record)
    out = ("--holdout", a, "--out", str(tmp_path / "new"))
    with_model = ("--model", str(tmp_path / "model.json"), "--train", a, b)
    assert "hold out another record" in refused(capsys, "diagnose", *with_model, *out)
    assert "hold out another record" in refused(capsys, "diagnose", a, b, *out)


def test_a_rate_that_contradicts_the_stamps(
    records: tuple[Record, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, *_ = written(tmp_path, records, lambda record: record)
    with pytest.raises(InputError, match="the time stamps say 20 Hz") as caught:
        Record.read(path, sample_rate_hz=30.0)
    assert "\n" not in str(caught.value)
    stated = ("--sample-rate", "30", "--out", str(tmp_path / "new"))
    assert "the time stamps say 20 Hz" in refused(capsys, "identify", path, *stated)


def test_units_that_are_not_the_models_on_the_command_line(
    records: tuple[Record, ...],
    small_axis: HammersteinWiener,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    small_axis.write(tmp_path / "model.json")
    path, *_ = written(tmp_path, records, lambda record: record)
    model = ("--model", str(tmp_path / "model.json"), "--out", str(tmp_path / "new"))
    for said in (("--output-unit", "V"), ("--input-unit", "V")):
        assert "they measure different things" in refused(capsys, "sample", path, *said, *model)


def test_an_inverted_sign_without_a_model_is_warned_of(
    records: tuple[Record, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drive may be wired so; the estimate is made, with a warning."""

    def stop(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(four_steps, "identify", stop)
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(0, 1, 60), 20)
    y = -np.cumsum(u) / 20 + 1e-3 * rng.standard_normal(1200)
    record = replace(records[0], u=u, y=y)
    with pytest.warns(bayes_hw.BayesHWWarning, match="against"), pytest.raises(KeyboardInterrupt):
        bayes_hw.identify(record)


def test_sound_records_pass_unchanged(records: tuple[Record, ...], small_axis: HammersteinWiener) -> None:
    found = enter(records[:2], records[2:], model=small_axis)
    assert found.notes == () and found.start == "rest"
    assert all(a is b for a, b in zip((*found.records, *found.holdout), records, strict=True))


def test_a_gear_can_be_stated(records: tuple[Record, ...]) -> None:
    """A command of a motor before its gear passes where its unit says so."""
    first = records[0]
    geared = replace(first, u=60 * first.u)
    with pytest.raises(InputError, match="at the motor"):
        enter([geared])
    stated = replace(geared, units=Units(input="deg/s at the motor"))
    assert enter([stated]).records == (stated,)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("resample with --resample 20", "resample with resample_hz=20"),
        ("give --time none --sample-rate RATE", "give columns=Columns(time=None), sample_rate_hz=RATE"),
        ("map one with --input NAME", 'map one with columns=Columns(input="NAME")'),
        (
            "exchange --input and --output",
            "exchange columns=Columns(input=...) and columns=Columns(output=...)",
        ),
        ("such as --part 60 120.5 (s)", "such as options=ReadingOptions(part_s=(60, 120.5)) (s)"),
        ("rather 20 Hz (--sample-rate 20)", "rather 20 Hz (sample_rate_hz=20)"),
        ("clock in minutes (--time-unit min)", 'clock in minutes (options=ReadingOptions(time_unit="min"))'),
        ("with --ignore-units where", "with options=ReadingOptions(ignore_units=True) where"),
        ("give --unwrap 360", "give options=ReadingOptions(unwrap=360)"),
        ("or --start rest to take it so", 'or start="rest" to take it so'),
        (
            "leave it out with --part START STOP",
            "leave it out with options=ReadingOptions(part_s=(START, STOP))",
        ),
        ("If it is so, give --accept unrelated", 'If it is so, give accept=["unrelated"]'),
    ],
)
def test_messages_speak_python(message: str, words: str) -> None:
    assert python_words(message) == words


def test_swapped_columns_are_named_where_units_are_stated(records: tuple[Record, Record, Record]) -> None:
    """An output in deg/s is no speed that was measured where the command is an angle."""
    first = records[0]
    swapped = replace(first, u=first.y, y=first.u, units=Units(input="deg", output="deg/s"))
    with pytest.raises(InputError, match="the two are swapped"):
        enter([swapped])
    for command, output in (("deg/s", "deg/s"), ("V", "rpm")):
        assert replace(first, units=Units(input=command, output=output)).measures_speed


@pytest.mark.parametrize("looked_at", [True, False])
@pytest.mark.parametrize("guess", ["swapped", "derivative"])
def test_a_record_that_follows_its_model_is_what_it_is_said_to_be(
    records: tuple[Record, ...],
    small_axis: HammersteinWiener,
    guess: str,
    looked_at: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the columns alone look like, as of a slow axis in a short record, is no ground beside a model that
    the record follows; it is where the record is not that of the model."""
    monkeypatch.setattr(record_checks, "relation", lambda *_: guess)
    monkeypatch.setattr(record_checks, "_is_closer", lambda *_: True)
    assert enter([records[0]], model=small_axis, looked_at=looked_at).records == (records[0],)
    wandering = np.random.default_rng(1).standard_normal(len(records[0])).cumsum()
    other = replace(records[0], y=wandering * np.ptp(records[0].y) / np.ptp(wandering))
    for model, record in ((None, records[0]), (small_axis, other)):
        if model is not None or not looked_at:
            with pytest.raises(InputError, match=r"swapped|a position"):
                enter([record], model=model, looked_at=looked_at)
