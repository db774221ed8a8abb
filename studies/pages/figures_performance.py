"""Figures of the benchmark: rates of samplers, cost of a call, scaling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, plain_log_ticks
from bayes_hw.report.page.palette import BLUE, INK, MUTED, VERMILLION
from bayes_hw.report.page.rounding import format_number


@dataclass(frozen=True)
class Scaling:
    """Effective samples per CPU second of one posterior."""

    parameters: int
    samples: int
    rate: float
    converged: bool


def rates_of_samplers(rates: Sequence[tuple[str, Sequence[float]]]) -> Figure:
    """Effective samples a second of every sampler, one dot a round, the first in another colour."""
    with drawing_settings():
        canvas = new_canvas(0.8 + 0.42 * len(rates))
        axes = canvas.subplots()
        for row, (_, values) in enumerate(rates):
            colour = BLUE if row == 0 else MUTED
            median = float(np.median(values))
            axes.plot([min(values), max(values)], [row, row], color=colour, linewidth=1)
            axes.plot(values, np.full(len(values), row), "o", color=colour, markersize=3)
            axes.plot(median, row, "|", color=colour, markersize=14, markeredgewidth=2)
            axes.annotate(
                format_number(median, 3),
                (median, row),
                xytext=(0, 8),
                textcoords="offset points",
                ha="center",
                color=INK,
                fontsize=8,
            )
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set_yticks(range(len(rates)), [name for name, _ in rates])
        axes.set(ylim=(len(rates) - 0.5, -0.7), xlabel="effective samples per CPU second (logarithmic)")
        return finished(
            canvas,
            "Effective samples a second on the twin's posterior, warm-up included: one dot a round, the bar"
            " at the median.",
            f"{len(rates)} samplers on a logarithmic axis; {rates[0][0]} is the fastest at"
            f" {format_number(float(np.median(rates[0][1])), 2)} a second."
            if rates[0][1] and max(rates, key=lambda rate: float(np.median(rate[1])))[0] == rates[0][0]
            else f"{len(rates)} samplers on a logarithmic axis.",
        )


def cost_growth(samples_ns: dict[int, float], walkers_ns: dict[int, float]) -> Figure:
    """Time a walker and sample against samples and against walkers: flat where the cost is linear."""
    with drawing_settings():
        canvas = new_canvas(2.4)
        panels = canvas.subplots(1, 2, sharey=True)
        for axes, values, label in zip(
            panels, (samples_ns, walkers_ns), ("samples of the record", "walkers of a call"), strict=True
        ):
            axes.plot(list(values), list(values.values()), "o-", color=BLUE, markersize=4)
            axes.set_xscale("log")
            plain_log_ticks(axes, "x")
            axes.set(xlabel=label, ylim=(0, 1.15 * max(*samples_ns.values(), *walkers_ns.values())))
        panels[0].set_ylabel("ns a walker and sample")
        return finished(
            canvas,
            "Cost of a log-probability a walker and sample: flat where it grows in proportion. Few walkers"
            " pay the fixed cost of a call.",
            "Two curves that are flat from a thousand samples and some hundred walkers on.",
        )


def scaling_figure(by_parameters: Sequence[Scaling], by_samples: Sequence[Scaling]) -> Figure:
    """Effective samples a second against parameters and against samples."""
    with drawing_settings():
        canvas = new_canvas(2.6)
        panels = canvas.subplots(1, 2, sharey=True)
        for axes, points, what in zip(
            panels, (by_parameters, by_samples), ("parameters", "samples"), strict=True
        ):
            x, y = [getattr(p, what) for p in points], [p.rate for p in points]
            axes.plot(x, y, "-", color=BLUE)
            for point, at, rate in zip(points, x, y, strict=True):
                colour = BLUE if point.converged else VERMILLION
                axes.plot(at, rate, "o" if point.converged else "x", color=colour, markersize=5)
            axes.set_yscale("log")
            axes.set_xlabel(what)
            plain_log_ticks(axes, "y")
        panels[0].set_xticks([p.parameters for p in by_parameters])
        panels[1].set_xscale("log")
        plain_log_ticks(panels[1], "x")
        panels[0].set_ylabel("effective samples a second")
        bad = sum(not p.converged for p in (*by_parameters, *by_samples))
        return finished(
            canvas,
            f"Effective samples per CPU second, default settings: left against the number of parameters"
            f" ({by_parameters[0].samples:,} samples), right against samples ({by_samples[0].parameters}"
            f" parameters). Crosses have not converged ({bad}).",
            f"Rate against parameters, from {format_number(by_parameters[0].rate, 2)} to"
            f" {format_number(by_parameters[-1].rate, 2)} a second, and against samples, from"
            f" {format_number(by_samples[0].rate, 2)} to {format_number(by_samples[-1].rate, 2)}.",
        )
