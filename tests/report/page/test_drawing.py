import itertools

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.report.page.drawing import (
    LABEL_LENGTH,
    TALLEST_INCHES,
    drawable,
    drawing_settings,
    envelope,
    few_of,
    few_ticks,
    finished,
    gaps_between_rows,
    leave_room,
    new_canvas,
    outline,
    plain_log_ticks,
    with_unit,
)


def drawn(label):
    with drawing_settings():
        canvas = new_canvas(2.0)
        axes = canvas.subplots()
        axes.plot([0, 1.23456], [0, 1])
        axes.set_xlabel(with_unit("time", label))
        return finished(canvas, "caption", "alt")


def test_same_drawing_is_same_svg_and_settings_are_restored():
    before = dict(mpl.rcParams)
    assert drawn("s").svg == drawn("s").svg
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("unit", ["$\\frac", "<b>", "度", "\x00\u202e", "x" * 500, "\ud800"])
def test_any_unit_can_be_drawn(unit):
    assert drawn(unit).svg.startswith("<?xml")


@given(st.text(alphabet=st.characters(exclude_categories=())))
def test_label_is_of_bounded_length_before_codes_are_spelt_out(text):
    assert len(drawable(text)) <= LABEL_LENGTH * len("‹U+10FFFF›")


def test_outline_and_envelope_keep_the_extremes_of_a_long_record():
    t = np.arange(100_000) / 100
    y = np.sin(t)
    y[54_321], y[98_765] = 7.0, -8.0
    shown_t, shown = outline(t, y)
    assert (shown.min(), shown.max()) == (-8.0, 7.0)
    assert len(shown) <= 1202
    assert (shown_t[0], shown_t[-1]) == (t[0], t[-1])
    _, lower, upper = envelope(t, y - 1, y + 1)
    assert (lower.min(), upper.max()) == (-9.0, 8.0)


def test_short_records_are_drawn_as_they_are():
    t = np.arange(50.0)
    assert outline(t, t)[1] is t
    assert envelope(t, t, t)[1] is t


def test_no_drawing_is_taller_than_a_page():
    with drawing_settings():
        assert new_canvas(30.0).get_figheight() == TALLEST_INCHES
        assert new_canvas(3.0).get_figheight() == 3.0


@pytest.mark.parametrize(("ends", "ticks", "labels"), [
    ((0.005, 3.0), (0.01, 0.1, 1.0), ["0.01", "0.1", "1"]),
    ((2e-4, 3.0), (1e-3, 0.1, 1.0), ["10⁻³", "10⁻¹", "10⁰"]),
    ((100, 2e5), (100, 1e3, 1e5), ["10²", "10³", "10⁵"]),
    ((1e-4, 1.0), (2e-4, 5e-4), ["2 × 10⁻⁴", "5 × 10⁻⁴"]),
])  # fmt: skip
def test_labels_of_a_logarithmic_axis_are_all_plain_or_all_powers(ends, ticks, labels):
    with drawing_settings():
        axes = new_canvas(2.0).subplots()
        axes.set(yscale="log", ylim=ends)
        plain_log_ticks(axes, "y")
        shown = axes.yaxis.get_major_formatter()
        assert [shown(tick, None) for tick in ticks] == labels


@pytest.mark.parametrize(("ends", "most"), [((0, 1), 3), ((-0.336, -0.335), 2), ((2.1e-5, 3.2e-5), 2)])
def test_tick_labels_have_room(ends, most):
    characters = 19
    with drawing_settings():
        axes = new_canvas(1.0, 1.2).subplots()
        axes.set_xlim(*ends)
        few_ticks(axes, characters)
        shown = [tick for tick in axes.get_xticks() if ends[0] <= tick <= ends[1]]
        labels = axes.xaxis.get_major_formatter().format_ticks(shown)
        assert 1 <= len(shown) <= most + 1
        gaps = np.diff(shown) / (ends[1] - ends[0]) * characters
        assert all(gap > len(label) for gap, label in zip(gaps, labels, strict=False))


def grid_of_panels(rows, rows_together):
    with drawing_settings():
        canvas = new_canvas(1.5 * rows)
        for axes in canvas.subplots(rows, 2).ravel():
            axes.set_xlabel("below the panel")
        return canvas, finished(canvas, "caption", "alt", rows_together=rows_together)


@pytest.mark.usefixtures("wide_only")
def test_a_page_may_end_in_the_blank_stripes_between_rows():
    canvas, figure = grid_of_panels(4, 1)
    gaps = gaps_between_rows(canvas)
    assert len(gaps) == 3
    assert figure.breaks == (gaps[0], gaps[2])
    for axes in canvas.axes:
        box = axes.get_tightbbox()
        for share in gaps:
            height = (1 - share) * canvas.bbox.height
            assert not box.y0 < height < box.y1


@pytest.mark.parametrize(
    ("together", "expected"),
    [pytest.param(0, 0, marks=pytest.mark.slow), (2, 1), pytest.param(4, 0, marks=pytest.mark.slow)],
)
@pytest.mark.usefixtures("wide_only")
def test_rows_that_belong_together_stay_so(together, expected):
    assert len(grid_of_panels(4, together)[1].breaks) == expected


@pytest.mark.parametrize(("rows", "expected"), [(1, ()), (2, (1,)), (3, (2,)), (4, (1, 3)), (7, (2, 5))])
def test_a_figure_has_few_parts(rows, expected):
    """Given as the row after which a page may end: every part costs the whole drawing once more."""
    assert few_of(tuple(range(1, rows))) == expected


@pytest.mark.parametrize(("low", "high"), [(-53_000, 23_000), (-6500, 6500), (-2, 2), (0.00012, 0.00047)])
def test_labels_below_two_panels_do_not_run_into_each_other(low: float, high: float) -> None:
    """As drawn: the boxes of neighbouring labels lie apart, and two ticks at least are left."""
    with drawing_settings():
        canvas = new_canvas(2.0)
        for axes in canvas.subplots(1, 2):
            axes.plot([low, high], [0, 1])
            leave_room(axes)
        canvas.draw_without_rendering()
        for axes in canvas.axes:
            shown = [tick for tick in axes.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
            boxes = [tick.label1.get_window_extent() for tick in shown]
            assert len(boxes) >= 2
            assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))
