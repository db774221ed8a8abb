"""Figures of profile likelihoods and of the paths that the other parameters take along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from bayes_hw.arrays import FloatArray
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    PANEL_CHARACTERS,
    drawable,
    drawing_settings,
    few_ticks,
    finished,
    new_canvas,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.palette import ENSEMBLES, INK, MUTED, POSTERIOR, VERMILLION, ensemble_colour

COLUMNS = 4
DEEPEST_SHOWN = -4.5


@dataclass(frozen=True, eq=False)
class ProfilePanel:
    """One profile: parameter values (points,), log-likelihood (points,) relative to its maximum, and
    `paths` (points, others) of the other parameters in prior standard deviations from the estimate, with
    their `symbols`. `at_bound` (points,) marks points where one of them stands at its bound; `open_sides`
    says which sides never fall."""

    label: str
    unit: str
    values: FloatArray
    log_likelihood: FloatArray
    paths: FloatArray
    symbols: tuple[str, ...]
    at_bound: FloatArray
    estimate: float
    open_sides: str


def profiles(panels: Sequence[ProfilePanel], threshold: float) -> Figure:
    """One panel a parameter: its profile log-likelihood with the threshold of a 95 % interval."""
    rows = -(-len(panels) // COLUMNS)
    with drawing_settings():
        canvas = new_canvas(0.4 + 1.55 * rows, gap_inches=0.06)
        panels_axes = canvas.subplots(rows, COLUMNS, sharey=True, squeeze=False).ravel()
        for axes, panel in zip(panels_axes, panels, strict=False):
            axes.axhline(-threshold, color=MUTED, linestyle="--", linewidth=0.9)
            colour = VERMILLION if panel.open_sides else POSTERIOR
            axes.plot(panel.values, panel.log_likelihood, ".-", color=colour, markersize=4, linewidth=1.1)
            bound = panel.at_bound > 0
            axes.plot(
                panel.values[bound],
                panel.log_likelihood[bound],
                "s",
                color=INK,
                markersize=5,
                fillstyle="none",
            )
            axes.axvline(panel.estimate, color=MUTED, linewidth=0.6)
            axes.set_ylim(DEEPEST_SHOWN, 0.3)
            _label(axes, panel)
        for axes in panels_axes[len(panels) :]:
            axes.set_axis_off()
        canvas.supylabel("profile log-likelihood", size=9)
        canvas.legend(
            handles=[
                Line2D([], [], color=POSTERIOR, marker=".", label="falls on both sides"),
                Line2D([], [], color=VERMILLION, marker=".", label="open on a side"),
                Line2D([], [], color=MUTED, linestyle="--", label="95 % threshold"),
                Line2D(
                    [],
                    [],
                    color=INK,
                    marker="s",
                    linestyle="",
                    fillstyle="none",
                    label="another at its bound",
                ),
            ],
            loc="outside upper center",
            ncols=4,
        )
        return finished(
            canvas,
            "Profile log-likelihood of every parameter, all others re-estimated at each point, relative to "
            f"the best. Where it falls below the dashed line (by {threshold:g}) on both sides the records "
            "alone bound the parameter; a side on which it never does is open and left to the prior. "
            "Squares mark points where another parameter had reached its bound, so that the fall may not "
            "be the parameter's own.",
            f"Profile log-likelihoods of {len(panels)} parameters.",
        )


def nuisance_paths(panels: Sequence[ProfilePanel]) -> Figure:
    """One panel a parameter: where the other parameters go along its profile."""
    rows = -(-len(panels) // COLUMNS)
    symbols = list(dict.fromkeys(symbol for panel in panels for symbol in panel.symbols))
    with drawing_settings():
        canvas = new_canvas(0.5 + 1.55 * rows, gap_inches=0.06)
        panels_axes = canvas.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axes, panel in zip(panels_axes, panels, strict=False):
            for path, symbol in zip(panel.paths.T, panel.symbols, strict=True):
                axes.plot(
                    panel.values,
                    path,
                    color=ensemble_colour(symbols.index(symbol)),
                    linestyle=_style(symbols.index(symbol)),
                )
            axes.axvline(panel.estimate, color=MUTED, linewidth=0.6)
            axes.yaxis.set_major_locator(MaxNLocator(3))
            _label(axes, panel)
        for axes in panels_axes[len(panels) :]:
            axes.set_axis_off()
        canvas.supylabel("others (prior sd from their estimates)", size=9)
        canvas.legend(
            handles=[
                Line2D([], [], color=ensemble_colour(i), label=drawable(symbol), linestyle=_style(i))
                for i, symbol in enumerate(symbols)
            ],
            loc="outside upper center",
            ncols=min(len(symbols), 10),
        )
        return finished(
            canvas,
            "The paths of the other parameters along each profile, in prior standard deviations: which of "
            "them gives way when a parameter is moved. Note the scales, which differ from panel to panel.",
            f"Paths of nuisance parameters along {len(panels)} profiles.",
        )


def _label(axes: Axes, panel: ProfilePanel) -> None:
    axes.set_xlabel(wrapped(with_unit(panel.label, panel.unit), 20), size=8)
    axes.tick_params(labelsize=7)
    few_ticks(axes, PANEL_CHARACTERS, 2)


def _style(index: int) -> str:
    return "-" if index < len(ENSEMBLES) else "--"
