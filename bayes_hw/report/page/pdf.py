"""The report as a PDF, typeset by Typst from fonts that the typst package carries."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import typst

from bayes_hw.report.page.content import report_content
from bayes_hw.report.page.document import Report
from bayes_hw.report.page.palette import STATE_COLOURS
from bayes_hw.report.page.svg_size import compact

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
