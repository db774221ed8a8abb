"""Figures of the study of error sources: biases in units of their intervals, and shares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.patches import Patch

from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas
from bayes_hw.report.page.palette import BLUE, GREEN, INK, MUTED, ORANGE, PAPER, PURPLE, SKY, VERMILLION
from bayes_hw.report.page.rounding import format_number

FAMILY_COLOURS = {
    "noise": BLUE,
    "quantization": SKY,
    "sampling": GREEN,
    "order": ORANGE,
    "structure": VERMILLION,
}
WORST = 30.0
"""Ratio of bias to half interval from which a cell has its darkest colour."""


def bias_in_half_widths(ratios: Mapping[str, Mapping[str, float]], parameters: Sequence[str]) -> Figure:
    """One cell for every source and parameter: size of the bias over half the interval."""
    values = np.array([[row.get(name, np.nan) for name in parameters] for row in ratios.values()])
    shades = LinearSegmentedColormap.from_list("bias", [PAPER, ORANGE, VERMILLION])
    with drawing_settings():
        canvas = new_canvas(0.8 + 0.3 * max(len(ratios), 3))
        axes = canvas.subplots()
        axes.pcolormesh(
            np.ma.masked_invalid(np.clip(values, 1.0, WORST)),
            cmap=shades,
            norm=LogNorm(1.0, WORST),
            edgecolors=PAPER,
            linewidth=1.5,
        )
        for row, column in np.ndindex(values.shape):
            value = values[row, column]
            text = "–" if np.isnan(value) else format_number(float(value), 2)
            lies = value > 1
            axes.text(
                column + 0.5,
                row + 0.5,
                text,
                ha="center",
                va="center",
                color=INK if lies else MUTED,
                weight="bold" if lies else "normal",
            )
        axes.set_xticks(np.arange(len(parameters)) + 0.5, list(parameters))
        axes.set_yticks(np.arange(len(ratios)) + 0.5, list(ratios))
        axes.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False)
        axes.invert_yaxis()
        axes.grid(False)
        for spine in axes.spines.values():
            spine.set_visible(False)
        return finished(
            canvas,
            "Size of the bias over half the 94 % interval, one error source a row. Above one (bold, shaded)"
            " the interval lies: its parameter is sure of a wrong value. Limits s, dead zone δ, frequencies"
            " f and damping ratios ζ of the modes; a dash is a parameter that the model does not have.",
            f"{len(ratios)} sources by {len(parameters)} parameters, the ratio of bias and half interval"
            " in each cell.",
        )


def shares_by_source(
    widths: Mapping[str, Mapping[str, float]],
    biases: Mapping[str, Mapping[str, float]],
    families: Mapping[str, str],
) -> Figure:
    """Two panels of stacked bars, one bar a parameter: shares of the width and of the bias."""
    with drawing_settings():
        canvas = new_canvas(1.0 + 0.26 * max(len(widths), 3))
        left, right = canvas.subplots(1, 2, sharey=True)
        _stacked(left, widths, families)
        _stacked(right, biases, families)
        left.set(xlabel="share of the added squared width", xlim=(0, 1))
        right.set(xlabel="share of the bias", xlim=(0, 1))
        left.invert_yaxis()
        canvas.legend(
            handles=[
                Patch(facecolor=colour, edgecolor=PAPER, label=family)
                for family, colour in FAMILY_COLOURS.items()
                if family in families.values()
            ],
            loc="outside upper center",
            ncols=len(FAMILY_COLOURS),
        )
        return finished(
            canvas,
            "What widens the intervals (left) and what biases them (right), by parameter; sources of a kind"
            " stand side by side in its colour.",
            "Stacked bars of the shares of noise, quantization, sampling, order and structure.",
        )


def _stacked(axes: Axes, shares: Mapping[str, Mapping[str, float]], families: Mapping[str, str]) -> None:
    for row, parts in enumerate(shares.values()):
        start = 0.0
        for name, share in parts.items():
            axes.barh(
                row,
                share,
                left=start,
                height=0.7,
                color=FAMILY_COLOURS.get(families[name], PURPLE),
                edgecolor=PAPER,
                linewidth=0.8,
            )
            start += share
    axes.set_yticks(range(len(shares)), list(shares))
    axes.grid(False, axis="y")
