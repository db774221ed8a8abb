"""Writing both forms of a report."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from bayes_hw.files import staged, write_bytes_atomically, write_text_atomically
from bayes_hw.report.page.document import Report
from bayes_hw.report.page.html import to_html
from bayes_hw.report.page.pdf import to_pdf

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
