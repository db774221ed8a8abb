"""Figures of a designed experiment: the command, what it is worth, the intervals it should leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayes_hw.arrays import FloatArray
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    finished,
    new_canvas,
    outline,
    plain_log_ticks,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.palette import BAND_PARAMETERS, DATA, MODEL, MUTED, POSTERIOR, PRIOR, VERMILLION


@dataclass(frozen=True, eq=False)
class PlayedCommand:
    """A command (samples,), believed outputs (draws, samples), and the limits they keep to."""

    t: FloatArray
    u: FloatArray
    outputs: FloatArray
    velocity_limit: float
    stroke: tuple[float, float]
    believed_limits: tuple[tuple[float, float], tuple[float, float]]
    input_unit: str
    output_unit: str


def command(played: PlayedCommand, label: str) -> Figure:
    """The winning command with its limits, and the outputs that the belief expects."""
    low, high = np.min(played.outputs, axis=0), np.max(played.outputs, axis=0)
    with drawing_settings():
        canvas = new_canvas(3.9)
        above, below = canvas.subplots(2, 1, sharex=True)
        for ends in played.believed_limits:
            above.axhspan(*ends, color=BAND_PARAMETERS, alpha=0.35, linewidth=0)
        above.plot(*outline(played.t, played.u), color=DATA, linewidth=0.8)
        for sign in (-1, 1):
            above.axhline(sign * played.velocity_limit, color=VERMILLION, linestyle="--", linewidth=0.9)
        above.set_ylabel(with_unit("command", played.input_unit))
        below.fill_between(played.t, low, high, color=BAND_PARAMETERS, linewidth=0)
        below.plot(*outline(played.t, np.median(played.outputs, axis=0)), color=MODEL, linewidth=0.8)
        for end in played.stroke:
            below.axhline(end, color=VERMILLION, linestyle="--", linewidth=0.9)
        below.set(xlabel="time (s)", ylabel=with_unit("output", played.output_unit))
        below.set_xlim(played.t[0], played.t[-1])
        canvas.legend(
            handles=[
                Line2D([], [], color=DATA, label="command"),
                Line2D([], [], color=MODEL, label="output, median"),
                Patch(color=BAND_PARAMETERS, label="believed saturation limits / range of outputs"),
                Line2D([], [], color=VERMILLION, linestyle="--", label="allowed"),
            ],
            loc="outside upper center",
            ncols=4,
        )
        return finished(
            canvas,
            f"The experiment to make next: {label}. Above, the command and the 94 % intervals of the "
            "saturation limits as now believed; below, the outputs that draws of the posterior give. "
            "Dashed: what the axis may do.",
            "A command over time above the band of expected outputs.",
        )


@dataclass(frozen=True)
class GainBar:
    """Expected gain of one command in nats, its standard error, and whether it was designed."""

    label: str
    nats: float
    standard_error: float
    designed: bool


def gains(bars: Sequence[GainBar]) -> Figure:
    """Expected information gain of every family's best command."""
    with drawing_settings():
        canvas = new_canvas(0.8 + 0.3 * len(bars))
        axes = canvas.subplots()
        rows = np.arange(len(bars))
        axes.barh(
            rows,
            [bar.nats for bar in bars],
            xerr=[2 * bar.standard_error for bar in bars],
            color=[POSTERIOR if bar.designed else PRIOR for bar in bars],
            height=0.62,
            error_kw={"elinewidth": 1.0},
        )
        axes.set_yticks(rows, [wrapped(drawable(bar.label), 34) for bar in bars])
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set_xlabel("expected information gain (nats)")
        return finished(
            canvas,
            "Expected information gain of the best command of every family, and of the first record's "
            "command played again (grey), with two standard errors over the draws of the posterior. One "
            "nat narrows the intervals of the chosen parameters together by a factor of e.",
            f"Bars of expected information gain for {len(bars)} commands.",
        )


@dataclass(frozen=True)
class WidthRow:
    """Widths of one parameter's 94 % interval as shares of today's: predicted, their range, obtained."""

    label: str
    predicted: float
    low: float
    high: float
    obtained: tuple[float, ...] = ()


def widths(rows: Sequence[WidthRow]) -> Figure:
    """Predicted widths, and where it was checked the obtained ones, on a scale of today's."""
    checked = any(row.obtained for row in rows)
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.3 * len(rows))
        axes = canvas.subplots()
        at = np.arange(len(rows))
        axes.hlines(at, [r.low for r in rows], [r.high for r in rows], color=BAND_PARAMETERS, linewidth=7)
        axes.plot([r.predicted for r in rows], at, "|", color=MODEL, markersize=13, markeredgewidth=2)
        for row, place in zip(rows, at, strict=True):
            axes.plot(row.obtained, [place] * len(row.obtained), "o", color=DATA, markersize=3, alpha=0.7)
        axes.axvline(1.0, color=MUTED, linestyle="--", linewidth=0.9)
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set_yticks(at, [drawable(row.label) for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.grid(False, axis="y")
        axes.set_xlabel("width of the 94 % interval / width now")
        handles = [
            Line2D([], [], color=MODEL, marker="|", linestyle="", markersize=9, label="predicted"),
            Line2D([], [], color=BAND_PARAMETERS, linewidth=7, label="80 % of the believed truths"),
        ]
        if checked:
            handles.append(
                Line2D([], [], color=DATA, marker="o", linestyle="", markersize=3, label="obtained")
            )
        canvas.legend(handles=handles, loc="outside upper right", ncols=len(handles))
        return finished(
            canvas,
            "What the experiment is expected to leave of today's 94 % intervals."
            + (
                " Dots: intervals obtained by simulating it on axes drawn from the posterior and sampling "
                "again."
                if checked
                else ""
            ),
            f"Predicted interval widths of {len(rows)} parameters.",
        )


@dataclass(frozen=True)
class CheckRow:
    """Obtained over predicted widths of one parameter, one number a replicate, and their geometric mean."""

    label: str
    ratios: tuple[float, ...]
    mean: float


def width_check(rows: Sequence[CheckRow], tolerance: float) -> Figure:
    """Obtained over predicted widths, each predicted for the truth of its replicate."""
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.3 * len(rows))
        axes = canvas.subplots()
        axes.axvspan(1 - tolerance, 1 + tolerance, color=BAND_PARAMETERS, alpha=0.35, linewidth=0)
        axes.axvline(1.0, color=MUTED, linewidth=0.9)
        for place, row in enumerate(rows):
            axes.plot(row.ratios, [place] * len(row.ratios), "o", color=DATA, markersize=3, alpha=0.6)
            outside = abs(row.mean - 1) > tolerance
            axes.plot(row.mean, place, "D", color=VERMILLION if outside else MODEL, markersize=6)
        axes.set_yticks(range(len(rows)), [drawable(row.label) for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.grid(False, axis="y")
        axes.set_xlabel("obtained / predicted width of the 94 % interval")
        canvas.legend(
            handles=[
                Line2D(
                    [],
                    [],
                    color=DATA,
                    marker="o",
                    linestyle="",
                    markersize=3,
                    label="one simulated experiment",
                ),
                Line2D([], [], color=MODEL, marker="D", linestyle="", label="geometric mean"),
                Patch(color=BAND_PARAMETERS, alpha=0.35, label=f"within {100 * tolerance:.0f} %"),
            ],
            loc="outside upper right",
            ncols=3,
        )
        return finished(
            canvas,
            "The check: the experiment simulated on axes drawn from the posterior, sampled again together "
            "with the earlier records, and the widths compared with those predicted for that axis.",
            f"Ratios of obtained to predicted widths for {len(rows)} parameters.",
        )
