"""The pages as a browser shows them: no error, no request, every picture drawn, links, zoom, dark, print."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from matplotlib.image import imread
from page_checks import check_page

from bayes_hw.report.page.document import Report
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas
from bayes_hw.report.page.render import to_html

REPORTS = Path(__file__).resolve().parents[2] / "reports"
PAGES = sorted(REPORTS.glob("*/report.html"))
MOST_BYTES = 5 * 2**20
HOSTILE = '<img src=x onerror="alert(1)"></title><script>alert(1)</script><style>body{display:none}</style>'

SMALLEST_LETTER_POINTS = 8.5
TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"

PIXELS = """
(() => {
  const canvas = document.querySelector(".live canvas");
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let drawn = 0, sum = 0;
  for (let k = 0; k < data.length; k += 4) {
    if (data[k + 3]) { drawn++; sum = (sum * 31 + data[k] + k) % 1000003; }
  }
  return [drawn, sum];
})()
"""
"""How many pixels of the zoomable figure are drawn on, and a number that changes with the picture."""


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.parent.name)
def test_committed_report(browser: Browser, page: Path) -> None:
    assert page.stat().st_size < MOST_BYTES
    browser.open(page)
    check_page(browser)
    links = browser.evaluate("[...document.querySelectorAll('nav a')].map(link => link.hash)")
    assert len(links) == browser.evaluate("document.querySelectorAll('main section').length") > 0
    browser.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
    browser.evaluate("[...document.querySelectorAll('nav a')].at(-1).click()")
    assert browser.evaluate("location.hash") == links[-1]
    assert browser.evaluate("document.querySelector(location.hash).getBoundingClientRect().top") < 900


@pytest.mark.parametrize("width", [360, 800, 1280])
def test_nothing_sticks_out_sideways(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path, width: int
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("a name_of_many_words_" * 12)))
    browser.open(page, width=width)
    check_page(browser)
    assert browser.evaluate(TOO_WIDE) <= 0


def test_a_formula_and_its_number_fit_a_phone(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("text")))
    browser.open(page, width=390)
    formula = "[...document.querySelectorAll('.formula')].map(one => one.scrollWidth - one.clientWidth)"
    assert browser.evaluate(formula) == [0]


def test_a_figure_wider_than_a_phone_shrinks_to_it(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    """As wide as the column there, in proportion; a table turns into a list."""
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("text")))
    browser.open(page, width=390)
    width, height, column = browser.evaluate(
        "(image => [image.clientWidth, image.clientHeight, image.parentElement.clientWidth])"
        "(document.querySelector('.picture img'))"
    )
    assert width == column < 390
    natural = browser.evaluate(
        "(image => image.naturalWidth / image.naturalHeight)(document.querySelector('.picture img'))"
    )
    assert width / height == pytest.approx(natural, rel=0.02)
    cells = (
        "(box => [box.left, box.right])(document.querySelectorAll('tbody td')[{}].getBoundingClientRect())"
    )
    assert browser.evaluate(cells.format(0)) == browser.evaluate(cells.format(1))


def test_what_is_cut_off_at_a_side_casts_a_shadow(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("text")))
    browser.open(page)
    shadow = "getComputedStyle(document.querySelector('.scroll')).backgroundImage"
    assert browser.evaluate(shadow).count("gradient") == 4


def test_hostile_names_run_and_load_nothing(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of(HOSTILE)))
    browser.open(page)
    check_page(browser)
    assert browser.evaluate("document.title") == HOSTILE
    assert browser.evaluate("document.querySelector('.verdict').innerText") == HOSTILE


def test_figure_zooms_by_wheel_drag_and_key_and_comes_back(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("text")))
    browser.open(page)
    assert browser.evaluate("document.querySelector('.zoomable .still').checkVisibility()") is False
    browser.evaluate(
        "document.querySelector('.live canvas').scrollIntoView({block: 'center', behavior: 'instant'})"
    )
    frame = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))"
    box = browser.evaluate("document.querySelector('.live canvas').getBoundingClientRect().toJSON()")
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 3)
    whole = browser.evaluate(PIXELS)
    assert whole[0] > 2000

    def zoomed() -> bool:
        browser.evaluate(frame)
        hidden = browser.evaluate("document.querySelector('.zoomable button').hidden")
        assert hidden == (browser.evaluate(PIXELS) == whole)
        return not hidden

    browser.wheel(*middle, -300)
    assert zoomed()
    browser.evaluate("document.querySelector('.zoomable button').click()")
    assert not zoomed()
    browser.drag(*middle, middle[0] + 80)
    assert zoomed()
    browser.evaluate("document.querySelector('.live canvas').focus()")
    browser.call("Input.dispatchKeyEvent", type="keyDown", key="0", text="0")
    assert not zoomed()
    browser.call("Input.dispatchKeyEvent", type="keyDown", key="+", text="+")
    assert zoomed()
    assert browser.errors == []


def test_dark_screen_is_dark_and_its_text_light(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("text")))
    shades = []
    for dark in (False, True):
        browser.open(page, dark=dark)
        check_page(browser)
        picture = imread(io.BytesIO(browser.screenshot()), format="png")[..., :3]
        shades.append(float(np.median(picture)))
        assert np.ptp(picture.mean(axis=2)) > 0.5
    assert shades[0] > 0.9
    assert shades[1] < 0.2


@pytest.mark.parametrize("name", ["02_twin", "14_first_hour"])
def test_printed_report_has_as_many_pages_as_the_typeset_one_or_nearly(browser: Browser, name: str) -> None:
    page = REPORTS / name / "report.html"
    browser.open(page)
    printed, typeset = page_count(browser.pdf()), page_count((REPORTS / name / "report.pdf").read_bytes())
    assert 0.6 * typeset <= printed <= 1.7 * typeset


def test_printing_shows_the_still_picture_in_place_of_the_zoomable_one(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(to_html(report_of("text")))
    browser.open(page)
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.evaluate("document.querySelector('.zoomable .still').checkVisibility()") is True
    assert browser.evaluate("document.querySelector('.zoomable .live').checkVisibility()") is False
    assert browser.evaluate("document.querySelector('nav').checkVisibility()") is False


def page_count(document: bytes) -> int:
    """Pages of a PDF whose page objects are not compressed, as those of Chromium and Typst."""
    return len(re.findall(rb"/Type\s*/Page\b", document))


@pytest.mark.parametrize("dark", [False, True])
def test_letters_of_a_figure_are_nine_pixels_on_a_telephone(
    browser: Browser, report_of: Callable[[str], Report], tmp_path: Path, dark: bool
) -> None:
    """The drawing made for it is shown there, and the wide one on a screen."""
    with drawing_settings():
        canvas = new_canvas(2.0)
        canvas.subplots().plot([0, 1], [2, 3])
        figure = finished(canvas, "what is drawn", "a line")
    page = tmp_path / "report.html"
    page.write_text(to_html(replace(report_of("text"), key_figure=figure)))
    sizes = "(({width, naturalWidth}) => [width, naturalWidth])(document.querySelector('.picture img'))"
    browser.open(page, width=390, dark=dark)
    check_page(browser)
    width, own = browser.evaluate(sizes)
    assert SMALLEST_LETTER_POINTS * 96 / 72 * width / own >= 9.0
    browser.open(page, width=1280, dark=dark)
    assert browser.evaluate(sizes)[1] == pytest.approx(96 * figure.width_inches, abs=1)
