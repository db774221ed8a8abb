"""Figures as a stroke each: for what a page or a command says, where other tests draw the same figures."""

from __future__ import annotations

import pytest

from bayes_hw.report.page import drawing

STROKE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="72" height="36" viewBox="0 0 72 36">'
    '<path d="M0 0L72 36" stroke="#000"/></svg>'
)


def draw_strokes(patch: pytest.MonkeyPatch) -> None:
    """Every figure is one stroke, that nothing parts, while `patch` lasts; nothing is laid out."""
    for name, drawn in (("svg_of", STROKE), ("narrow_svg", STROKE), ("gaps_between_rows", ())):
        patch.setattr(drawing, name, lambda _, drawn=drawn: drawn)
