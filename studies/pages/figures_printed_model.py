"""Figures of what a transfer function printed with few digits still says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, plain_log_ticks, with_unit
from bayes_hw.report.page.palette import (
    BAND_NOISE,
    BAND_PARAMETERS,
    INK,
    LINEAR_BASELINE,
    MODEL,
    MUTED,
    NOMINAL,
)
from bayes_hw.report.page.rounding import format_percent

VIEW_MARGIN = 0.3
"""Room around the poles that a close-up shows, as a share of their range."""

SMALLEST_VIEW = 0.01
"""Range that a close-up of a single pole has at least."""


@dataclass(frozen=True, eq=False)
class PoleClouds:
    """Poles in the z-plane.

    `box` (members, n) are those of transfer functions from the whole box, `integrators` (members, n - 1) the
    other poles of stable ones with a pole at z = 1; `printed` (n,) belong to the digits as they stand,
    `representative` (n,) to the model that is kept.
    """

    box: ComplexArray
    integrators: ComplexArray
    printed: ComplexArray
    representative: ComplexArray


def pole_map(poles: PoleClouds) -> Figure:
    """The upper half plane, and close-ups of z = 1 and of the resonances."""
    with drawing_settings():
        canvas = new_canvas(4.6)
        panels = canvas.subplot_mosaic([["whole", "whole"], ["one", "resonances"]], height_ratios=(1.2, 1))
        for axes in panels.values():
            _draw_poles(axes, poles)
            axes.set(xlabel="real part of z", ylabel="imaginary part")
        panels["whole"].set(xlim=(-1.15, 1.15), ylim=(-0.06, 1.08), aspect="equal")
        panels["whole"].set_title("upper half plane")
        kept = poles.representative
        both = np.concatenate([kept, poles.printed])
        _close_up(panels["one"], both[(np.abs(both - 1) < 0.1) & (both.imag >= 0)])
        panels["one"].set_title("near z = 1")
        light = kept[(kept.imag > 0) & (np.abs(kept) > 0.9)]
        _close_up(panels["resonances"], light)
        panels["resonances"].set_title("resonances")
        handles, labels = panels["whole"].get_legend_handles_labels()
        canvas.legend(handles, labels, loc="outside upper center", ncols=3)
        return finished(
            canvas,
            "Poles in the z-plane with the unit circle. Grey: members drawn from the whole rounding box; "
            "blue: stable members with an exact integrator; crosses: the digits as printed, with a pole "
            "outside the circle; diamonds: the representative.",
            "Three panels of poles about the unit circle: the upper half plane, near z = 1, near the "
            "resonances.",
        )


def _draw_poles(axes: Axes, poles: PoleClouds) -> None:
    angle = np.linspace(0, np.pi, 2000)
    axes.plot(np.cos(angle), np.sin(angle), color=INK, linewidth=0.8, label="unit circle")
    for cloud, colour, label in (
        (poles.box, NOMINAL, "whole box"),
        (poles.integrators, MODEL, "stable integrators"),
    ):
        axes.plot(
            *_plane(cloud),
            "o",
            color=colour,
            markersize=2.5,
            markeredgewidth=0,
            alpha=0.5,
            rasterized=True,
            label=label,
        )
    axes.plot(
        *_plane(poles.printed),
        "x",
        color=LINEAR_BASELINE,
        markersize=7,
        markeredgewidth=1.8,
        label="as printed",
    )
    axes.plot(
        *_plane(poles.representative),
        "D",
        color=INK,
        markerfacecolor="none",
        markersize=5.5,
        label="representative",
    )


def _plane(points: ComplexArray) -> tuple[FloatArray, FloatArray]:
    upper = points[points.imag >= 0]
    return upper.real, upper.imag


def _close_up(axes: Axes, points: ComplexArray) -> None:
    widest = max(float(np.ptp(points.real)), float(np.ptp(points.imag)), SMALLEST_VIEW)
    for part, setter in ((points.real, axes.set_xlim), (points.imag, axes.set_ylim)):
        room = VIEW_MARGIN * max(float(np.ptp(part)), 0.3 * widest)
        setter(float(part.min()) - room, float(part.max()) + room)


def velocity_gain_band(
    frequency_hz: FloatArray,
    curves: FloatArray,
    representative: FloatArray,
    unit: str,
    probability: float = 0.94,
) -> Figure:
    """Velocity gain over frequency: `curves` (members, frequencies) and that of the representative.

    The shading holds the central `probability` of the members at every frequency, and all of them.
    """
    tail = (1 - probability) / 2
    low, middle, high = np.quantile(curves, [tail, 0.5, 1 - tail], axis=0)
    with drawing_settings():
        canvas = new_canvas(3.0)
        axes = canvas.subplots()
        axes.fill_between(
            frequency_hz,
            curves.min(axis=0),
            curves.max(axis=0),
            color=BAND_NOISE,
            linewidth=0,
            label="all members",
        )
        axes.fill_between(
            frequency_hz,
            low,
            high,
            color=BAND_PARAMETERS,
            linewidth=0,
            label=f"{format_percent(probability)}",
        )
        axes.plot(frequency_hz, middle, color=MUTED, linestyle="--", label="median")
        axes.plot(frequency_hz, representative, color=MODEL, linewidth=1.6, label="representative")
        axes.set(
            xscale="log", yscale="log", xlim=(frequency_hz[0], frequency_hz[-1]), xlabel="frequency (Hz)"
        )
        plain_log_ticks(axes, "x")
        plain_log_ticks(axes, "y")
        axes.set_ylabel(with_unit("velocity gain", unit))
        canvas.legend(loc="outside upper right", ncols=4)
        return finished(
            canvas,
            "Magnitude of G times 2πf, the velocity gain, over the stable members with an exact "
            "integrator: where the shading is narrow the printed digits determine the model, where it is "
            "wide they do not.",
            "Velocity gain over frequency with a band that widens towards zero frequency.",
        )
