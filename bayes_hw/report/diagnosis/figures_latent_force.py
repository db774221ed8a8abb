"""The figure of the force that is missing: over time, by speed, by position."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.latent_force import LatentForce
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, with_unit
from bayes_hw.report.page.palette import BAND_NOISE, INK, MODEL, MUTED

SPEED_BINS, PLACE_BINS = 18, 60
FEWEST = 10
"""Samples that a bin must hold to be drawn."""


def latent_force_figure(found: LatentForce, record_name: str, units: tuple[str, str]) -> Figure:
    """Mean and 94 % band over time, and the mean by speed and by position; `units` (output, time)."""
    output, time = units
    with drawing_settings():
        canvas = new_canvas(4.0)
        grid = canvas.add_gridspec(2, 2)
        whole = canvas.add_subplot(grid[0, :])
        whole.fill_between(found.time, *found.band, color=BAND_NOISE, linewidth=0)
        whole.plot(found.time, found.mean, color=MODEL)
        whole.axhline(0, color=MUTED, linewidth=0.6)
        whole.set_xlabel(with_unit("time", time))
        whole.set_ylabel(with_unit("missing force", found.unit))
        by_speed, by_place = canvas.add_subplot(grid[1, 0]), canvas.add_subplot(grid[1, 1])
        _binned(by_speed, found.speed, found.mean, SPEED_BINS)
        by_speed.set_xlabel(with_unit("speed", f"{output}/{time}"))
        by_speed.set_ylabel(with_unit("missing force", found.unit))
        _binned(by_place, found.position, found.mean, PLACE_BINS)
        by_place.set_xlabel(with_unit("position", output))
        return finished(
            canvas,
            f"The free residual of “{record_name}” as a force at the drive: the torque over time that "
            "would explain the error of the re-estimated model (mean and 94 % band), and its mean and "
            "quartiles by speed and by position. A step at zero speed is friction's, waves over position are "
            "a ripple's; a curve that follows neither is of the surroundings or of another block.",
            "Estimated missing force over time, by speed and by position.",
        )


def _binned(axes: Axes, x: FloatArray, force: FloatArray, bins: int) -> None:
    low, high = np.quantile(x, [0.01, 0.99])
    edges = np.linspace(float(low), float(high), bins + 1)
    index = np.digitize(x, edges) - 1
    rows = [(i, force[index == i]) for i in range(bins) if np.sum(index == i) >= FEWEST]
    middle = np.array([0.5 * (edges[i] + edges[i + 1]) for i, _ in rows])
    lower, upper = (np.array([np.quantile(f, q) for _, f in rows]) for q in (0.25, 0.75))
    axes.fill_between(middle, lower, upper, color=BAND_NOISE, linewidth=0)
    axes.plot(middle, [float(np.mean(f)) for _, f in rows], "o-", color=INK, markersize=3)
    axes.axhline(0, color=MUTED, linewidth=0.6)
