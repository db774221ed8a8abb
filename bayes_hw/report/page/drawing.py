"""Drawing on matplotlib without its global state, and turning the drawing into a document figure."""

from __future__ import annotations

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
from matplotlib.ticker import AutoLocator, FuncFormatter, MaxNLocator, NullFormatter

from bayes_hw.arrays import FloatArray
from bayes_hw.report.page import document
from bayes_hw.report.page.narrow import narrow_svg
from bayes_hw.report.page.palette import PAPER, SETTINGS
from bayes_hw.report.page.svg_size import svg_of
from bayes_hw.report.page.typography import power_of_ten, typeset_unit, visible

LABEL_LENGTH = 48
"""Longest user-supplied text in a figure, in characters."""

TALLEST_INCHES = 8.6
"""Of a drawing, so that its caption fits on the same page."""

MOST_BREAKS = 2
"""Places in a figure where a page may end."""

PLAIN_DECADES = (0.9e-3, 1.1e4)
"""Ends of a logarithmic axis within which its labels are plain numbers."""

HISTOGRAM_BINS = 40
PANEL_CHARACTERS = 19
"""Characters of tick labels for which one of four panels beside each other has room."""

MOST_TICKS = 6
MOST_CHOSEN = 9
"""Intervals that matplotlib makes at most of an axis, where there is width for them."""
DIGIT_WIDTH = 0.64
"""Of the font, over its size."""

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


def finished(canvas: Canvas, caption: str, alt_text: str, *, rows_together: int = 0) -> document.Figure:
    """The drawing as SVG, the same bytes for the same drawing; call within `drawing_settings`. It is narrowed
    afterwards, for the telephone.

    A page may end after every `rows_together` rows of panels, nowhere where that is 0.
    """
    for axes in canvas.axes:
        leave_room(axes)
    svg = svg_of(canvas)
    width = float(canvas.get_figwidth())
    breaks: tuple[float, ...] = ()
    if rows_together:
        breaks = few_of(gaps_between_rows(canvas)[rows_together - 1 :: rows_together])
    return document.Figure(svg, caption, alt_text, width, breaks, narrow_svg(canvas))


def few_of(gaps: tuple[float, ...]) -> tuple[float, ...]:
    """At most MOST_BREAKS of the gaps, about equally far apart, and one for two: every part of a figure
    carries the whole drawing in the PDF."""
    count = min(MOST_BREAKS, (len(gaps) + 1) // 2)
    places = np.rint((1 + np.arange(count)) * (len(gaps) + 1) / (count + 1)).astype(int) - 1
    return tuple(gaps[place] for place in places)


def gaps_between_rows(canvas: Canvas) -> tuple[float, ...]:
    """Middles of the blank stripes between rows of panels, as shares of the height from the top.

    Everything that belongs to a panel counts, its labels and title too; the canvas has been laid out.
    """
    boxes = [box for axes in canvas.axes if (box := axes.get_tightbbox()) is not None]
    spans = sorted((1 - box.y1 / canvas.bbox.height, 1 - box.y0 / canvas.bbox.height) for box in boxes)
    gaps, reached = [], spans[0][1] if spans else 1.0
    for top, bottom in spans[1:]:
        if top > reached:
            gaps.append(round((reached + top) / 2, 5))
        reached = max(reached, bottom)
    return tuple(gaps)


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
    return f"{label} ({drawable(typeset_unit(unit))})" if unit else label


def wrapped(label: str, characters: int) -> str:
    """`label` in lines of at most `characters`."""
    return "\n".join(textwrap.wrap(label, characters))


def plain_log_ticks(axes: Axes, which: str) -> None:
    """Label the logarithmic axis `which` ("x" or "y") without mathematical markup: 0.01, 1 or 10⁻⁵, 10⁻³.

    Powers of ten where an end of the axis lies beyond PLAIN_DECADES.
    """
    axis = axes.xaxis if which == "x" else axes.yaxis

    def label(value: float, _: int) -> str:
        low, high = sorted(axis.get_view_interval())
        plain = low >= PLAIN_DECADES[0] and high <= PLAIN_DECADES[1]
        return f"{value:g}" if plain else _in_powers_of_ten(value)

    axis.set_major_formatter(FuncFormatter(label))
    axis.set_minor_formatter(NullFormatter())


def leave_room(axes: Axes) -> None:
    """Fewer ticks below `axes`, where matplotlib chose them, if their labels would run into each other."""
    chosen = axes.xaxis.get_major_locator()
    if not isinstance(chosen, AutoLocator):
        return
    inches = float(axes.get_window_extent().width) / axes.figure.dpi
    size = font_manager.FontProperties(size=mpl.rcParams["xtick.labelsize"]).get_size_in_points()
    characters = 72 * inches / (DIGIT_WIDTH * size)
    axes.xaxis.set_major_locator(MaxNLocator(MOST_CHOSEN, steps=[1, 2, 2.5, 5, 10]))
    if _has_room(axes, characters):
        axes.xaxis.set_major_locator(chosen)
    else:
        few_ticks(axes, int(characters), MOST_TICKS)


def few_ticks(axes: Axes, characters: int, most: int = 3) -> None:
    """As many of `most` ticks below `axes` as have room for their labels, on a side of so many characters."""
    for count in range(most, 0, -1):
        axes.xaxis.set_major_locator(MaxNLocator(count))
        if _has_room(axes, characters):
            return


def _has_room(axes: Axes, characters: float) -> bool:
    low, high = sorted(axes.get_xlim())
    shown = [tick for tick in axes.get_xticks() if low <= tick <= high]
    longest = max(map(len, axes.xaxis.get_major_formatter().format_ticks(shown)), default=0)
    return len(shown) < 2 or (shown[1] - shown[0]) / (high - low) * characters > longest + 1


def envelope(
    t: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Smallest `lower` and largest `upper` in each of COLUMNS stretches of t, for filling between.

    All arrays have shape (samples,); short ones come back as they are.
    """
    if len(t) <= 2 * COLUMNS:
        return t, lower, upper
    starts = np.linspace(0, len(t), COLUMNS, endpoint=False).astype(np.int64)
    return t[starts], np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)


def outline(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A line that looks like (t, values) and visits each stretch's smallest and largest value."""
    if len(t) <= 2 * COLUMNS:
        return t, values
    starts = np.linspace(0, len(t), COLUMNS + 1).astype(np.int64)
    kept = np.unique(
        [
            a + extreme(values[a:b])
            for a, b in itertools.pairwise(starts)
            for extreme in (np.argmin, np.argmax)
        ]
    )
    kept = np.union1d(kept, [0, len(t) - 1])
    return t[kept], values[kept]


def _in_powers_of_ten(value: float) -> str:
    digits, exponent = f"{value:.3e}".split("e")
    factor = f"{float(digits):g}"
    return ("" if factor == "1" else f"{factor} × ") + power_of_ten(int(exponent))


@cache
def _known_characters() -> frozenset[int]:
    path = font_manager.findfont("DejaVu Sans")
    return frozenset(font_manager.get_font(path).get_charmap())
