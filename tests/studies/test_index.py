"""The page of all studies is up to date, leads to what is there, and a browser shows it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from browser import Browser
from index import GROUPS, REST, heading_of, write_index
from manifest import REPORTS, STUDIES

PAGE = REPORTS / "index.html"
NAMES = [path.stem for path in sorted(STUDIES.glob("[0-9][0-9]_*.py"))]
HOSTILE = '<script>alert(1)</script> {{ 7*7 }} "quoted"'


def test_committed_page_is_that_of_the_committed_manifests(tmp_path: Path) -> None:
    for folder in (path.parent for path in REPORTS.glob("*/manifest.json")):
        (tmp_path / folder.name).symlink_to(folder, target_is_directory=True)
    fresh = write_index(tmp_path).read_text(encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == fresh, "run python studies/index.py"
    assert PAGE.stat().st_size < 1.5e6


def test_every_study_is_listed_and_every_link_leads_somewhere() -> None:
    source = PAGE.read_text(encoding="utf-8")
    shown = re.findall(r'<section id="([^"]+)"', source)
    assert sorted(shown) == NAMES
    assert [int(name[:2]) for name in shown] == [number for _, _, numbers in GROUPS for number in numbers]
    assert REST[0] not in source
    titles = re.findall(r"<h2>([^<]+)</h2>", source)
    assert titles == ["Contents", *(title for title, _, _ in GROUPS)]
    cards = re.search(r'<ul class="cards">(.*?)</ul>', source, re.DOTALL)
    assert cards is not None
    assert re.findall(r'href="(\d\d)[^"]+/report.html"', cards[1]) == [f"{n:02}" for n in GROUPS[0][2]]
    links = re.findall(r'href="([^"]+)"', source)
    for link in links:
        if link.startswith("#"):
            assert link[1:] in NAMES
        elif link != "data:,":
            assert (REPORTS / link).is_file()
    for folder in (path.parent.name for path in REPORTS.glob("*/manifest.json")):
        assert {f"{folder}/report.html", f"{folder}/report.pdf"} <= set(links)


def test_study_without_a_manifest_says_so_and_quick_runs_are_marked(tmp_path: Path) -> None:
    nothing = write_index(tmp_path).read_text(encoding="utf-8")
    assert nothing.count("No result here") == len(NAMES)
    content = json.loads((REPORTS / "02_twin" / "manifest.json").read_text(encoding="utf-8"))
    content["headline"]["verdict"] = HOSTILE
    (tmp_path / "02_twin").mkdir()
    (tmp_path / "02_twin" / "manifest.json").write_text(json.dumps(content | {"quick": True}))
    page = write_index(tmp_path).read_text(encoding="utf-8")
    assert page.count("No result here") == len(NAMES) - 1
    assert page.count("A quick run") == 1
    assert "<script" not in page
    assert "{{ 7*7 }}" in page


def test_a_study_that_no_group_names_stands_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("index.GROUPS", GROUPS[:-1])
    page = write_index(tmp_path).read_text(encoding="utf-8")
    shown = re.findall(r'<section id="([^"]+)"', page)
    assert sorted(shown) == NAMES
    assert [int(name[:2]) for name in shown[-len(GROUPS[-1][2]) :]] == list(GROUPS[-1][2])
    assert page.index(f"<h2>{REST[0]}</h2>") < page.index(f'<section id="{shown[-1]}"')


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [360, 1280])
def test_page_in_a_browser(browser: Browser, dark: bool, width: int) -> None:
    browser.open(PAGE, dark=dark, width=width)
    assert browser.errors == []
    assert len(browser.requests) == 1
    assert browser.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
    assert browser.evaluate(
        "[...document.querySelectorAll('section')].every(one => one.getBoundingClientRect().height > 50)"
    )
    ink = browser.evaluate("getComputedStyle(document.body).color")
    paper = browser.evaluate("getComputedStyle(document.body).backgroundColor")
    brightness = [sum(map(int, re.findall(r"\d+", colour)[:3])) for colour in (ink, paper)]
    assert (brightness[0] > brightness[1] + 300) == dark
    assert (brightness[1] > brightness[0] + 300) != dark


def test_links_of_the_page_open_the_reports(browser: Browser) -> None:
    browser.open(PAGE)
    browser.follow("[id='02_twin'] .links a")
    assert browser.evaluate("location.pathname").endswith("/02_twin/report.html")
    assert browser.evaluate("document.querySelectorAll('figure').length") > 5


def test_acronyms_of_studies_stay_acronyms(tmp_path: Path) -> None:
    assert heading_of("04_emps") == "EMPS"
    assert heading_of("03_rubin_azimuth") == "Rubin azimuth"
    assert heading_of("10_leave_one_out") == "Leave one out"
    assert heading_of("04_emps") in write_index(tmp_path).read_text(encoding="utf-8")
