"""Figures of predicted records and of how well their bands hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from bayes_hw.arrays import FloatArray
from bayes_hw.record import Record, Units
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    envelope,
    finished,
    new_canvas,
    outline,
    with_unit,
)
from bayes_hw.report.page.palette import (
    BAND_NOISE,
    BAND_PARAMETERS,
    DATA,
    INK,
    MODEL,
    NOMINAL,
    RESIDUAL,
)
from bayes_hw.report.page.rounding import format_percent

BAND_REACH = 2.0
"""How far beyond the lines a panel follows its bands, in ranges of the lines."""


@dataclass(frozen=True, eq=False)
class PredictedRecord:
    """A record, its posterior predictive mean and two bands, all (samples,) in `units`.

    `parameters_*` bound the noise-free output (parameter uncertainty alone), `noise_*` the measured output.
    """

    name: str
    t: FloatArray
    y: FloatArray
    mean: FloatArray
    parameters_lower: FloatArray
    parameters_upper: FloatArray
    noise_lower: FloatArray
    noise_upper: FloatArray
    units: Units
    probability: float = 0.94

    def within(self, start: float, end: float) -> PredictedRecord:
        """The stretch with start <= t <= end."""
        kept = (self.t >= start) & (self.t <= end)
        series = {
            name: getattr(self, name)[kept]
            for name in (
                "t",
                "y",
                "mean",
                "parameters_lower",
                "parameters_upper",
                "noise_lower",
                "noise_upper",
            )
        }
        return replace(self, **series)


def predicted_overview(record: PredictedRecord, what: str = "held-out record") -> Figure:
    """The whole record and its residual."""
    level = format_percent(record.probability)
    with drawing_settings():
        return finished(
            overview_canvas(record),
            f"Prediction of the {what} “{record.name}”: posterior mean and {level} bands, of the parameters "
            "alone and, wider, with measurement noise; below, record minus mean.",
            "Measured and predicted output over time with bands, and the residual.",
        )


def overview_canvas(record: PredictedRecord) -> Canvas:
    """The drawing of `predicted_overview`."""
    with drawing_settings():
        canvas = new_canvas(2.9)
        whole, residual = canvas.subplots(2, 1, height_ratios=(3, 1.6), sharex=True)
        _draw_prediction(whole, record)
        _draw_residual(residual, record)
        residual.set_xlim(record.t[0], record.t[-1])
        residual.set_xlabel(with_unit("time from first sample", record.units.time))
        canvas.align_ylabels()
        canvas.legend(*whole.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return canvas


def predicted_record(
    record: PredictedRecord, zoom: tuple[float, float], what: str = "held-out record"
) -> Figure:
    """The whole record, its residual, and the stretch `zoom` = (start, end) in s enlarged."""
    level = format_percent(record.probability)
    with drawing_settings():
        canvas = new_canvas(5.6)
        whole, residual, close, close_residual = canvas.subplots(4, 1, height_ratios=(3, 1.5, 3, 1.5))
        part = record.within(*zoom)
        _draw_prediction(whole, record)
        _draw_residual(residual, record)
        _draw_prediction(close, part)
        _draw_residual(close_residual, part)
        for axes in (whole, residual):
            axes.axvspan(*zoom, color=NOMINAL, alpha=0.18, linewidth=0)
        for upper, lower, shown in ((whole, residual, record), (close, close_residual, part)):
            upper.sharex(lower)
            upper.tick_params(labelbottom=False)
            lower.set_xlim(shown.t[0], shown.t[-1])
            lower.set_xlabel(with_unit("time from first sample", record.units.time))
        whole.set_title("whole record")
        close.set_title(f"{zoom[0]:.4g} to {zoom[1]:.4g} {drawable(record.units.time)}, shaded above")
        canvas.align_ylabels()
        handles, labels = whole.get_legend_handles_labels()
        canvas.legend(handles, labels, loc="outside upper center", ncols=4)
        return finished(
            canvas,
            f"Prediction of the {what} “{record.name}”: posterior mean and {level} bands, of the parameters "
            "alone and, wider, with measurement noise, with the residual (record minus "
            "mean) below. "
            f"The lower pair enlarges {zoom[0]:.4g} to {zoom[1]:.4g} {record.units.time}.",
            "Measured and predicted output over time with bands and residuals.",
            rows_together=2,
        )


def _draw_prediction(axes: Axes, record: PredictedRecord) -> None:
    level = format_percent(record.probability)
    axes.fill_between(
        *envelope(record.t, record.noise_lower, record.noise_upper),
        color=BAND_NOISE,
        linewidth=0,
        label=f"{level} with noise",
    )
    axes.fill_between(
        *envelope(record.t, record.parameters_lower, record.parameters_upper),
        color=BAND_PARAMETERS,
        linewidth=0,
        label=f"{level} parameters alone",
    )
    axes.plot(*outline(record.t, record.y), color=DATA, linewidth=0.8, label="record")
    axes.plot(*outline(record.t, record.mean), color=MODEL, linewidth=1.0, label="prediction")
    axes.set_ylabel(with_unit("output", record.units.output))
    _bound_view(axes, record.y, record.mean)


def _draw_residual(axes: Axes, record: PredictedRecord) -> None:
    for lower, upper, colour in (
        (record.noise_lower, record.noise_upper, BAND_NOISE),
        (record.parameters_lower, record.parameters_upper, BAND_PARAMETERS),
    ):
        axes.fill_between(
            *envelope(record.t, lower - record.mean, upper - record.mean), color=colour, linewidth=0
        )
    axes.plot(*outline(record.t, record.y - record.mean), color=RESIDUAL, linewidth=0.6)
    axes.axhline(0, color=INK, linewidth=0.6)
    axes.set_ylabel(with_unit("residual", record.units.output))
    _bound_view(axes, record.y - record.mean)


def _bound_view(axes: Axes, *lines: FloatArray) -> None:
    """Cut off bands that reach so far beyond `lines` that these would look flat."""
    least, most = min(float(v.min()) for v in lines), max(float(v.max()) for v in lines)
    reach = BAND_REACH * (most - least)
    low, high = axes.get_ylim()
    bottom, top = max(low, least - reach), min(high, most + reach)
    if bottom < top:
        axes.set_ylim(bottom, top)


@dataclass(frozen=True)
class Coverage:
    """How often something lay inside a band of probability `nominal`, with its binomial interval."""

    label: str
    nominal: float
    achieved: float
    lower: float
    upper: float


def coverage(rows: Sequence[Coverage], interval: str = "95 % binomial interval") -> Figure:
    """Achieved against nominal coverage, one row each; `interval` names the kind of the error bars."""
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.3 * len(rows))
        axes = canvas.subplots()
        at = np.arange(len(rows))
        achieved = np.array([100 * row.achieved for row in rows])
        lower = np.array([100 * row.lower for row in rows])
        upper = np.array([100 * row.upper for row in rows])
        axes.hlines(at, lower, upper, color=MODEL, linewidth=2, label=drawable(interval))
        axes.plot(achieved, at, "o", color=MODEL, markersize=5, label="achieved")
        axes.vlines(
            [100 * row.nominal for row in rows],
            at - 0.38,
            at + 0.38,
            color=INK,
            linewidth=1.6,
            label="nominal",
        )
        axes.set_yticks(at, [drawable(row.label) for row in rows])
        axes.set(xlabel="coverage (%)", xlim=(max(0.0, 10 * np.floor(lower.min() / 10 - 1)), 100.5))
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        canvas.legend(loc="outside upper right", ncols=3)
        return finished(
            canvas,
            f"Achieved coverage of the bands, with its {interval}, against the nominal probability "
            "(upright tick). An interval that lies wholly left of its tick means bands too narrow.",
            f"Achieved coverage for {len(rows)} cases with ticks at the nominal coverage.",
        )


def fit_canvas(record: Record, simulated: FloatArray) -> Canvas:
    """Measured and simulated output (samples,), output units, over time; below, their difference."""
    t, y = record.t - record.t[0], np.where(record.measured_samples, record.y, simulated)
    with drawing_settings():
        canvas = new_canvas(2.9)
        whole, residual = canvas.subplots(2, 1, height_ratios=(3, 1.6), sharex=True)
        whole.plot(*outline(t, y), color=DATA, linewidth=1.4, label="record")
        whole.plot(*outline(t, simulated), color=MODEL, linewidth=0.9, label="model")
        whole.set_ylabel(with_unit("output", record.units.output))
        residual.plot(*outline(t, y - simulated), color=RESIDUAL, linewidth=0.6)
        residual.axhline(0, color=INK, linewidth=0.6)
        residual.set_ylabel(with_unit("residual", record.units.output))
        residual.set_xlim(t[0], t[-1])
        residual.set_xlabel(with_unit("time from first sample", record.units.time))
        canvas.align_ylabels()
        canvas.legend(*whole.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return canvas
