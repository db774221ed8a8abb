"""Figures of a calibration from records alone: coverage by kind of parameter, widths over their bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from recovery import LEVELS
from recovery_summary import RecoverySummary

from bayes_hw.arrays import FloatArray
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, plain_log_ticks
from bayes_hw.report.page.palette import BAND_NOISE, INK, MUTED, POSTERIOR, VERMILLION

HALF_ROW = 0.34
WIDEST, NARROWEST = 10.0, 0.1
"""Widths over the bound beyond these are drawn at the edge."""


def coverage_by_kind(summary: RecoverySummary, what: str) -> Figure:
    """One panel a level, one row a kind: share of the intervals that hold the truth, with its band."""
    kinds = list(summary.coverage)
    outside = summary.outside()
    with drawing_settings():
        canvas = new_canvas(1.15 + 0.3 * len(kinds))
        panels = canvas.subplots(1, len(LEVELS), sharey=True, squeeze=False)[0]
        for column, (axes, level) in enumerate(zip(panels, LEVELS, strict=True)):
            for row, kind in enumerate(kinds):
                entry = summary.coverage[kind][column]
                low, high = 100 * summary.band[kind][:, column] / entry.replicates
                axes.fill_betweenx([row - HALF_ROW, row + HALF_ROW], low, high, color=BAND_NOISE, linewidth=0)
                colour = VERMILLION if (kind, level) in outside else POSTERIOR
                axes.plot(100 * entry.achieved, row, "o", color=colour, markersize=4.5)
            axes.axvline(100 * level, color=INK, linestyle="--", linewidth=0.9)
            axes.set_title(f"{100 * level:.0f} % intervals")
            axes.set_yticks(range(len(kinds)), kinds)
            axes.grid(False, axis="y")
        panels[0].invert_yaxis()
        canvas.supxlabel("intervals that hold the truth (%)", size=9)
        canvas.legend(
            handles=[
                Line2D([], [], color=POSTERIOR, marker="o", linestyle="", label="achieved"),
                Patch(color=BAND_NOISE, label="simultaneous 95 % band"),
                Line2D([], [], color=INK, linestyle="--", linewidth=0.9, label="nominal"),
            ],
            loc="outside upper right",
            ncols=3,
        )
        found = ", ".join(f"{kind} at {100 * level:.0f} %" for kind, level in outside)
        return finished(
            canvas,
            f"Coverage from records alone, {what}. Bands hold the points of all kinds and levels at once in "
            "95 of 100 such studies when the intervals hold as often as they say. Orange: outside. "
            + (f"Outside here: {found}." if outside else "None leaves its band here."),
            f"Achieved coverage of {len(kinds)} kinds of parameter at {len(LEVELS)} levels; "
            f"{len(outside)} of {len(kinds) * len(LEVELS)} points leave their band.",
        )


def widths_over_bound(sets: Mapping[str, Mapping[str, FloatArray]], aim: float) -> Figure:
    """One row a kind and set: the 94 % intervals over their Cramer-Rao bound, the median marked."""
    rows = [(label, kind, widths) for label, kinds in sets.items() for kind, widths in kinds.items()]
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.24 * len(rows))
        axes = canvas.subplots()
        for row, (_, _, widths) in enumerate(rows):
            shown = np.clip(widths, NARROWEST, WIDEST)
            axes.plot(
                shown, row + _aside(shown), "o", color=POSTERIOR, markersize=2.2, alpha=0.5, rasterized=True
            )
            axes.plot(float(np.median(shown)), row, "|", color=VERMILLION, markersize=13, markeredgewidth=2)
        axes.axvline(1.0, color=INK, linestyle="--", linewidth=0.9)
        axes.axvline(aim, color=MUTED, linestyle=":", linewidth=1.1)
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set_yticks(range(len(rows)), [f"{label}: {kind}" for label, kind, _ in rows])
        axes.set_xlabel("94 % interval over that at the Cramér-Rao bound")
        axes.grid(False, axis="y")
        axes.invert_yaxis()
        return finished(
            canvas,
            "Efficiency: widths of the 94 % intervals over those that an unbiased normal estimate at the "
            "Cramér-Rao bound would have, the true structure known. Orange: medians; dashed: the bound; "
            f"dotted: {aim:g}. Points below the bound owe it to priors, to fewer poles than the truth has, "
            "or are too narrow; points beyond the edges are drawn at them.",
            f"Interval widths over the bound in {len(rows)} rows with medians.",
        )


def _aside(values: Sequence[float] | FloatArray) -> FloatArray:
    """Small even offsets (n,) that part points of one row."""
    return 0.5 * (np.mod(np.arange(len(values)) * 0.618, 1.0) - 0.5)
