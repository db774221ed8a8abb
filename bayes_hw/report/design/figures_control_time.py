"""Figures of what the loops do in time, and of the uncertainty sets."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayes_hw.control.design import LoopReport
from bayes_hw.control.uncertainty import UncertaintySet
from bayes_hw.record import Units
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    envelope,
    finished,
    new_canvas,
    outline,
    plain_log_ticks,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.palette import (
    BAND_PARAMETERS,
    INK,
    MUTED,
    POINT_ESTIMATE,
    POSTERIOR,
    ensemble_colour,
)
from bayes_hw.report.page.rounding import format_percent

TITLES = {"step": "step", "ramp": "ramp: error", "sidereal": "sidereal: error"}
NAME_LENGTH = 26


def time_responses(loops: Sequence[LoopReport], units: Units) -> Figure:
    """One row a controller, one column a test."""
    tests = [response.name for response in loops[0].responses]
    with drawing_settings():
        canvas = new_canvas(0.75 + 1.55 * len(loops))
        grid = canvas.subplots(len(loops), len(tests), squeeze=False, sharex="col", sharey="col")
        for row, loop in zip(grid, loops, strict=True):
            for axes, response in zip(row, loop.responses, strict=True):
                t, low, high = envelope(response.t, response.lower, response.upper)
                axes.fill_between(t, low, high, color=BAND_PARAMETERS, linewidth=0)
                axes.plot(*outline(response.t, response.median), color=POSTERIOR, linewidth=0.8)
                axes.plot(*outline(response.t, response.nominal), color=POINT_ESTIMATE, linewidth=0.7, ls=":")
                if response.shows == "output":
                    axes.plot(response.t, response.reference, color=INK, linestyle="--", linewidth=0.7)
                else:
                    axes.axhline(0, color=INK, linewidth=0.5)
                axes.margins(x=0)
            row[0].set_title(wrapped(drawable(loop.controller.name), NAME_LENGTH), size=8.5)
        for axes, name in zip(grid[0], tests, strict=True):
            if name != "step":
                axes.set_title(TITLES[name], weight="normal")
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        for axes in grid[:, 0]:
            axes.set_ylabel(with_unit("output", units.output))
        canvas.legend(
            handles=[
                Patch(color=BAND_PARAMETERS, label="94 % of the draws"),
                Line2D([], [], color=POSTERIOR, label="median"),
                Line2D([], [], color=POINT_ESTIMATE, linestyle=":", label="point estimate"),
                Line2D([], [], color=INK, linestyle="--", linewidth=0.7, label="reference"),
            ],
            loc="outside upper right",
            ncols=4,
        )
        sidereal = (
            " The sidereal reference passes through the dead zone half way." if "sidereal" in tests else ""
        )
        return finished(
            canvas,
            f"The whole nonlinear loop in time, all in {units.output}: output after a step (first column), "
            f"error r − y on a ramp{' and on sidereal tracking' if 'sidereal' in tests else ''}; pointwise "
            "central 94 % of the draws, without noise. Every test starts at rest, step and ramp in the "
            f"middle of the dead zone.{sidereal}",
            f"Bands of {len(tests)} tests for {len(loops)} controllers.",
            rows_together=1,
        )


def uncertainty_sets(sets: Sequence[UncertaintySet], units: Units) -> Figure:
    """One panel a set: distances of the draws from the nominal G, and the weights above them."""
    with drawing_settings():
        canvas = new_canvas(3.3)
        for axes, found in zip(canvas.subplots(1, len(sets), squeeze=False)[0], sets, strict=True):
            frequency = found.frequency_hz
            middle, high = found.distance_quantiles
            axes.fill_between(frequency, middle, high, color=BAND_PARAMETERS, linewidth=0)
            axes.plot(frequency, found.floor, color=MUTED, linewidth=0.9)
            for i, weight in enumerate(found.weights):
                axes.plot(frequency, weight.magnitude(frequency), color=ensemble_colour(i), linewidth=1.2)
            axes.set_xscale("log")
            axes.set_yscale("log")
            plain_log_ticks(axes, "x")
            plain_log_ticks(axes, "y")
            axes.set_xlim(frequency[0], frequency[-1])
            axes.set_title(found.kind)
            axes.set_xlabel("frequency (Hz)")
            unit = (
                "" if found.kind == "multiplicative" else f" ({drawable(f'{units.output}/({units.input})')})"
            )
            axes.set_ylabel(("|G/G₀ − 1|" if found.kind == "multiplicative" else "|G − G₀|") + unit)
        canvas.legend(
            handles=[
                Patch(color=BAND_PARAMETERS, label="50 % to 95 % of the draws"),
                Line2D([], [], color=MUTED, label=f"largest of {format_percent(sets[0].share)}"),
                *(
                    Line2D([], [], color=ensemble_colour(i), label=f"|W|, order {weight.order}")
                    for i, weight in enumerate(sets[0].weights)
                ),
            ],
            loc="outside upper center",
            ncols=3,
        )
        return finished(
            canvas,
            "Distance of the draws from the point estimate G₀ over frequency, and the smallest stable "
            f"weights W of order 1, 2 and 3 that hold {format_percent(sets[0].share)} of the draws at all "
            "frequencies at once: multiplicative (left) and additive (right).",
            "Two panels of magnitude over frequency with three weights each.",
        )
