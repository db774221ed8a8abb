"""Writing both forms of a report."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import typst
from markupsafe import Markup, escape

from bayes_hw.files import staged, write_bytes_atomically, write_text_atomically
from bayes_hw.report.page.content import report_content
from bayes_hw.report.page.document import TEXT_WIDTH_INCHES, Report
from bayes_hw.report.page.page_head import asset, page_of
from bayes_hw.report.page.palette import STATE_COLOURS
from bayes_hw.report.page.svg_size import compact


def to_html(report: Report) -> str:
    """The page: no script, style, font or picture from outside, and a policy that forbids any."""
    content = report_content(report)
    script = asset("zoom.js") if _has_zoom(content) else ""
    return page_of(
        {"report.html": asset("report.html")},
        title=content["title"],
        style=asset("report.css"),
        script=script,
        filters={
            "data_uri": _svg_data_uri,
            "formula_svg": formula_svg,
            "breakable": breakable,
            "percent_of_column": _percent_of_column,
        },
        report=content,
    )


def _has_zoom(content: dict[str, Any]) -> bool:
    return any(
        block["kind"] == "zoomable_record" for section in content["sections"] for block in section["blocks"]
    )


def _svg_data_uri(svg: str) -> Markup:
    """Percent-encoded, a quarter shorter than base64 for text, for an attribute in double quotes: single ones
    need no escape, and all that would is encoded."""
    quoted = svg if "'" in svg else svg.replace('"', "'")
    return Markup("data:image/svg+xml;charset=utf-8," + quote(quoted, safe=" ,;:/=()!*+@$?'"))


def breakable(text: str) -> Markup:
    """`text`, escaped, that may go on a new line after an underscore."""
    return escape(text).replace("_", Markup("_<wbr>"))


def _percent_of_column(width_inches: float) -> str:
    return f"{min(100.0, 100 * width_inches / TEXT_WIDTH_INCHES):.1f}%"


TIMESTAMP = 0
"""Seconds since 1970 that the PDF gives as its creation time: the same report is the same bytes."""


def to_pdf(report: Report) -> bytes:
    """The typeset report; the same report gives the same bytes with the same version of typst."""
    return bytes(typst.compile(**_compilation(report), format="pdf", timestamp=TIMESTAMP))


def to_pages(report: Report) -> list[str]:
    """Each page of the PDF as an SVG document, for looking at it without a PDF viewer."""
    pages = typst.compile(**_compilation(report), format="svg")
    return [page.decode("utf-8") for page in (pages if isinstance(pages, list) else [pages])]


def formula_svg(formula: str) -> str:
    """Typst math typeset as a transparent SVG document; for constants of equations.py alone."""
    template = (
        "#set page(width: auto, height: auto, margin: 2pt, fill: none)\n"
        "#set text(size: 12pt)\n"
        '#math.equation(block: true, eval(sys.inputs.formula, mode: "math"))'
    )
    page = typst.compile(
        template.encode(), ignore_system_fonts=True, sys_inputs={"formula": formula}, format="svg"
    )
    return compact(bytes(page).decode("utf-8"))


def _compilation(report: Report) -> dict[str, Any]:
    """Arguments of typst.compile: the constant template, and the report as JSON beside it."""
    content = report_content(report) | {"states": STATE_COLOURS}
    template = (files("bayes_hw.report.page") / "templates" / "report.typ").read_bytes()
    return {
        "input": template,
        "ignore_system_fonts": True,
        "sys_inputs": {"report": json.dumps(content, ensure_ascii=True, allow_nan=False)},
    }


HTML, PDF = "report.html", "report.pdf"


class RenderedReport(NamedTuple):
    """Where the two forms of a report were written."""

    html: Path
    pdf: Path


def render(report: Report, out_dir: Path) -> RenderedReport:
    """Write report.html and report.pdf into `out_dir`, both or neither.

    Raises InputError when the folder cannot be written.
    """
    page, document = to_html(report), to_pdf(report)
    with staged(out_dir) as place:
        write_text_atomically(place / HTML, page)
        write_bytes_atomically(place / PDF, document)
    return RenderedReport(out_dir / HTML, out_dir / PDF)


def remove_pages(out_dir: Path) -> None:
    """Take away the report of results that are in `out_dir` no more."""
    for name in (HTML, PDF):
        (out_dir / name).unlink(missing_ok=True)
