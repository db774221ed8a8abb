"""A record beside what a model simulates of it."""

from __future__ import annotations

from matplotlib.figure import Figure as Canvas

from bayes_hw.arrays import FloatArray
from bayes_hw.record import Record
from bayes_hw.report.page.drawing import drawing_settings, new_canvas, outline, with_unit
from bayes_hw.report.page.palette import DATA, INK, MODEL, RESIDUAL


def fit_canvas(record: Record, simulated: FloatArray) -> Canvas:
    """Measured and simulated output (samples,), output units, over time; below, their difference."""
    t = record.t - record.t[0]
    with drawing_settings():
        canvas = new_canvas(2.9)
        whole, residual = canvas.subplots(2, 1, height_ratios=(3, 1.6), sharex=True)
        whole.plot(*outline(t, record.y), color=DATA, linewidth=1.4, label="record")
        whole.plot(*outline(t, simulated), color=MODEL, linewidth=0.9, label="model")
        whole.set_ylabel(with_unit("output", record.units.output))
        residual.plot(*outline(t, record.y - simulated), color=RESIDUAL, linewidth=0.6)
        residual.axhline(0, color=INK, linewidth=0.6)
        residual.set_ylabel(with_unit("residual", record.units.output))
        residual.set_xlim(t[0], t[-1])
        residual.set_xlabel(with_unit("time from first sample", record.units.time))
        canvas.align_ylabels()
        canvas.legend(*whole.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return canvas
