"""Figures of the posterior and of the chains that drew it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import corner
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, MaxNLocator

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.report.page.document import TEXT_WIDTH_INCHES, Figure
from bayes_hw.report.page.drawing import (
    HISTOGRAM_BINS,
    PANEL_CHARACTERS,
    drawable,
    drawing_settings,
    few_ticks,
    finished,
    new_canvas,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.names import ParameterName
from bayes_hw.report.page.palette import (
    ENSEMBLES,
    INK,
    POINT_ESTIMATE,
    POSTERIOR,
    PRIOR,
    TRUTH,
    ensemble_colour,
)
from bayes_hw.report.page.rounding import format_interval, format_percent

CORNER_LIMIT = 8
"""Most parameters whose pairs stay legible at column width."""

CORNER_EDGE = 0.09
"""Share of a panel at either end in which a tick label would run into the next panel's."""

TRACE_ROWS = 8
"""Most rows of traces in two columns; more parameters stand in three."""

TRACE_STEPS = 100
"""Most steps of a trace; longer chains are thinned evenly."""


@dataclass(frozen=True, eq=False)
class Marginal:
    """One parameter's posterior beside its prior.

    `draws` has shape (draws,); `prior_density` maps values in `unit` to density per unit; `hdi` is the
    highest-density interval. `point_estimate` and `truth` are marked where they are known.
    """

    name: ParameterName
    unit: str
    draws: FloatArray
    prior_density: Callable[[FloatArray], FloatArray]
    hdi: tuple[float, float]
    point_estimate: float | None = None
    truth: float | None = None


def priors_and_posteriors(marginals: Sequence[Marginal]) -> Figure:
    """One panel a parameter: prior density, posterior histogram, interval and estimates."""
    with drawing_settings():
        return finished(
            marginals_canvas(marginals),
            "Prior density (dashed) against the posterior draws of each parameter. The bar under each "
            f"histogram, also printed above it, is the {format_percent(INTERVAL_PROBABILITY)} "
            "highest-density interval (HDI). "
            "A posterior as wide as its prior means that the data say nothing about the parameter.",
            f"Grid of {len(marginals)} panels, each with a prior curve and a posterior histogram.",
            rows_together=1,
        )


def marginals_canvas(marginals: Sequence[Marginal]) -> Canvas:
    """The drawing of `priors_and_posteriors`."""
    columns = 4
    rows = -(-len(marginals) // columns)
    with drawing_settings():
        canvas = new_canvas(0.4 + 1.5 * rows, gap_inches=0.07)
        panels = canvas.subplots(rows, columns, squeeze=False).ravel()
        for axes, marginal in zip(panels, marginals, strict=False):
            _draw_marginal(axes, marginal)
        for axes in panels[len(marginals) :]:
            axes.set_axis_off()
        interval = f"{format_percent(INTERVAL_PROBABILITY)} HDI"
        handles: list[Line2D | Patch] = [
            Line2D([], [], color=PRIOR, linestyle="--", label="prior"),
            Patch(facecolor=POSTERIOR, alpha=0.35, label="posterior"),
            Line2D([], [], color=POSTERIOR, linewidth=3, label=interval),
        ]
        if any(m.point_estimate is not None for m in marginals):
            handles.append(Line2D([], [], color=POINT_ESTIMATE, label="point estimate"))
        if any(m.truth is not None for m in marginals):
            handles.append(Line2D([], [], color=TRUTH, linestyle=":", linewidth=2, label="truth"))
        canvas.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return canvas


def _draw_marginal(axes: Axes, marginal: Marginal) -> None:
    low, high = np.quantile(marginal.draws, [0.001, 0.999])
    marks = [m for m in (marginal.point_estimate, marginal.truth) if m is not None]
    low, high = min([low, *marks]), max([high, *marks])
    margin = _margin(low, high, 0.35)
    grid = np.linspace(low - margin, high + margin, 100)
    axes.hist(
        marginal.draws,
        bins=HISTOGRAM_BINS,
        range=(low - 0.1 * margin, high + 0.1 * margin),
        density=True,
        color=POSTERIOR,
        alpha=0.35,
        histtype="stepfilled",
    )
    axes.plot(grid, marginal.prior_density(grid), color=PRIOR, linestyle="--")
    top = axes.get_ylim()[1]
    axes.plot(marginal.hdi, [-0.06 * top] * 2, color=POSTERIOR, linewidth=3, solid_capstyle="butt")
    if marginal.point_estimate is not None:
        axes.axvline(marginal.point_estimate, color=POINT_ESTIMATE)
    if marginal.truth is not None:
        axes.axvline(marginal.truth, color=TRUTH, linestyle=":", linewidth=2)
    axes.set(xlim=(grid[0], grid[-1]), ylim=(-0.13 * top, top), yticks=[])
    axes.spines["left"].set_visible(False)
    few_ticks(axes, PANEL_CHARACTERS)
    axes.set_title(format_interval(*marginal.hdi), loc="center", weight="normal", size=8)
    axes.set_xlabel(wrapped(with_unit(marginal.name.words, marginal.unit), 24), size=8)


def corner_plot(
    draws: FloatArray,
    names: Sequence[ParameterName],
    units: Sequence[str],
    hdi: FloatArray,
    point_estimate: FloatArray | None = None,
) -> Figure:
    """Every pair of parameters; `draws` (draws, parameters), `hdi` (parameters, 2).

    Raises InputError for more parameters than CORNER_LIMIT.
    """
    count = draws.shape[1]
    if count > CORNER_LIMIT:
        raise InputError(f"corner plot: {count} parameters; choose at most {CORNER_LIMIT}")
    with drawing_settings():
        size = TEXT_WIDTH_INCHES if count > 3 else 1.2 + 1.3 * count
        canvas = new_canvas(size, size, automatic_layout=False)
        corner.corner(
            draws,
            fig=canvas,
            bins=20,
            color=POSTERIOR,
            levels=(0.5, INTERVAL_PROBABILITY),
            smooth=1.0,
            plot_datapoints=False,
            plot_density=False,
            fill_contours=True,
            no_fill_contours=False,
            range=[_plot_range(column) for column in draws.T],
            labels=[with_unit(n.symbol, u) for n, u in zip(names, units, strict=True)],
            label_kwargs={"size": 8.5},
            hist_kwargs={"linewidth": 1.0},
            contour_kwargs={"linewidths": 0.7},
            max_n_ticks=2,
            use_math_text=False,
        )
        grid = np.array(canvas.axes).reshape(count, count)
        for index, interval in enumerate(hdi):
            for end in interval:
                grid[index, index].axvline(end, color=POSTERIOR, linestyle="--", linewidth=0.9)
            if point_estimate is not None:
                _mark_estimate(grid, index, float(point_estimate[index]))
        for axes in grid[np.tril_indices(count)]:
            axes.grid(False)
            axes.tick_params(labelsize=7)
            axes.tick_params(axis="x", labelrotation=90)
            axes.tick_params(axis="y", labelrotation=0)
            axes.spines[["right", "top"]].set_visible(True)
            _keep_off_edges(axes.xaxis)
            if len(axes.get_yticks()):
                _keep_off_edges(axes.yaxis)
        _place_corner_labels(canvas, grid)
        level = format_percent(INTERVAL_PROBABILITY)
        estimate = "; vermillion lines mark the point estimate" if point_estimate is not None else ""
        return finished(
            canvas,
            f"Pairs of parameters. Contours hold 50 % and {level} of the joint posterior; dashed lines on "
            f"the diagonal are the ends of the {level} highest-density interval{estimate}. "
            "Symbols: " + ", ".join(f"{n.symbol} {n.words}" for n in names) + ".",
            f"Corner plot of {count} parameters.",
        )


def _place_corner_labels(canvas: Canvas, grid: np.ndarray) -> None:
    """Room for upright tick labels, with axis labels beyond them, in inches whatever the panels' size."""
    width = float(canvas.get_figwidth())
    canvas.subplots_adjust(0.85 / width, 0.85 / width, 1 - 0.05 / width, 1 - 0.05 / width, 0.06, 0.06)
    panel = grid[0, 0].get_position().width * width
    for axes in grid[-1]:
        axes.xaxis.set_label_coords(0.5, -0.68 / panel)
    for axes in grid[1:, 0]:
        axes.yaxis.set_label_coords(-0.68 / panel, 0.5)


def _keep_off_edges(axis: Axis) -> None:
    """Two ticks or a few more, whose labels do not reach into the next panel."""
    low, high = sorted(axis.get_view_interval())
    edge = CORNER_EDGE * (high - low)
    kept: list[float] = []
    for count in range(2, 6):
        ticks = MaxNLocator(count).tick_values(low, high)
        kept = [tick for tick in ticks if low + edge <= tick <= high - edge]
        if len(kept) >= 2:
            break
    axis.set_major_locator(FixedLocator(kept))


def _plot_range(values: FloatArray) -> tuple[float, float]:
    low, high = (float(end) for end in np.quantile(values, [0.001, 0.999]))
    margin = _margin(low, high, 0.1)
    return low - margin, high + margin


def _margin(low: float, high: float, share: float) -> float:
    """`share` of the range; a thousandth of the value where there is no range beyond rounding."""
    least = 1e-9 * max(abs(low), abs(high))
    return share * (high - low) if high - low > least else 1e-3 * (abs(high) or 1.0)


def _mark_estimate(grid: np.ndarray, index: int, value: float) -> None:
    for axes in grid[index:, index]:
        axes.axvline(value, color=POINT_ESTIMATE, linewidth=0.9)
    for axes in grid[index, :index]:
        axes.axhline(value, color=POINT_ESTIMATE, linewidth=0.9)


def traces(
    chains: FloatArray,
    names: Sequence[ParameterName],
    units: Sequence[str],
) -> Figure:
    """A walker of every ensemble; `chains` (ensembles, steps, walkers, parameters)."""
    ensembles, steps, walkers, count = chains.shape
    thin = -(-steps // TRACE_STEPS)
    columns = 2 if count <= 2 * TRACE_ROWS else 3
    rows = -(-count // columns)
    with drawing_settings():
        canvas = new_canvas(0.6 + 1.1 * rows)
        panels = canvas.subplots(rows, columns, squeeze=False, sharex=True).ravel()
        at = np.arange(0, steps, thin)
        for parameter, axes in enumerate(panels[:count]):
            for ensemble in range(ensembles):
                axes.plot(
                    at,
                    chains[ensemble, ::thin, 0, parameter],
                    color=ensemble_colour(ensemble),
                    linewidth=0.5,
                    alpha=0.7,
                )
            label = with_unit(names[parameter].words, units[parameter])
            axes.set_title(wrapped(label, 90 // columns), weight="normal", size=8.5 if columns == 2 else 7.5)
            axes.yaxis.set_major_locator(MaxNLocator(4))
        for axes in panels[count:]:
            axes.set_axis_off()
        for axes in panels[max(0, count - columns) : count]:
            axes.tick_params(labelbottom=True)
            axes.set_xlabel("step after burn-in")
        handles = [
            Line2D([], [], color=ensemble_colour(e), label=f"ensemble {e + 1}")
            for e in range(min(ensembles, len(ENSEMBLES)))
        ]
        canvas.legend(handles=handles, loc="outside upper center", ncols=min(4, len(handles)))
        return finished(
            canvas,
            f"Traces: 1 of {walkers} walkers from each of {ensembles} independent ensembles, "
            f"every {_ordinal(thin)} step. Ensembles that lie on one another have found the same posterior.",
            f"Trace plots of {count} parameters coloured by ensemble.",
            rows_together=1,
        )


def autocorrelation(functions: FloatArray, times: FloatArray, names: Sequence[ParameterName]) -> Figure:
    """Autocorrelation functions (parameters, lags) and integrated times (parameters,) in steps."""
    lags = np.arange(functions.shape[1])
    with drawing_settings():
        canvas = new_canvas(max(2.5, 0.9 + 0.19 * len(names)))
        left, right = canvas.subplots(1, 2, width_ratios=(3, 2))
        left.plot(lags, functions.T, color=POSTERIOR, linewidth=0.9, alpha=0.7)
        left.axhline(0, color=INK, linewidth=0.7)
        left.set(xlabel="lag (steps)", ylabel="autocorrelation", xlim=(0, lags[-1]))
        rows = np.arange(len(names))
        right.barh(rows, np.where(np.isfinite(times), times, 0.0), color=POSTERIOR, height=0.65)
        right.bar_label(
            right.containers[0],
            [f" {time:.1f}" if np.isfinite(time) else " not known" for time in times],
            size=8,
        )
        right.set_yticks(rows, [drawable(name.symbol) for name in names])
        right.set(
            xlabel="autocorrelation time τ (steps)", xlim=(0, 1.25 * float(np.nanmax(times, initial=1.0)))
        )
        right.invert_yaxis()
        right.grid(False, axis="y")
        return finished(
            canvas,
            "Left: autocorrelation of each parameter's chain, averaged over walkers, one line a parameter. "
            "Right: integrated autocorrelation time τ; one draw in τ is as good as an independent one.",
            f"Autocorrelation functions and times of {len(names)} parameters.",
        )


def _ordinal(number: int) -> str:
    if number == 1:
        return "single"
    suffix = {1: "st", 2: "nd", 3: "rd"}.get(number % 10 if number // 10 % 10 != 1 else 0, "th")
    return f"{number}{suffix}"
