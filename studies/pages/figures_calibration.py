"""Figures of a calibration: are the ranks of the true values uniform, do the intervals hold them?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayes_hw.arrays import FloatArray
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawable, drawing_settings, finished, new_canvas, wrapped
from bayes_hw.report.page.palette import BAND_NOISE, INK, NOMINAL, POSTERIOR, VERMILLION
from bayes_hw.report.page.rounding import format_percent

COLUMNS = 4
TITLE_LENGTH = 20


@dataclass(frozen=True, eq=False)
class RankPanel:
    """Ranks of one quantity against simultaneous bands.

    `counts`, `lower`, `upper` (bins,) are those of a histogram; `difference`, `difference_lower` and
    `difference_upper` (points,) the empirical minus the uniform distribution function at `probability`.
    """

    label: str
    counts: FloatArray
    lower: FloatArray
    upper: FloatArray
    probability: FloatArray
    difference: FloatArray
    difference_lower: FloatArray
    difference_upper: FloatArray

    @property
    def leaves_difference_band(self) -> bool:
        outside = (self.difference < self.difference_lower) | (self.difference > self.difference_upper)
        return bool(np.any(outside))

    @property
    def leaves_histogram_band(self) -> bool:
        return bool(np.any((self.counts < self.lower) | (self.counts > self.upper)))


def ecdf_differences(panels: Sequence[RankPanel], what: str, probability: float = 0.95) -> Figure:
    """One panel a quantity: empirical minus uniform distribution function of the ranks of `what`."""
    reach = 1.1 * max(
        float(np.max(np.abs([*p.difference, *p.difference_lower, *p.difference_upper]))) for p in panels
    )
    outside = [p.label for p in panels if p.leaves_difference_band]
    with drawing_settings():
        canvas = new_canvas(0.7 + 1.25 * _rows(panels), gap_inches=0.05)
        axes_of = canvas.subplots(_rows(panels), COLUMNS, sharex=True, sharey=True, squeeze=False)
        for axes, panel in _filled(axes_of.ravel(), panels):
            edge = np.concatenate([[0.0], panel.probability, [1.0]])
            lower, upper = np.pad(panel.difference_lower, 1), np.pad(panel.difference_upper, 1)
            axes.fill_between(edge, lower, upper, color=BAND_NOISE, linewidth=0)
            axes.axhline(0, color=NOMINAL, linewidth=0.7)
            axes.plot(edge, np.pad(panel.difference, 1), color=_colour(panel.leaves_difference_band))
            axes.set(xlim=(0, 1), ylim=(-reach, reach), xticks=[0, 0.5, 1])
        canvas.supxlabel("rank of the truth / number of draws", size=9)
        canvas.supylabel("ECDF difference", size=9)
        _legend(canvas, "ranks", "uniform", probability)
        return finished(
            canvas,
            f"Ranks of the true values, {what}: empirical distribution function minus that of uniform "
            f"ranks, with simultaneous {format_percent(probability)} bands (Säilynoja, Bürkner and "
            "Vehtari). A curve that leaves its band is orange. A line above zero on the left and below on "
            "the right means intervals that are too narrow, an arch above or below zero a shifted posterior. "
            + _outside(outside),
            f"{len(panels)} curves of the ECDF difference with bands; {len(outside)} leave their band.",
        )


def rank_histograms(panels: Sequence[RankPanel], what: str, probability: float = 0.95) -> Figure:
    """One panel a quantity: histogram of the ranks of `what`."""
    outside = [p.label for p in panels if p.leaves_histogram_band]
    with drawing_settings():
        canvas = new_canvas(0.7 + 1.2 * _rows(panels), gap_inches=0.05)
        axes_of = canvas.subplots(_rows(panels), COLUMNS, sharex=True, sharey=True, squeeze=False)
        for axes, panel in _filled(axes_of.ravel(), panels):
            bins = len(panel.counts)
            edges = np.linspace(0, 1, bins + 1)
            axes.axhspan(panel.lower[0], panel.upper[0], color=BAND_NOISE, linewidth=0)
            colour = _colour(panel.leaves_histogram_band)
            axes.stairs(panel.counts, edges, baseline=None, color=colour, linewidth=1.2)
            axes.axhline(float(panel.counts.sum()) / bins, color=NOMINAL, linewidth=0.7)
            axes.set(xlim=(0, 1), xticks=[0, 0.5, 1])
            axes.set_ylim(bottom=0)
            axes.grid(False)
        canvas.supxlabel("rank of the truth / number of draws", size=9)
        canvas.supylabel("replicates", size=9)
        _legend(canvas, "ranks", "uniform", probability)
        return finished(
            canvas,
            f"Rank histograms, {what}, with simultaneous {format_percent(probability)} bands over the bins "
            "of each panel. A heap at both ends means intervals that are too narrow, a heap in the middle "
            "ones that are too wide. " + _outside(outside),
            f"{len(panels)} histograms of ranks with bands; {len(outside)} leave their band.",
        )


@dataclass(frozen=True)
class IntervalPoint:
    """Coverage of one parameter's intervals with its 95 % binomial interval."""

    parameter: str
    kind: str
    nominal: float
    achieved: float
    lower: float
    upper: float


def interval_coverage(points: Sequence[IntervalPoint]) -> Figure:
    """One panel a kind of interval, one row a parameter: achieved coverage against the nominal one."""
    kinds = list(dict.fromkeys(p.kind for p in points))
    parameters = list(dict.fromkeys(p.parameter for p in points))
    with drawing_settings():
        canvas = new_canvas(0.95 + 0.24 * len(parameters))
        for axes, kind in zip(
            canvas.subplots(1, len(kinds), sharey=True, squeeze=False)[0], kinds, strict=True
        ):
            shown = [p for p in points if p.kind == kind]
            for p in shown:
                row = parameters.index(p.parameter)
                colour = _colour(not p.lower <= p.nominal <= p.upper)
                axes.plot([100 * p.lower, 100 * p.upper], [row, row], color=colour, linewidth=1.6)
                axes.plot(100 * p.achieved, row, "o", color=colour, markersize=3.5)
            axes.axvline(100 * shown[0].nominal, color=INK, linestyle="--", linewidth=0.9)
            axes.set_title(drawable(kind))
            axes.set_yticks(range(len(parameters)), [drawable(name) for name in parameters])
            axes.grid(False, axis="y")
        canvas.axes[0].invert_yaxis()
        canvas.supxlabel("intervals that hold the truth (%)", size=9)
        return finished(
            canvas,
            "Coverage: share of the replicates whose interval holds the true value, with 95 % binomial "
            "intervals (Clopper-Pearson); dashed: the nominal share. Orange: the nominal share lies outside. "
            "One in twenty does so by chance.",
            f"Achieved coverage of {len(parameters)} parameters in {len(kinds)} panels.",
        )


def _rows(panels: Sequence[RankPanel]) -> int:
    return -(-len(panels) // COLUMNS)


def _filled(axes_of: FloatArray, panels: Sequence[RankPanel]) -> list[tuple[Axes, RankPanel]]:
    """Axes and panels in pairs, titled; axes left over are removed."""
    for axes in axes_of[len(panels) :]:
        axes.set_axis_off()
    pairs = list(zip(axes_of, panels, strict=False))
    for axes, panel in pairs:
        axes.set_title(wrapped(drawable(panel.label), TITLE_LENGTH), weight="normal", size=8)
    return pairs


def _colour(outside: bool) -> str:
    return VERMILLION if outside else POSTERIOR


def _legend(canvas: Canvas, curve: str, nominal: str, probability: float) -> None:
    canvas.legend(
        handles=[
            Line2D([], [], color=POSTERIOR, label=curve),
            Line2D([], [], color=NOMINAL, linewidth=0.7, label=nominal),
            Patch(color=BAND_NOISE, label=f"simultaneous {format_percent(probability)} band"),
        ],
        loc="outside upper right",
        ncols=3,
    )


def _outside(labels: Sequence[str]) -> str:
    return f"Outside here: {', '.join(labels)}." if labels else "None leaves its band here."
