"""Drawing on matplotlib without its global state, and turning the drawing into a document figure."""

from __future__ import annotations

import io
import itertools
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import matplotlib as mpl
import numpy as np
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, NullFormatter

from bayes_hw.arrays import FloatArray
from bayes_hw.report import document
from bayes_hw.report.palette import PAPER, SETTINGS
from bayes_hw.report.plain_text import visible
from bayes_hw.report.rounding import SUPERSCRIPTS
from bayes_hw.report.svg_size import compact

LABEL_LENGTH = 48
"""Longest user-supplied text in a figure, in characters."""

TALLEST_INCHES = 8.6
"""Of a drawing, so that its caption fits on the same page."""

COLUMNS = 400
"""Columns into which a long record is reduced for drawing: about one a printed point."""


@contextmanager
def drawing_settings() -> Iterator[None]:
    """The settings of every figure, restored afterwards."""
    with mpl.rc_context(SETTINGS):
        yield


def new_canvas(
    height_inches: float,
    width_inches: float = document.TEXT_WIDTH_INCHES,
    automatic_layout: bool = True,
    gap_inches: float = 0.04,
) -> Canvas:
    """An empty drawing; call within `drawing_settings`.

    matplotlib places its axes, with `gap_inches` around each, unless `automatic_layout` is off. No drawing is
    taller than a page that has its caption too.
    """
    layout = ConstrainedLayoutEngine(h_pad=gap_inches, w_pad=gap_inches) if automatic_layout else None
    return Canvas(figsize=(width_inches, min(height_inches, TALLEST_INCHES)), layout=layout)


def finished(canvas: Canvas, caption: str, alt_text: str) -> document.Figure:
    """The drawing as SVG, the same bytes for the same drawing; call within `drawing_settings`."""
    buffer = io.StringIO()
    canvas.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    width = float(canvas.get_figwidth())
    return document.Figure(compact(buffer.getvalue()), caption, alt_text, width)


def on_paper(canvas: Canvas) -> Canvas:
    """The drawing on white instead of the page's own ground, for use outside a report."""
    canvas.set_facecolor(PAPER)
    return canvas


def drawable(text: str) -> str:
    """User-supplied text for a label: visible, of bounded length, in glyphs that the font has."""
    shown = visible(text)
    if len(shown) > LABEL_LENGTH:
        shown = shown[: LABEL_LENGTH - 1] + "…"
    known = _known_characters()
    return "".join(c if ord(c) in known else f"‹U+{ord(c):04X}›" for c in shown)


def with_unit(quantity: str, unit: str) -> str:
    """Axis label "quantity (unit)"; no brackets for a quantity without a unit."""
    label = drawable(quantity)
    return f"{label} ({drawable(unit)})" if unit else label


def wrapped(label: str, characters: int) -> str:
    """`label` in lines of at most `characters`."""
    return "\n".join(textwrap.wrap(label, characters))


def plain_log_ticks(axes: Axes, which: str) -> None:
    """Label the logarithmic axis `which` ("x" or "y") without mathematical markup: 0.01, 1, 10⁻⁵."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter(FuncFormatter(lambda value, _: _power_of_ten(value)))
    axis.set_minor_formatter(NullFormatter())


def envelope(
    t: FloatArray, lower: FloatArray, upper: FloatArray, columns: int = COLUMNS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Smallest `lower` and largest `upper` in each of `columns` stretches of t, for filling between.

    All arrays have shape (samples,); short ones come back as they are.
    """
    if len(t) <= 2 * columns:
        return t, lower, upper
    starts = np.linspace(0, len(t), columns, endpoint=False).astype(np.int64)
    return t[starts], np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)


def outline(t: FloatArray, values: FloatArray, columns: int = COLUMNS) -> tuple[FloatArray, FloatArray]:
    """A line that looks like (t, values) and visits each stretch's smallest and largest value."""
    if len(t) <= 2 * columns:
        return t, values
    starts = np.linspace(0, len(t), columns + 1).astype(np.int64)
    kept = np.unique(
        [
            a + extreme(values[a:b])
            for a, b in itertools.pairwise(starts)
            for extreme in (np.argmin, np.argmax)
        ]
    )
    kept = np.union1d(kept, [0, len(t) - 1])
    return t[kept], values[kept]


def _power_of_ten(value: float) -> str:
    if 1e-3 < value < 1e4:
        return f"{value:g}"
    return f"10{f'{np.log10(value):.0f}'.translate(SUPERSCRIPTS)}"


@cache
def _known_characters() -> frozenset[int]:
    path = font_manager.findfont("DejaVu Sans")
    return frozenset(font_manager.get_font(path).get_charmap())
