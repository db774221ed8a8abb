"""bayes-hw look: files, keys, messages; and the page in a browser."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from command_files import write_record
from simulated_records import measured

import bayes_hw as hw
from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.first_look.look import Look, look
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record
from bayes_hw.report.look.page import to_html, write

DRAWN_TEXT = """(async () => {
  const texts = new Map(), ink = CanvasRenderingContext2D.prototype, fill = ink.fillText;
  ink.fillText = function (text, x, y, ...rest) {
    if (!texts.has(this.canvas)) texts.set(this.canvas, { ticks: [], labels: [] });
    const { ticks, labels } = texts.get(this.canvas), width = this.measureText(text).width;
    if (this.getTransform().b !== 0) labels.push(this.canvas.height - width);
    else if (this.textAlign === "right") ticks.push(x - width);
    fill.call(this, text, x, y, ...rest);
  };
  draw();
  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(0))));
  const all = [...texts.values()], aside = one => one.ticks.map(left => left - (one.labels.length ? 20 : 0));
  return [all.flatMap(aside), all.flatMap(one => one.labels)];
})()"""
"""Draws all plots anew. Room in pixels left of every tick of an axis of values, beside its label; and
what the height of its canvas leaves to every upright label."""

SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two records, and the answer to them in out/."""
    place = tmp_path_factory.mktemp("look")
    for seed in (1, 2):
        write_record(place / f"run_{seed}.csv", measured(small_axis, 1500, seed=seed))
    assert main(["look", *map(str, sorted(place.glob("run_*.csv"))), "--out", str(place / "out")]) == 0
    return place


def test_quiet_keeps_the_answer(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What was seen and where the page lies; only the next command is left out."""
    record, out = str(folder / "run_1.csv"), tmp_path / "out"
    assert main(["look", record, "--out", str(out), "--quiet"]) == 0
    said = capsys.readouterr().out
    assert "shown: " in said and f"page: {out / 'report.html'}" in said and "next: bayes-hw" not in said


def test_json_has_the_fixed_keys(folder: Path) -> None:
    found = json.loads((folder / "out" / "look.json").read_text())
    assert found["schema"] == "bayes-hw/look/1"
    response = found["frequency_response"]
    lengths = {
        len(response[name])
        for name in ("frequency_hz", "magnitude", "phase_deg", "coherence", "magnitude_lo", "magnitude_hi")
    }
    assert len(lengths) == 1 and lengths.pop() > 50
    assert np.all(np.array(response["magnitude_lo"]) <= np.array(response["magnitude"]))
    assert np.all(np.array(response["magnitude"]) <= np.array(response["magnitude_hi"]) * 1.5)
    low, high = found["delay_s"]["hdi94"]
    assert low <= found["delay_s"]["mean"] <= high
    assert found["noise_sigma"] > 0
    assert found["resolution"] is None or found["resolution"] > 0


def test_console_ends_with_page_and_next_command(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", str(folder / "run_1.csv"), "--out", str(folder / "other")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2] == f"page: {folder / 'other' / 'report.html'}"
    assert lines[-1].startswith("next: bayes-hw identify ")


def test_records_of_two_rates_are_refused(
    folder: Path, small_axis: HammersteinWiener, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = measured(small_axis, 400, seed=3).resampled(10.0)
    path = write_record(folder / "slow.csv", slow)
    assert main(["look", str(folder / "run_1.csv"), str(path), "--out", str(folder / "refused")]) == 2
    assert "10 Hz" in capsys.readouterr().err
    assert not (folder / "refused" / "look.json").exists()


def test_from_python(small_axis: HammersteinWiener) -> None:
    record = measured(small_axis, 1500, seed=1)
    seen = hw.look(record)
    assert seen.to_dict()["schema"] == "bayes-hw/look/1"
    assert len(repr(seen)) < 200
    assert "<ul" in seen._repr_html_()
    with pytest.raises(InputError, match="too few"):
        hw.look(record.window(0, 2))


def test_record_at_rest_says_that_it_tells_nothing() -> None:
    t = np.arange(600) / 20
    y = 0.001 * np.random.default_rng(1).standard_normal(600)
    seen = hw.look(Record("rest", t, np.zeros(600), y, 20.0, hw.Units()))
    assert "tell little" in str(seen)
    found = seen.to_dict()
    assert found["delay_s"] is None
    assert found["noise_sigma"] == pytest.approx(0.001, rel=0.2)


@pytest.mark.slow
def test_angles_count_from_where_a_record_begins(small_axis: HammersteinWiener) -> None:
    here = measured(small_axis, 1500, seed=1)
    there = Record("there", here.t, here.u, here.y + 134.2, here.sample_rate_hz, here.units)
    one, other = hw.look(here).to_dict(), hw.look(there).to_dict()
    assert other["records"][0]["origin"] == pytest.approx(134.2, abs=0.02)
    np.testing.assert_allclose(
        one["frequency_response"]["magnitude"][20:200],
        other["frequency_response"]["magnitude"][20:200],
        rtol=0.2,
    )


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("dark", [False, True])
def test_page_draws_offline_and_zooms(folder: Path, browser: Browser, width: int, dark: bool) -> None:
    page = folder / "out" / "report.html"
    assert page.stat().st_size < 3 * 2**20
    browser.open(page, width=width, dark=dark)
    assert browser.errors == []
    assert len(browser.requests) == 1
    assert browser.evaluate(SIDEWAYS) <= 0
    assert browser.evaluate("document.querySelectorAll('.plot').length") == browser.evaluate(
        "document.querySelectorAll('.plot:has(canvas)').length"
    )
    whole = browser.evaluate("drawn[0].scales.x.max - drawn[0].scales.x.min")
    browser.evaluate("drawn[0].over.scrollIntoView({block: 'center', behavior: 'instant'})")
    box = browser.evaluate("drawn[0].over.getBoundingClientRect().toJSON()")
    browser.wheel(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, -300)
    browser.evaluate("new Promise(done => setTimeout(() => done(0), 100))")
    shown = browser.evaluate("drawn.slice(0, 3).map(one => one.scales.x.max - one.scales.x.min)")
    assert shown[0] < 0.8 * whole
    assert max(shown) - min(shown) < 1e-9 * whole


@pytest.fixture(scope="module")
def in_radians(small_axis: HammersteinWiener) -> Look:
    """An axis whose angle is in rad, of a command that never meets its limits and hardly reverses."""
    plain = measured(small_axis, 1500, seed=1)
    u = 0.05 + 0.01 * np.sin(0.3 * plain.t)
    y = np.deg2rad(np.cumsum(u) / 20 + 1e-4 * np.random.default_rng(1).standard_normal(1500))
    return look([Record("rad", plain.t, u, y, 20.0, hw.Units(output="rad"))])


@pytest.mark.parametrize("width", [390, 1200])
def test_labels_and_ticks_have_their_place(
    in_radians: Look, tmp_path: Path, browser: Browser, width: int
) -> None:
    """Beside the plot no label is longer than it is high, and no tick wider than its axis."""
    write(in_radians, tmp_path)
    browser.open(tmp_path / "report.html", width=width)
    ticks, labels = browser.evaluate(DRAWN_TEXT)
    assert len(ticks) > 20 and min(ticks) >= 0
    assert len(labels) > 4 and min(labels) >= 0
    named = browser.evaluate("[...document.querySelectorAll('.axis-label')].map(one => one.textContent)")
    assert ("output over command, rad/(deg/s)" in named) == (width == 390)


def test_page_names_what_it_has_met(in_radians: Look) -> None:
    page = to_html(in_radians)
    assert 'within the limits"' not in page and "as recorded" not in page
    assert "reverses never" not in page and "1 times" not in page
    lacking = in_radians.advice.sentence.partition("lack ")[2]
    assert "lower limit of the command" in lacking and "dead zone and play" in lacking
    assert len(in_radians.advice.cannot_show) == lacking.count(",") + 1 + lacking.count(" and the ")


@pytest.mark.parametrize("kind", ["stuck", "without noise", "short"])
def test_odd_records_are_looked_at_without_a_warning(kind: str, tmp_path: Path) -> None:
    t = np.arange(70 if kind == "short" else 900) / 20
    u = np.sin(1.3 * t)
    y = np.zeros(len(t)) if kind == "stuck" else np.cumsum(u) / 20
    hw.look(Record(kind, t, u, y, 20.0, hw.Units())).write(tmp_path)
    assert json.loads((tmp_path / "look.json").read_text())["schema"] == "bayes-hw/look/1"
