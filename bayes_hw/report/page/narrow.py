"""The same drawing for a page as narrow as a telephone's, its letters as large as they were."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.gridspec import GridSpec

from bayes_hw.report.page.svg_size import compact

NARROW_INCHES = 4.5
"""At which letters of 8.5 points are 9 pixels and more in a column of 350."""

LEAST_PANEL_INCHES = 1.9
"""Panels side by side that would be narrower stand one below the other."""


def narrow_svg(canvas: Canvas) -> str | None:
    """The drawing as SVG at NARROW_INCHES, None where it is no wider; call within `drawing_settings`.

    What was drawn is changed: nothing else is to be made of it afterwards.
    """
    width, height = map(float, canvas.get_size_inches())
    if width <= NARROW_INCHES:
        return None
    grid = _grid(canvas)
    if grid is not None and grid.ncols > 1 and NARROW_INCHES / grid.ncols < LEAST_PANEL_INCHES + 0.35:
        rows = _stacked(canvas, grid)
        height *= rows / grid.nrows
    canvas.set_size_inches(NARROW_INCHES, height)
    buffer = io.StringIO()
    canvas.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return compact(buffer.getvalue())


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
