"""The same drawing for a page as narrow as a telephone's, its letters as large as they were."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.gridspec import GridSpec
from matplotlib.text import Text

from bayes_hw.report.page.svg_size import lay_out, svg_of

NARROW_INCHES = 4.5
"""At which letters of 8.5 points are 9 pixels and more in a column of 350."""

MOST_BESIDE = 2
"""More panels side by side stand one below the other, and fewer where their titles do not fit."""


def narrow_svg(canvas: Canvas) -> str | None:
    """The drawing as SVG at NARROW_INCHES, None where it is no wider; call within `drawing_settings`.

    What was drawn is changed: nothing else is to be made of it afterwards.
    """
    width, height = map(float, canvas.get_size_inches())
    if width <= NARROW_INCHES:
        return None
    grid = _grid(canvas)
    canvas.set_size_inches(NARROW_INCHES, height)
    _fit_legends(canvas)
    if grid is not None and grid.ncols > 1 and (grid.ncols > MOST_BESIDE or not _titles_fit(canvas)):
        canvas.set_size_inches(NARROW_INCHES, height * _stacked(canvas, grid) / grid.nrows)
    return svg_of(canvas)


def _fit_legends(canvas: Canvas) -> None:
    """Legends of the whole drawing in as many columns as fit its width."""
    for legend in list(canvas.legends):
        handles = [handle for handle in legend.legend_handles if handle is not None]
        labels = [text.get_text() for text in legend.get_texts()]
        columns = len(labels)
        while columns > 1 and legend.get_window_extent().width > canvas.bbox.width:
            columns -= 1
            legend.remove()
            legend = canvas.legend(handles, labels, loc="outside upper center", ncols=columns)


def _titles_fit(canvas: Canvas) -> bool:
    """Whether no title of a panel reaches into that of its neighbour, or over the edge."""
    lay_out(canvas)
    said = {(axes, axes.get_title(place)) for axes in canvas.axes for place in ("left", "center", "right")}
    boxes = [
        text.get_window_extent()
        for axes in canvas.axes
        for text in axes.findobj(Text)
        if isinstance(text, Text) and text.get_text() and (axes, text.get_text()) in said
    ]
    return all(box.x1 <= canvas.bbox.x1 for box in boxes) and not any(
        one.overlaps(other) for one, other in combinations(boxes, 2)
    )


def _grid(canvas: Canvas) -> GridSpec | None:
    """The grid that every panel is one cell of; None where there is none."""
    places = [axes.get_subplotspec() for axes in canvas.axes]
    grids = {id(place.get_gridspec()): place.get_gridspec() for place in places if place is not None}
    if None in places or len(grids) != 1:
        return None
    (grid,) = grids.values()
    single = all(place is not None and place.num1 == place.num2 for place in places)
    return grid if single and isinstance(grid, GridSpec) else None


def _stacked(canvas: Canvas, grid: GridSpec) -> int:
    """Panels below one another, column by column; how many. What panels beside each other had in common is
    said at each."""
    shown = [axes for axes in canvas.axes if axes.get_visible() and axes.axison]
    shown.sort(key=_column_first)
    heights = np.ones(grid.nrows) if grid.get_height_ratios() is None else np.ravel(grid.get_height_ratios())
    rows = [_place(axes)[0] for axes in shown]
    below = GridSpec(len(shown), 1, figure=canvas, height_ratios=heights[rows])
    labels = {_place(axes)[0]: axes.get_ylabel() for axes in reversed(shown)}
    for number, axes in enumerate(shown):
        row, _ = _place(axes)
        axes.set_subplotspec(below[number, 0])
        axes.tick_params(labelleft=True)
        if not axes.get_ylabel() and axes.get_shared_y_axes().get_siblings(axes) != [axes]:
            axes.set_ylabel(labels[row])
    for axes in canvas.axes:
        if axes not in shown:
            axes.set_in_layout(False)
    return len(shown)


def _place(axes: Axes) -> tuple[int, int]:
    """Row and column of a panel."""
    place = axes.get_subplotspec()
    assert place is not None
    return place.rowspan.start, place.colspan.start


def _column_first(axes: Axes) -> tuple[int, int]:
    row, column = _place(axes)
    return column, row
