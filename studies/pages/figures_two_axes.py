"""The figure of the report on two axes: deviations from the truth with their intervals."""

from __future__ import annotations

from collections.abc import Mapping

from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawable, drawing_settings, finished, new_canvas, wrapped
from bayes_hw.report.page.palette import BLUE, TRUTH, VERMILLION


def intervals_of_axes(axes: Mapping[str, Mapping[str, tuple[float, float, float]]]) -> Figure:
    """One panel an axis: mean and interval of every parameter as deviations from the truth, in percent."""
    with drawing_settings():
        canvas = new_canvas(3.0)
        panels = canvas.subplots(1, len(axes), sharey=True, squeeze=False)[0]
        for panel, (name, parameters) in zip(panels, axes.items(), strict=True):
            for row, (mean, low, high) in enumerate(parameters.values()):
                colour = BLUE if low <= 0 <= high else VERMILLION
                marker = "o" if low <= 0 <= high else "X"
                panel.plot([100 * low, 100 * high], [row, row], color=colour, linewidth=2)
                panel.plot(100 * mean, row, marker, color=colour, markersize=5)
            panel.axvline(0.0, color=TRUTH, linestyle="--")
            panel.set_yticks(range(len(parameters)), list(parameters))
            panel.set_title(wrapped(drawable(name), 26))
            panel.set(xlabel="deviation (%)", ylim=(len(parameters) - 0.5, -0.5))
        return finished(
            canvas,
            "Posterior mean and 94 % interval of every parameter, as a deviation from the truth (dashed);"
            " crosses in orange where the interval does not hold it. Scales differ from panel to panel.",
            f"Intervals of {len(axes)} models against the truth.",
        )
