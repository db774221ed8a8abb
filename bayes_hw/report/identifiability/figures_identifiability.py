"""Figures of what the records can and cannot tell: ridges, contraction, spectra, ratios."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    HISTOGRAM_BINS,
    drawable,
    drawing_settings,
    finished,
    new_canvas,
    plain_log_ticks,
    wrapped,
)
from bayes_hw.report.page.palette import GREEN, INK, MUTED, ORANGE, POSTERIOR, PRIOR, VERMILLION
from bayes_hw.report.page.rounding import format_percent

CLOUD_DRAWS = 1_500
SMALLEST_SHOWN = 1e-4
"""Eigenvalues below this are drawn at the edge."""


@dataclass(frozen=True, eq=False)
class RidgePanel:
    """Two raw parameters whose ratio or product alone the records know, as logarithms to base ten.

    `x`, `y` (draws,) are posterior draws; `orbit` (points, 2) the orbit through their centre; `prior_sd` and
    `prior_mean` (2,) those of the normal priors.
    """

    x_label: str
    y_label: str
    x: FloatArray
    y: FloatArray
    orbit: FloatArray
    prior_mean: FloatArray
    prior_sd: FloatArray
    known: str


def ridge(panels: Sequence[RidgePanel]) -> Figure:
    """Draws on their ridges, the orbit of the scaling group through them, and the prior they came from."""
    columns = 2
    rows = -(-len(panels) // columns)
    angle = np.linspace(0, 2 * np.pi, 100)
    with drawing_settings():
        canvas = new_canvas(0.5 + 2.7 * rows, gap_inches=0.08)
        for axes, panel in zip(canvas.subplots(rows, columns, squeeze=False).ravel(), panels, strict=False):
            for sds in (1.0, 2.0):
                x = panel.prior_mean[0] + sds * panel.prior_sd[0] * np.cos(angle)
                y = panel.prior_mean[1] + sds * panel.prior_sd[1] * np.sin(angle)
                axes.plot(10**x, 10**y, color=PRIOR, linestyle="--", linewidth=0.8)
            axes.plot(*(10**panel.orbit.T), color=ORANGE, linewidth=5.0, alpha=0.45, solid_capstyle="butt")
            kept = slice(None, None, max(1, len(panel.x) // CLOUD_DRAWS))
            axes.plot(
                10 ** panel.x[kept],
                10 ** panel.y[kept],
                ".",
                color=POSTERIOR,
                markersize=1.8,
                alpha=0.6,
                markeredgewidth=0,
                rasterized=True,
            )
            _logarithmic(axes, panel)
            axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
            axes.set_title(f"known: {panel.known}", weight="normal")
        canvas.legend(
            handles=[
                Line2D([], [], color=PRIOR, linestyle="--", label="prior, 1 and 2 sd"),
                Line2D([], [], color=POSTERIOR, marker=".", linestyle="", label="posterior, all gains free"),
                Line2D([], [], color=ORANGE, alpha=0.45, linewidth=5, label="orbit: same output everywhere"),
            ],
            loc="outside upper center",
            ncols=3,
        )
        return finished(
            canvas,
            "The ridge of the posterior with all gains free, on logarithmic axes. Every point of the broad "
            "line gives the same output to rounding: it is the orbit of the scaling group v → a v, w → b w "
            "through the middle of the draws. Along it only the priors (dashed) place the draws; across it "
            "the records do, mostly more narrowly than a dot is wide.",
            f"{len(panels)} scatter plots of draws that lie along straight lines.",
        )


def _logarithmic(axes: Axes, panel: RidgePanel) -> None:
    """Logarithmic axes that hold two prior standard deviations and every draw, labelled 1, 2, 5, 10, ..."""
    axes.set(xscale="log", yscale="log")
    ends = []
    for draws, mean, sd in zip((panel.x, panel.y), panel.prior_mean, panel.prior_sd, strict=True):
        reach = max(2.2 * float(sd), 1.1 * float(np.max(np.abs(draws - mean))))
        ends.append((10 ** (mean - reach), 10 ** (mean + reach)))
    axes.set(xlim=ends[0], ylim=ends[1])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_locator(NullLocator())


@dataclass(frozen=True)
class ContractionRow:
    """Contraction of one quantity, and for a raw parameter what pooling of priors alone would give."""

    label: str
    contraction: float
    by_pooling: float | None


def contraction_bars(rows: Sequence[ContractionRow]) -> Figure:
    """One bar a quantity on a scale of posterior over prior standard deviation."""
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.24 * len(rows))
        axes = canvas.subplots()
        at = np.arange(len(rows))
        left = [np.sqrt(max(1 - row.contraction, 1e-12)) for row in rows]
        colours = [VERMILLION if row.by_pooling is not None else POSTERIOR for row in rows]
        axes.hlines(at, left, 1.0, color=colours, linewidth=4)
        for row, place in zip(rows, at, strict=True):
            if row.by_pooling is not None:
                axes.plot(
                    np.sqrt(1 - row.by_pooling), place, "|", color=INK, markersize=11, markeredgewidth=1.4
                )
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set_yticks(at, [drawable(row.label) for row in rows])
        axes.invert_yaxis()
        axes.set(xlabel="posterior / prior standard deviation of the logarithm", xlim=(None, 1.0))
        axes.grid(False, axis="y")
        canvas.legend(
            handles=[
                Line2D([], [], color=VERMILLION, linewidth=4, label="raw parameter"),
                Line2D([], [], color=POSTERIOR, linewidth=4, label="invariant"),
                Line2D(
                    [], [], color=INK, marker="|", linestyle="", label="pooled priors alone", markersize=9
                ),
            ],
            loc="outside upper right",
            ncols=3,
        )
        return finished(
            canvas,
            "How far each quantity contracted from prior to posterior when all gains are free; the bar "
            "ends at the ratio of the standard deviations. Raw parameters stop at the upright mark: what "
            "several priors pooled along the orbit give, whatever the records say. Invariants go on to "
            "what the records know.",
            f"Bars of contraction for {len(rows)} quantities.",
        )


@dataclass(frozen=True, eq=False)
class SpectrumPanel:
    """Eigenvalues (parameters,) of one parametrisation and how many of them no experiment could lift."""

    label: str
    eigenvalues: FloatArray
    exactly_flat: int


def spectra(panels: Sequence[SpectrumPanel]) -> Figure:
    """Eigenvalues of the information in prior units, one panel a parametrisation."""
    with drawing_settings():
        canvas = new_canvas(2.9)
        for axes, panel in zip(
            canvas.subplots(1, len(panels), sharey=True, squeeze=False)[0], panels, strict=True
        ):
            values = np.maximum(panel.eigenvalues, SMALLEST_SHOWN)
            at = np.arange(1, len(values) + 1)
            flat = at > len(values) - panel.exactly_flat
            axes.axhline(1.0, color=MUTED, linestyle="--", linewidth=0.9)
            for chosen, colour, marker in ((~flat, POSTERIOR, "o"), (flat, VERMILLION, "v")):
                axes.vlines(
                    at[chosen], SMALLEST_SHOWN, values[chosen], color=colour, linewidth=1.0, alpha=0.5
                )
                axes.plot(at[chosen], values[chosen], marker, color=colour, markersize=4.5)
            axes.set_yscale("log")
            axes.set_ylim(bottom=SMALLEST_SHOWN / 2)
            axes.set_title(wrapped(panel.label, 28), weight="normal")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        plain_log_ticks(canvas.axes[0], "y")
        canvas.axes[0].set_ylabel("information (prior precisions)")
        canvas.supxlabel("direction, best known first", size=9)
        return finished(
            canvas,
            "Spectrum of the Fisher information of the records, each parameter scaled by its prior's "
            "standard deviation. Above the dashed line the records know a direction better than the prior, "
            f"below it the prior does; values below {SMALLEST_SHOWN:g} are drawn there. Orange triangles: "
            "directions of the scaling group, flat in any experiment.",
            f"Eigenvalue spectra of {len(panels)} parametrisations.",
        )


@dataclass(frozen=True, eq=False)
class RatioPanel:
    """Posterior draws (draws,) of a ratio that the paper sets to one, with its prior density by value."""

    label: str
    draws: FloatArray
    prior_density: Callable[[FloatArray], FloatArray]
    hdi: tuple[float, float]
    text: str


def ratios(panels: Sequence[RatioPanel], prior_words: str) -> Figure:
    """Posterior of each ratio beside its prior, one marked."""
    level = format_percent(INTERVAL_PROBABILITY)
    with drawing_settings():
        canvas = new_canvas(2.6)
        for axes, panel in zip(canvas.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            low, high = np.quantile(panel.draws, [0.001, 0.999])
            low, high = min(low, 1.0), max(high, 1.0)
            margin = 0.25 * (high - low)
            grid = np.linspace(max(low - margin, 1e-6), high + margin, 200)
            axes.hist(
                panel.draws,
                bins=HISTOGRAM_BINS,
                density=True,
                color=POSTERIOR,
                alpha=0.35,
                histtype="stepfilled",
            )
            axes.plot(grid, panel.prior_density(grid), color=PRIOR, linestyle="--")
            top = axes.get_ylim()[1]
            axes.plot(panel.hdi, [-0.05 * top] * 2, color=POSTERIOR, linewidth=3, solid_capstyle="butt")
            axes.axvline(1.0, color=GREEN, linestyle=":", linewidth=1.8)
            axes.set(
                xlim=(grid[0], grid[-1]), ylim=(-0.1 * top, top), yticks=[], xlabel=drawable(panel.label)
            )
            axes.spines["left"].set_visible(False)
            axes.set_title(panel.text, weight="normal", size=8.5)
            axes.xaxis.set_major_locator(MaxNLocator(5))
        canvas.legend(
            handles=[
                Line2D([], [], color=PRIOR, linestyle="--", label=prior_words),
                Patch(facecolor=POSTERIOR, alpha=0.35, label="posterior"),
                Line2D([], [], color=POSTERIOR, linewidth=3, label=f"{level} HDI"),
                Line2D([], [], color=GREEN, linestyle=":", linewidth=1.8, label="the paper's assumption"),
            ],
            loc="outside upper center",
            ncols=4,
        )
        return finished(
            canvas,
            "The two assumptions among the paper's settings. The ratio of the gains above and below the "
            "dead zone, and that of its thresholds, are seen by the records; the paper sets both to one "
            "(dotted).",
            f"Posterior histograms of {len(panels)} ratios with the value one marked.",
        )
