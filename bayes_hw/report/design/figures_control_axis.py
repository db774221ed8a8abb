"""Figures of the axis as a controller designer sees it: its response, and the crossover it allows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayes_hw.control.allowance import CrossoverCurve, NotchRange
from bayes_hw.control.plant_summary import PlantSummary
from bayes_hw.record import Units
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    finished,
    new_canvas,
    plain_log_ticks,
    wrapped,
)
from bayes_hw.report.page.palette import (
    BAND_PARAMETERS,
    GREEN,
    INK,
    ORANGE,
    POINT_ESTIMATE,
    ensemble_colour,
)
from bayes_hw.report.page.rounding import format_interval, format_number, format_percent


def axis_response(plant: PlantSummary, notches: Sequence[NotchRange], units: Units) -> Figure:
    """Magnitude and phase of G with their bands, resonances and antiresonances."""
    frequency = plant.frequency_hz
    with drawing_settings():
        canvas = new_canvas(4.2)
        magnitude, phase = canvas.subplots(2, 1, sharex=True)
        for axes, band, nominal in (
            (magnitude, plant.magnitude_db, plant.nominal_response),
            (phase, plant.phase_deg, plant.nominal_phase_deg),
        ):
            for notch in notches:
                axes.axvspan(notch.lower_hz, notch.upper_hz, color=ORANGE, alpha=0.55, linewidth=0)
            for pair in plant.antiresonances:
                low, high = np.quantile(pair.frequency_hz, [0.03, 0.97])
                axes.axvspan(low, high, color=GREEN, alpha=0.3, linewidth=0.5)
            axes.fill_between(frequency, band[0], band[1], color=BAND_PARAMETERS, alpha=0.8, linewidth=0)
            axes.plot(frequency, nominal, color=POINT_ESTIMATE, linewidth=0.9)
        magnitude.set_xscale("log")
        magnitude.set_xlim(frequency[0], frequency[-1])
        plain_log_ticks(phase, "x")
        unit = f"{units.output}/({units.input})"
        magnitude.set_ylabel(wrapped(f"magnitude (dB, re 1 {drawable(unit)})", 24))
        phase.set(ylabel="phase (deg)", xlabel="frequency (Hz)")
        handles = [
            Line2D([], [], color=POINT_ESTIMATE, label="point estimate"),
            Patch(color=BAND_PARAMETERS, label="94 % of the draws"),
        ]
        if notches:
            handles.append(Patch(color=ORANGE, alpha=0.55, label="resonances"))
        if plant.antiresonances:
            handles.append(Patch(color=GREEN, alpha=0.3, label="antiresonances"))
        canvas.legend(handles=handles, loc="outside upper right", ncols=4)
        listed = [f"resonance {n.mode}: {format_interval(n.lower_hz, n.upper_hz, 'Hz')}" for n in notches]
        return finished(
            canvas,
            "Frequency response of G, from the limited command v to the position w, up to half the sample "
            "rate. Shaded: the pointwise central 94 % of the posterior draws. Vertical bands: where the "
            f"draws have their resonances{' (' + '; '.join(listed) + ')' if listed else ''} and "
            "antiresonances.",
            "Bode plot of G: magnitude above, phase below, with posterior bands.",
        )


def crossover_allowance(curves: Sequence[CrossoverCurve], share: float, requirements: str) -> Figure:
    """Share of the draws that keep the margins against the crossover of a proportional loop."""
    with drawing_settings():
        canvas = new_canvas(2.9)
        axes = canvas.subplots()
        for i, curve in enumerate(curves):
            colour = ensemble_colour(i)
            axes.plot(curve.crossover_hz, 100 * curve.share, "-", color=colour, marker=".", markersize=3)
            if np.isfinite(curve.allowed_hz):
                axes.plot(curve.allowed_hz, 100 * share, "o", color=colour, markersize=6)
        axes.axhline(100 * share, color=INK, linestyle="--", linewidth=0.9)
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set(xlabel="median crossover frequency (Hz)", ylabel="draws that keep the margins (%)")
        axes.set_ylim(-3, 103)
        handles = [
            Line2D(
                [],
                [],
                color=ensemble_colour(i),
                label=f"{curve.filters}: {_allowed(curve)}",
            )
            for i, curve in enumerate(curves)
        ]
        canvas.legend(handles=handles, loc="outside upper right", ncols=2)
        return finished(
            canvas,
            f"How high a crossover the posterior allows: share of the draws that keep a {requirements} under "
            f"proportional control, against the crossover frequency. Dashed: {format_percent(share)}; dots: "
            "the highest crossover at which so many draws keep the margins.",
            f"{len(curves)} falling curves of the share of draws over crossover frequency.",
        )


def _allowed(curve: CrossoverCurve) -> str:
    return "none" if np.isnan(curve.allowed_hz) else f"up to {format_number(curve.allowed_hz, 3, 'Hz')}"
