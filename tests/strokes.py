"""Figures as a stroke each: for what a page or a command says, where other tests draw the same figures."""

from __future__ import annotations

from typing import TextIO

import pytest
from matplotlib.figure import Figure as Canvas

from bayes_hw.report.page import drawing


def draw_strokes(patch: pytest.MonkeyPatch) -> None:
    """Every figure is one stroke, that nothing parts, while `patch` lasts."""

    def stroke(_: Canvas, stream: TextIO, **__: object) -> None:
        stream.write(
            '<svg xmlns="http://www.w3.org/2000/svg" width="72" height="36" viewBox="0 0 72 36">'
            '<path d="M0 0L72 36" stroke="#000"/></svg>'
        )

    patch.setattr(Canvas, "savefig", stroke)
    patch.setattr(drawing, "gaps_between_rows", lambda _: ())
