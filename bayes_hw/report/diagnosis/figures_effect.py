"""The figure that convinces, whatever the effect: a quantity over another, and the answer's law."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.joint.answer.free_function import EffectView
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, plain_log_ticks, with_unit
from bayes_hw.report.page.palette import DATA, INK, MODEL


def effect_figure(view: EffectView) -> Figure:
    """Points with 94 % intervals, found without the law, and the law as a line."""
    with drawing_settings():
        canvas = new_canvas(3.0)
        axes = canvas.subplots()
        axes.axhline(0, color=INK, linewidth=0.6)
        axes.plot(view.line_x, view.line_y, color=MODEL, linewidth=1.8, label="the answer's law")
        size = 4 if len(view.x) < 40 else 2.5
        axes.errorbar(
            view.x, view.y, yerr=view.half if view.half.any() else None, fmt="o", color=DATA, markersize=size,
            elinewidth=1.0, capsize=0, label="found without the law",
        )  # fmt: skip
        if view.logarithmic:
            axes.set(xscale="log", yscale="log")
            plain_log_ticks(axes, "x")
            plain_log_ticks(axes, "y")
        else:
            axes.set_ylim(*_room(view))
        axes.set_xlabel(with_unit(view.over, view.over_unit))
        axes.set_ylabel(with_unit(view.quantity, view.quantity_unit))
        canvas.legend(loc="outside upper right", ncols=2)
        return finished(
            canvas, view.reading, f"{view.quantity} over {view.over}: points with intervals and a line."
        )


def _room(view: EffectView) -> tuple[float, float]:
    """Ends of the upright axis: all of the law and of the points, intervals as far as they fit."""
    middle = np.concatenate([view.y, view.line_y, [0.0]])
    low, high = float(middle.min()), float(middle.max())
    reach = 0.35 * (high - low) or 1.0
    bottom = max(low - reach, float(np.min(view.y - view.half, initial=low)))
    top = min(high + reach, float(np.max(view.y + view.half, initial=high)))
    edge = 0.06 * (top - bottom)
    return bottom - edge, top + edge
