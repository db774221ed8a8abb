import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayes_hw.report.page.document import Figure, Section
from bayes_hw.report.page.render import to_pages, to_pdf

HOSTILE = '#eval("1") $x^2$ \\ @ref *b* _i_ `c` <l> // /* = - + ~ -- ... #image("/etc/passwd")'


def glyph_count(pages):
    return sum(page.count("<use") for page in pages)


def test_hostile_text_is_set_character_by_character(report_of):
    """Markup read as markup would lose or fail on some character; as text each one is a glyph."""

    def glyphs(text):
        report = report_of(text)
        sections = tuple(replace(section, title="section") for section in report.sections)
        return glyph_count(to_pages(replace(report, sections=sections)))

    stand_in = "".join(" " if character == " " else "x" for character in HOSTILE)
    assert glyphs(HOSTILE) == glyphs(stand_in)


def test_hostile_titles_reach_bookmarks_and_metadata_unchanged(report_of):
    pdf = to_pdf(report_of(HOSTILE))
    literal = HOSTILE.replace("\\", "\\\\")
    assert f"/Title({literal})/Creator".encode() in pdf
    assert f"/Title(1 {literal})/Dest".encode() in pdf


@pytest.mark.slow
def test_same_report_gives_same_bytes_in_another_process(report_of, tmp_path):
    pdf = to_pdf(report_of("text"))
    assert pdf.startswith(b"%PDF-")
    assert to_pdf(report_of("text")) == pdf
    script = tmp_path / "again.py"
    script.write_text(
        "import sys, hashlib\n"
        f"sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
        "from conftest import report_of\n"
        "from bayes_hw.report.page.render import to_pdf\n"
        "sys.stdout.buffer.write(to_pdf(report_of.__wrapped__()('text')))\n"
    )
    again = subprocess.run([sys.executable, script], check=True, capture_output=True)
    assert again.stdout == pdf


def test_long_words_and_long_tables_stay_on_the_page(report_of):
    pages = to_pages(report_of("a" * 500))
    assert len(pages) < 12


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(text=st.text(alphabet=st.characters(exclude_categories=()), max_size=40))
def test_any_text_compiles(report_of, text):
    assert to_pdf(report_of(text)).startswith(b"%PDF-")


def test_a_tall_figure_goes_on_over_the_page(report_of):
    """Where a page may end in it, the figure fills the rest of a page instead of leaving it empty."""
    svg = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="480" height="560" viewBox="0 0 480 560">'
        + "".join(f'<rect x="0" y="{80 * row}" width="480" height="60" fill="#123456"/>' for row in range(7))
        + "</svg>"
    )
    whole = Figure(svg, "caption", "alt", 6.0)
    parted = replace(whole, breaks=tuple((80 * row - 10) / 560 for row in range(1, 7)))

    def pages(figure):
        report = replace(report_of("text"), sections=(Section("Figures", (figure,) * 4),))
        return to_pages(report)

    assert len(pages(parted)) < len(pages(whole))
