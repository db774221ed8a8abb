"""Writing both forms of a report."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from bayes_hw.files import write_bytes_atomically, write_text_atomically
from bayes_hw.report.document import Report
from bayes_hw.report.html import to_html
from bayes_hw.report.pdf import to_pdf


class RenderedReport(NamedTuple):
    """Where the two forms of a report were written."""

    html: Path
    pdf: Path


def render(report: Report, out_dir: Path) -> RenderedReport:
    """Write report.html and report.pdf into `out_dir`; both are made before either is written.

    Raises InputError when the folder cannot be written.
    """
    page, document = to_html(report), to_pdf(report)
    written = RenderedReport(out_dir / "report.html", out_dir / "report.pdf")
    write_text_atomically(written.html, page)
    write_bytes_atomically(written.pdf, document)
    return written
