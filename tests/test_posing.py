"""Records may begin at any angle, and in motion; what is said of the axis does not change."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_files import few_orders
from simulated_records import measured

import bayes_hw
from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.gap.case.case import Case
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import from_rest, posed, rested
from bayes_hw.record import Record, Units
from bayes_hw.record_start import begins_in_motion, record_start

RATE_HZ = 20.0


def slewing(seconds: float, *, rest: float = 0.0, seed: int = 1) -> Record:
    """A first-order drive, 0.4 s, whose command changes every two seconds, after some seconds at rest."""
    rng = np.random.default_rng(seed)
    still = round(rest * RATE_HZ)
    u = np.concatenate([np.zeros(still), np.repeat(rng.normal(0, 1, round(seconds / 2)), 40)])
    speed = np.zeros(len(u))
    for k in range(1, len(u)):
        speed[k] = speed[k - 1] + (u[k - 1] - speed[k - 1]) / (0.4 * RATE_HZ)
    y = np.cumsum(speed) / RATE_HZ + 1e-3 * rng.standard_normal(len(u))
    return Record("slew", np.arange(len(u)) / RATE_HZ, u, y, RATE_HZ, Units())


@pytest.mark.parametrize("level", [134.2, -1e4, 0.03])
@pytest.mark.parametrize("rest", [0.0, 3.0])
def test_angles_count_from_the_beginning(level: float, rest: float) -> None:
    """The level is subtracted to within the noise, said, and comes back when the record is written."""
    plain = slewing(60.0, rest=rest)
    moved = replace(plain, y=plain.y + level)
    (found,) = posed([moved]).records
    assert found.origin == pytest.approx(level, abs=3e-3)
    np.testing.assert_allclose(found.y + found.origin, moved.y, atol=1e-9)
    assert "angles count from" in found.treatment[-1]
    assert ("few" in found.treatment[-1]) == (rest == 0)
    np.testing.assert_allclose(found.columns()["y"], moved.y, atol=1e-9)


def test_a_record_from_zero_or_with_absolute_angles_is_left_alone() -> None:
    plain = slewing(60.0)
    assert posed([plain]).records[0] is plain
    moved = replace(plain, y=plain.y + 134.2)
    absolute = posed([moved], origin="absolute")
    assert absolute.records[0] is moved and absolute.start == "free"
    assert "begins at 134.2" in absolute.notes[0]


def test_a_beginning_that_was_not_measured_tells_no_level() -> None:
    """The level is free, which "known to" says; a record whose first seconds were measured keeps its own."""
    plain = slewing(60.0, rest=5.0)
    for first, free in ((200, True), (20, False)):
        y = np.where(np.arange(len(plain)) < first, plain.y[first], plain.y) + 134.2
        found = posed([replace(plain, y=y, measured=np.arange(len(plain)) >= first)]).records[0]
        assert (found.level_sd > 1.0) == free
        assert ("nothing having been measured before it" in found.treatment[-1]) == free


def test_a_glitch_in_the_first_sample_is_no_level() -> None:
    glitched = slewing(60.0)
    glitched.y[0] = 5.0
    assert record_start(glitched.u, glitched.y, RATE_HZ).is_zero


@pytest.mark.parametrize("seed", range(6))
def test_motion_at_the_beginning_is_seen(seed: int) -> None:
    """In the midst of a fast slew; not from rest, with or without a command from the first sample on."""
    whole = slewing(120.0, seed=seed)
    speed = np.abs(np.gradient(whole.y))[200:1200]
    first = 200 + int(np.argmax(np.convolve(speed, np.ones(10), "valid")))
    part = whole.window(first / RATE_HZ, 120.0)
    assert begins_in_motion(part.u, part.y, RATE_HZ)
    for rest in (0.0, 3.0):
        still = slewing(120.0, rest=rest, seed=seed)
        assert not begins_in_motion(still.u, still.y, RATE_HZ)
    assert posed([whole, part]).start == "free"
    assert posed([whole], [part]).start == "rest"
    assert posed([part], start="rest").start == "rest"


@pytest.mark.parametrize("seed", range(8))
def test_the_simulated_axis_begins_at_rest(small_axis: HammersteinWiener, seed: int) -> None:
    record = measured(small_axis, 400, seed=seed)
    start = record_start(record.u, record.y, record.sample_rate_hz)
    assert start.is_zero and not start.moving


def test_a_diagnosis_begins_where_the_axis_rests() -> None:
    whole = slewing(120.0)
    pause = np.concatenate([whole.u[:200], np.zeros(100), slewing(100.0, rest=0.0, seed=3).u])
    speed = np.zeros(len(pause))
    for k in range(1, len(pause)):
        speed[k] = speed[k - 1] + (pause[k - 1] - speed[k - 1]) / (0.4 * RATE_HZ)
    y = np.cumsum(speed) / RATE_HZ + 1e-3 * np.random.default_rng(5).standard_normal(len(pause))
    record = Record("paused", np.arange(len(pause)) / RATE_HZ, pause, y, RATE_HZ, Units())
    cut = record.window(4.5, 1e3)
    assert begins_in_motion(cut.u, cut.y, RATE_HZ)
    found = from_rest(cut)
    assert 10.0 < found.t[0] < 15.0 and "left out" in found.treatment[-1]
    assert from_rest(replace(cut, known={"wind": np.ones(len(cut))})).t[0] == cut.t[0]
    restless = (
        whole.window(4.5, 120.0)
        if begins_in_motion(whole.u[90:], whole.y[90:], RATE_HZ)
        else cut.window(0, 8)
    )
    with pytest.raises(InputError, match="begins in motion, and comes to rest nowhere"):
        from_rest(restless)
    kept, notes = rested([restless, cut])
    assert [one.name for one in kept] == [cut.name]
    assert "left out, begins in motion" in notes[0] and len(notes) == 2
    with pytest.raises(InputError, match="comes to rest nowhere"):
        rested([restless])


def test_a_case_away_from_zero(small_axis: HammersteinWiener) -> None:
    """Its records count from their beginnings; where these differ, what that means for the answer is said."""
    train, held = measured(small_axis, 800, seed=1), measured(small_axis, 800, seed=2)
    away = Case.of_records(
        "away", small_axis, [replace(train, y=train.y + 134.2)], [replace(held, y=held.y + 97.0)]
    )
    case, notes = away.posed()
    assert case.train[0].origin == pytest.approx(134.2, abs=0.03)
    np.testing.assert_allclose(case.train[0].y, train.y, atol=0.03)
    assert len(notes) == 3 and "records begin at 96.99" in notes[-1]
    still, none = Case.of_records("still", small_axis, [train], [held]).posed()
    assert none == () and still.train[0] is train


@pytest.mark.slow
def test_simulate_and_identify_give_back_the_angles_of_the_encoder(
    small_axis: HammersteinWiener,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The same model from a record that begins at 134.2 deg, and its simulation there."""
    record = measured(small_axis, 400, seed=1)
    small_axis.write(str(tmp_path / "model.json"))
    replace(record, y=record.y + 134.2).write(tmp_path / "away_0.csv")
    record.write(tmp_path / "plain_0.csv")
    for name in ("away", "plain"):
        out = str(tmp_path / f"{name}.csv")
        given = ["simulate", "--model", str(tmp_path / "model.json"), str(tmp_path / f"{name}_0.csv")]
        assert main([*given, "--out", out]) == 0
    away, plain = (
        np.genfromtxt(tmp_path / f"{name}.csv", delimiter=",", names=True) for name in ("away", "plain")
    )
    np.testing.assert_allclose(away["y"], plain["y"] + 134.2, atol=1e-9)
    np.testing.assert_allclose(away["y_model"], plain["y_model"] + 134.2, atol=0.03)
    assert "note: away_0: angles count from 134." in capsys.readouterr().out
    few_orders(monkeypatch)
    fits = []
    for name in ("away", "plain"):
        given = str(tmp_path / f"{name}_0.csv")
        assert main(["identify", given, "--out", str(tmp_path / name), "--quiet"]) == 0
        fits.append(json.loads((tmp_path / name / "fit.json").read_text())["steps"][-1]["fit_percent"])
    assert fits[0] == pytest.approx(fits[1], abs=1.0)


def test_python_warns_of_what_was_done(
    small_axis: HammersteinWiener, monkeypatch: pytest.MonkeyPatch
) -> None:
    few_orders(monkeypatch)
    record = measured(small_axis, 400, seed=1)
    with pytest.warns(bayes_hw.BayesHWWarning, match=r"angles count from 134"):
        found = bayes_hw.identify(replace(record, y=record.y + 134.2))
    assert found.records[0].origin == pytest.approx(134.2, abs=0.03)
