"""Figures of the loops: margins, Nyquist curves, sensitivities, limit cycles, tuned settings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayes_hw.arrays import FloatArray
from bayes_hw.control.design import LoopReport
from bayes_hw.control.limit_cycles import Matched
from bayes_hw.control.margins import Requirements
from bayes_hw.control.tuning import Tuning
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    finished,
    new_canvas,
    plain_log_ticks,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.palette import (
    BLUE,
    INK,
    POINT_ESTIMATE,
    POSTERIOR,
    PURPLE,
    VERMILLION,
)
from bayes_hw.report.page.rounding import format_percent

NAME_LENGTH = 28
SCATTER_DRAWS = 600
NYQUIST_REACH = 2.2
NYQUIST_CUT = 3.0


def margin_distributions(loops: Sequence[LoopReport], requirements: Requirements) -> Figure:
    """One row a controller, one panel a margin: where the draws lie, and what was asked for."""
    panels = (
        ("gain margin (dB)", "gain_margin_db", requirements.gain_margin_db),
        ("phase margin (deg)", "phase_margin_deg", requirements.phase_margin_deg),
        ("delay margin (s)", "delay_margin_s", requirements.delay_margin_s),
        ("bandwidth (Hz)", "bandwidth_hz", None),
    )
    rows = np.arange(len(loops))
    with drawing_settings():
        canvas = new_canvas(1.15 + 0.4 * len(loops))
        for axes, (label, name, asked) in zip(
            canvas.subplots(1, len(panels), sharey=True), panels, strict=True
        ):
            for row, loop in enumerate(loops):
                _interval(axes, row, getattr(loop.margins, name), getattr(loop.nominal_margins, name)[0])
            if asked:
                axes.axvline(asked, color=INK, linestyle="--", linewidth=0.9)
            axes.set_xlabel(label)
            axes.set_xlim(0, 1.08 * axes.get_xlim()[1])
            axes.grid(False, axis="y")
            axes.locator_params(axis="x", nbins=4)
        first = canvas.axes[0]
        first.set_yticks(
            rows,
            [
                wrapped(f"{drawable(loop.controller.name)}: {_kept(loop, requirements)}", NAME_LENGTH)
                for loop in loops
            ],
        )
        first.set_ylim(len(loops) - 0.5, -0.5)
        canvas.legend(
            handles=[
                Line2D([], [], color=POSTERIOR, linewidth=1.4, label="94 % of the stable draws"),
                Line2D([], [], color=POSTERIOR, linewidth=5, label="50 %"),
                Line2D(
                    [],
                    [],
                    color=POINT_ESTIMATE,
                    marker="v",
                    markersize=4,
                    linestyle="",
                    label="point estimate",
                ),
                Line2D([], [], color=INK, linestyle="--", linewidth=0.9, label="asked for"),
            ],
            loc="outside upper right",
            ncols=4,
        )
        return finished(
            canvas,
            "Margins and bandwidth of every controller over the posterior: central 94 % and 50 % of the "
            "stable draws, and the point estimate. Dashed: the margins asked for; percentages beside the "
            "names: draws that are stable and keep them all.",
            f"Intervals of four margins for {len(loops)} controllers.",
        )


def _kept(loop: LoopReport, requirements: Requirements) -> str:
    return format_percent(loop.met(requirements), 1)


def _interval(axes: Axes, row: int, draws: FloatArray, nominal: float) -> None:
    finite = draws[np.isfinite(draws)]
    if len(finite):
        q = np.quantile(finite, [0.03, 0.25, 0.75, 0.97])
        axes.plot([q[0], q[3]], [row, row], color=POSTERIOR, linewidth=1.4, solid_capstyle="butt")
        axes.plot([q[1], q[2]], [row, row], color=POSTERIOR, linewidth=5, solid_capstyle="butt")
    else:
        axes.text(0.05, row, "none", transform=axes.get_yaxis_transform(), va="center", size=8)
    if np.isfinite(nominal):
        axes.plot(nominal, row - 0.24, "v", color=POINT_ESTIMATE, markersize=4, markeredgewidth=0)


def nyquist_and_sensitivities(loops: Sequence[LoopReport]) -> Figure:
    """One row a controller: L near the critical point on the left, |S| and |T| on the right."""
    with drawing_settings():
        canvas = new_canvas(0.5 + 2.1 * len(loops))
        grid = canvas.subplots(len(loops), 2, squeeze=False, width_ratios=(1, 1.75))
        for (left, right), loop in zip(grid, loops, strict=True):
            bands = loop.bands
            shown = np.where(np.abs(bands.curves) < NYQUIST_CUT, bands.curves, np.nan).T
            left.plot(shown.real, shown.imag, color=POSTERIOR, linewidth=0.4, alpha=0.25)
            left.plot(bands.nominal_curve.real, bands.nominal_curve.imag, color=POINT_ESTIMATE, linewidth=1)
            left.plot(-1, 0, "+", color=INK, markersize=8, markeredgewidth=1.4)
            left.set(xlim=(-NYQUIST_REACH, 0.8), ylim=(-1.6, 1.2), ylabel="imaginary part of L")
            left.set_aspect("equal")
            frequency = bands.frequency_hz
            for band, nominal, colour in (
                (bands.sensitivity_db, bands.nominal_sensitivity_db, PURPLE),
                (bands.complementary_db, bands.nominal_complementary_db, BLUE),
            ):
                right.fill_between(frequency, band[0], band[1], color=colour, alpha=0.35, linewidth=0)
                right.plot(frequency, nominal, color=colour, linewidth=1)
            right.axhline(0, color=INK, linewidth=0.6)
            right.set_xscale("log")
            right.set(xlim=(frequency[-1] / 300, frequency[-1]), ylim=(-35, 20), ylabel="magnitude (dB)")
            plain_log_ticks(right, "x")
            right.set_title(drawable(loop.controller.name))
        grid[-1, 0].set_xlabel("real part of L")
        grid[-1, 1].set_xlabel("frequency (Hz)")
        canvas.legend(
            handles=[
                Line2D([], [], color=POSTERIOR, linewidth=0.8, label="L of single draws"),
                Line2D([], [], color=POINT_ESTIMATE, label="L of the point estimate"),
                Patch(color=PURPLE, alpha=0.35, label="|S|"),
                Patch(color=BLUE, alpha=0.35, label="|T|"),
            ],
            loc="outside upper right",
            ncols=4,
        )
        return finished(
            canvas,
            "The loops over frequency. Left: L near the critical point −1 (cross), single draws. Right: "
            "sensitivity S = 1/(1 + L), from output disturbance to error, and complementary sensitivity T = "
            "L/(1 + L), from reference to output: pointwise central 94 % of the draws, lines for the point "
            "estimate.",
            f"Nyquist curves and sensitivities of {len(loops)} controllers.",
            rows_together=1,
        )


def limit_cycle_check(loops: Sequence[LoopReport], unit: str) -> Figure:
    """Predicted against simulated amplitude and frequency of every draw that has both, away from zero."""
    with drawing_settings():
        canvas = new_canvas(2.9)
        left, right = canvas.subplots(1, 2)
        panels: tuple[tuple[Axes, Matched, str], ...] = (
            (left, "position_amplitude", with_unit("amplitude of w", unit)),
            (right, "frequency_hz", "frequency (Hz)"),
        )
        for axes, name, label in panels:
            reach: list[float] = []
            for i, loop in enumerate(loops):
                for check in loop.cycles:
                    predicted, simulated = check.matched(name)
                    marker = "o" if check.place == "away from zero" else "x"
                    axes.plot(
                        predicted,
                        simulated,
                        marker,
                        color=(BLUE, VERMILLION, PURPLE)[i % 3],
                        markersize=3,
                        alpha=0.6,
                    )
                    reach += [*predicted, *simulated]
            low, high = min(reach), max(reach)
            gap = 0.08 * max(high - low, 0.02 * high)
            axes.plot(
                [low - gap, high + gap], [low - gap, high + gap], color=INK, linestyle="--", linewidth=0.8
            )
            axes.set(xlabel=f"predicted {label}", ylabel=f"simulated {label}")
            axes.locator_params(nbins=4)
        handles = [
            Line2D(
                [],
                [],
                color=(BLUE, VERMILLION, PURPLE)[i % 3],
                marker="o",
                linestyle="",
                label=drawable(name),
            )
            for i, name in enumerate(loop.controller.name for loop in loops)
        ]
        canvas.legend(handles=handles, loc="outside upper right", ncols=2)
        return finished(
            canvas,
            "Limit cycles: amplitude of the position and frequency, as describing functions predict them "
            "and as the simulated nonlinear loop shows them, one mark a draw that has both (dots: away from "
            "zero, crosses: around zero). Dashed: equal.",
            "Two scatter plots of predicted against simulated limit cycles.",
        )


def tuned_margins(tuning: Tuning) -> Figure:
    """Gain and phase margin of the draws under both settings, with the region that was asked for."""
    asked = tuning.requirements
    with drawing_settings():
        canvas = new_canvas(2.9)
        left, right = canvas.subplots(1, 2, sharex=True, sharey=True)
        for axes, tuned, colour, title in (
            (left, tuning.point, VERMILLION, "on the point estimate"),
            (right, tuning.robust, BLUE, "over the posterior"),
        ):
            margins = tuned.margins
            axes.plot(
                margins.gain_margin_db[:SCATTER_DRAWS],
                margins.phase_margin_deg[:SCATTER_DRAWS],
                ".",
                color=colour,
                markersize=3,
                alpha=0.5,
                rasterized=True,
            )
            axes.axvline(asked.gain_margin_db, color=INK, linestyle="--", linewidth=0.9)
            axes.axhline(asked.phase_margin_deg, color=INK, linestyle="--", linewidth=0.9)
            axes.set_title(f"{title}: {format_percent(tuned.broken, 1)} break")
            axes.set_xlabel("gain margin (dB)")
        left.set_ylabel("phase margin (deg)")
        return finished(
            canvas,
            f"{tuning.structure} settings: gain and phase margin of fresh draws. Inside the dashed lines, "
            "above and to the right, is what was asked for. Settings tuned on the point estimate alone "
            "stand on the edge of that region; those tuned over the posterior keep "
            f"{format_percent(tuning.share)} of the draws inside.",
            "Two scatter plots of gain margin and phase margin.",
        )
