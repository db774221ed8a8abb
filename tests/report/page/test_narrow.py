"""The drawing for a telephone: letters as large as in print, panels below each other, nothing lost."""

from __future__ import annotations

import re

import pytest

from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas
from bayes_hw.report.page.narrow import NARROW_INCHES, narrow_svg

COLUMN_PIXELS, LETTER_POINTS, LEAST_PIXELS = 361.0, 8.5, 9.0
"""What a page leaves a figure of 390 pixels, the smallest letters of a figure, and how large they must be."""


def _drawn(columns: int, *, shared: bool = False, width: float = 6.7) -> Figure:
    with drawing_settings():
        canvas = new_canvas(2.5, width)
        for axes in canvas.subplots(1, columns, sharey=shared, squeeze=False)[0]:
            axes.plot([0, 1], [2, 3])
        canvas.axes[0].set_ylabel("angle (deg)")
        return finished(canvas, "caption", "alt")


def _size(svg: str) -> tuple[float, float]:
    found = re.search(
        r'width="([\d.]+)pt" height="([\d.]+)pt"|height="([\d.]+)pt"[^>]* width="([\d.]+)pt"', svg
    )
    assert found is not None
    width, height, other_height, other_width = found.groups()
    return float(width or other_width), float(height or other_height)


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_letters_are_nine_pixels_on_a_telephone(columns: int) -> None:
    svg = _drawn(columns).narrow_svg
    assert svg is not None
    assert LETTER_POINTS * COLUMN_PIXELS / _size(svg)[0] >= LEAST_PIXELS


@pytest.mark.parametrize("shared", [False, True])
def test_panels_stand_below_each_other_with_axes_of_their_own(shared: bool) -> None:
    wide = _drawn(3, shared=shared)
    assert wide.narrow_svg is not None
    assert _size(wide.narrow_svg)[1] == pytest.approx(3 * _size(wide.svg)[1])
    # Tick marks of three ordinates, whatever was shared: no fewer uses of glyphs than the wide drawing has.
    assert wide.narrow_svg.count("<use") >= wide.svg.count("<use")


def test_a_drawing_that_is_narrow_enough_is_drawn_once() -> None:
    assert _drawn(1, width=NARROW_INCHES).narrow_svg is None


@pytest.mark.slow
def test_panels_that_were_placed_by_hand_keep_their_places() -> None:
    """A triangle of pairs stood one below the other, fifty inches high."""
    with drawing_settings():
        canvas = new_canvas(6.0, 6.0, automatic_layout=False)
        for axes in canvas.subplots(4, 4).ravel():
            axes.plot([0, 1], [2, 3])
        assert finished(canvas, "caption", "alt").narrow_svg is None


def test_a_legend_is_as_wide_as_the_drawing_at_most_and_titles_do_not_meet() -> None:
    with drawing_settings():
        canvas = new_canvas(2.5)
        for axes in canvas.subplots(1, 2):
            axes.plot([0, 1], [2, 3], label="a long word for a line that needs room")
            axes.set_title("a title that needs more than half of it")
        handles = [line for axes in canvas.axes for line in axes.lines]
        canvas.legend(handles=handles * 2, loc="outside upper center", ncols=4)
        assert narrow_svg(canvas) is not None
        canvas.draw_without_rendering()
        (legend,) = canvas.legends
        assert legend.get_window_extent().width <= canvas.bbox.width
        upper, lower = canvas.axes
        assert upper.get_position().y0 > lower.get_position().y1
