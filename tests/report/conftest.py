"""A small report that holds one text in every place a text can stand."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable

import numpy as np
import pytest

from bayes_hw.report.page import drawing, equations
from bayes_hw.report.page.document import (
    Badge,
    Bullets,
    Callout,
    Equation,
    Figure,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
    ZoomableRecord,
)
from bayes_hw.report.page.palette import SETTINGS

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="72" height="36" viewBox="0 0 72 36">'
    '<path d="M0 0L72 36" stroke="#000"/></svg>'
)


@pytest.fixture
def report_of() -> Callable[[str], Report]:
    def build(text: str) -> Report:
        figure = Figure(SVG, text, text, 3.0)
        t = np.arange(100) / 20
        record = ZoomableRecord(t, t, t + 0.1, t - 1, t + 1, text, text, text, figure, text)
        blocks = (
            Paragraph(text),
            Bullets((text, text)),
            Callout("warn", text, text),
            Table((text, "n"), ((text, "1"), ("b", "2")), text, (1,)),
            KeyValues(((text, text),)),
            Equation(equations.CASCADE, text),
            figure,
            record,
        )
        badges = tuple(Badge(text, state, text) for state in ("good", "warn", "bad"))
        return Report(text, text, text, badges, figure, (Section(text, blocks), Section("end", ())))

    return build


@pytest.fixture
def wide_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is drawn for a telephone, where another test draws the same figure for one."""
    monkeypatch.setattr(drawing, "narrow_svg", lambda _: None)


@pytest.fixture
def labels_of(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], Figure]], list[str]]:
    """Draws a figure with its text kept as text, and lists that text."""

    def labels(draw: Callable[[], Figure]) -> list[str]:
        monkeypatch.setitem(SETTINGS, "svg.fonttype", "none")
        root = ElementTree.fromstring(draw().svg)
        return ["".join(e.itertext()) for e in root.iter() if e.tag.endswith("}text")]

    return labels
