"""Figures of the four-step identification and of what it leaves unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.first_look.frequency_response import FrequencyResponse as MeasuredResponse
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    finished,
    new_canvas,
    outline,
    plain_log_ticks,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.palette import (
    BAND_NOISE,
    BAND_PARAMETERS,
    DATA,
    INK,
    LINEAR_BASELINE,
    MODEL,
    MUTED,
    NOMINAL,
    RESIDUAL,
)
from bayes_hw.report.page.rounding import format_number, format_percent
from bayes_hw.report.page.typography import squared_unit

SCATTER_POINTS = 20_000
"""Most points of a scatter plot; more are thinned evenly."""

SHOWN_COHERENCE = 0.3
"""Above which a measured response is drawn."""

QUANTILE_POINTS = 150
"""Most points of a quantile plot, evenly spread along its axis so that the tails keep theirs."""


def step_results(
    steps: Sequence[str],
    costs: FloatArray,
    fits_percent: FloatArray,
    cost_unit: str,
    baseline_fit_percent: float | None = None,
) -> Figure:
    """Cost and fit after each step, both of shape (steps,); costs positive, in `cost_unit`."""
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.34 * len(steps))
        left, right = canvas.subplots(1, 2, sharey=True)
        rows = np.arange(len(steps))
        left.barh(rows, costs, color=MODEL, height=0.6, log=True)
        left.bar_label(left.containers[0], [f" {format_number(c)}" for c in costs], size=8)
        left.set_xlim(float(np.min(costs)) / 3, float(np.max(costs)) * 8)
        plain_log_ticks(left, "x")
        left.set_yticks(rows, [drawable(step) for step in steps])
        left.set_xlabel(with_unit("rms output error", cost_unit))
        left.invert_yaxis()
        right.barh(rows, fits_percent, color=MODEL, height=0.6)
        right.bar_label(right.containers[0], [f" {fit:.1f}" for fit in fits_percent], size=8)
        floor = min(0.0, float(np.min(fits_percent)))
        right.set(xlabel="fit (%)", xlim=(1.15 * floor, 118))
        right.set_xticks([tick for tick in right.get_xticks() if tick <= 100])
        for axes in (left, right):
            axes.grid(False, axis="y")
        baseline = ""
        if baseline_fit_percent is not None:
            right.axvline(
                baseline_fit_percent,
                color=LINEAR_BASELINE,
                linestyle="--",
                label=f"linear baseline {baseline_fit_percent:.1f} %",
            )
            canvas.legend(loc="outside upper right")
            baseline = " The dashed line is the linear baseline."
        return finished(
            canvas,
            "What each step gains: root mean square output error (left, logarithmic) and fit (right, 100 % "
            f"is a perfect prediction) on the records used for identification.{baseline}",
            f"Bars of cost and fit after each of {len(steps)} steps.",
        )


@dataclass(frozen=True, eq=False)
class StaticBlock:
    """One static block: its rebuilt output against its input, and the function fitted to them.

    `inputs` and `rebuilt` have shape (samples,), `curve_inputs` and `curve_outputs` (points,).
    """

    title: str
    inputs: FloatArray
    rebuilt: FloatArray
    curve_inputs: FloatArray
    curve_outputs: FloatArray
    input_label: str
    output_label: str


def static_blocks(blocks: Sequence[StaticBlock]) -> Figure:
    """One panel a block: rebuilt intermediate variable as points, fitted function as a line."""
    with drawing_settings():
        canvas = new_canvas(3.1)
        for axes, block in zip(canvas.subplots(1, len(blocks), squeeze=False)[0], blocks, strict=True):
            stride = -(-len(block.inputs) // SCATTER_POINTS)
            axes.plot(
                block.inputs[::stride],
                block.rebuilt[::stride],
                ".",
                color=DATA,
                markersize=2,
                alpha=0.35,
                markeredgewidth=0,
                rasterized=True,
            )
            axes.plot(block.curve_inputs, block.curve_outputs, color=MODEL, linewidth=1.8)
            axes.set_title(drawable(block.title))
            axes.set(xlabel=drawable(block.input_label), ylabel=drawable(block.output_label))
        handles = [
            canvas.axes[0].plot([], [], ".", color=DATA, label="rebuilt from the record")[0],
            canvas.axes[0].plot([], [], color=MODEL, linewidth=1.8, label="fitted function")[0],
        ]
        canvas.legend(handles=handles, loc="outside upper right", ncols=2)
        return finished(
            canvas,
            "The static blocks. Points: the intermediate variable rebuilt from the record with the other "
            "blocks held; line: the function fitted to them. Points that follow the line all along its "
            "corners are evidence for the block.",
            f"{len(blocks)} panels, each a scatter of points with a fitted piecewise-linear function.",
        )


@dataclass(frozen=True, eq=False)
class ResponseBand:
    """Pointwise limits (frequencies,) of the response: magnitude in dB, phase in deg."""

    label: str
    magnitude_lower_db: FloatArray
    magnitude_upper_db: FloatArray
    phase_lower_deg: FloatArray
    phase_upper_deg: FloatArray


def frequency_response(
    frequency_hz: FloatArray,
    model: ComplexArray,
    gain_unit: str,
    baseline: ComplexArray | None = None,
    band: ResponseBand | None = None,
    measured: MeasuredResponse | None = None,
    modes_hz: Sequence[float] = (),
) -> Figure:
    """Magnitude and phase of G over `frequency_hz` (frequencies,), in `gain_unit`; with its coherence, the
    response `measured` without any model; frequencies of modes are marked."""
    with drawing_settings():
        canvas = new_canvas(3.9 if measured is None else 4.6)
        rows = 2 if measured is None else 3
        magnitude, phase, *below = canvas.subplots(rows, 1, sharex=True, height_ratios=(2.0, 1.4, 0.9)[:rows])
        if measured is not None:
            seen = measured.coherence > SHOWN_COHERENCE
            with np.errstate(divide="ignore"):
                level = np.where(seen, 20 * np.log10(measured.magnitude), np.nan)
            points = {"color": DATA, "markersize": 3.0, "linestyle": "", "marker": "."}
            magnitude.plot(measured.frequency_hz, level, label="measured", **points)
            phase.plot(measured.frequency_hz, np.where(seen, measured.phase_deg, np.nan), **points)
            below[0].plot(measured.frequency_hz, measured.coherence, color=INK, linewidth=0.9)
            below[0].set(ylabel="coherence", ylim=(0, 1.05))
        for number, mode in enumerate(modes_hz, start=1):
            for axes in (magnitude, phase, *below):
                axes.axvline(mode, color=MUTED, linewidth=0.7, linestyle=":")
            magnitude.annotate(
                f"f{number} {mode:.3g} Hz", (mode, 0.0), xycoords=("data", "axes fraction"), xytext=(3, 3),
                textcoords="offset points", va="bottom", fontsize=8, rotation=90, color=INK,
            )  # fmt: skip
        if band is not None:
            shade = {"color": BAND_PARAMETERS, "alpha": 0.5, "linewidth": 0}
            magnitude.fill_between(
                frequency_hz,
                band.magnitude_lower_db,
                band.magnitude_upper_db,
                label=drawable(band.label),
                **shade,
            )
            phase.fill_between(frequency_hz, band.phase_lower_deg, band.phase_upper_deg, **shade)
        if baseline is not None:
            _draw_response(magnitude, phase, frequency_hz, baseline, LINEAR_BASELINE, "linear baseline")
        _draw_response(magnitude, phase, frequency_hz, model, MODEL, "model")
        magnitude.set_xscale("log")
        magnitude.set_xlim(frequency_hz[0], frequency_hz[-1])
        lowest = below[0] if below else phase
        plain_log_ticks(lowest, "x")
        reference = f", re 1 {gain_unit}" if gain_unit else ""
        magnitude.set_ylabel(wrapped(f"magnitude (dB{drawable(reference)})", 24))
        phase.set_ylabel("phase (deg)")
        lowest.set_xlabel("frequency (Hz)")
        canvas.align_ylabels()
        canvas.legend(loc="outside upper right", ncols=4)
        notes = [
            f" Shaded: {band.label}." if band is not None else "",
            " Points: the response measured between the limits without any model, where its coherence "
            "(below: the share of the motion that the command explains linearly) exceeds 0.3."
            if measured is not None
            else "",
        ]
        return finished(
            canvas,
            "Frequency response of the linear block, from v to w." + "".join(notes),
            "Bode plot: magnitude above, phase below, over logarithmic frequency.",
        )


def _draw_response(
    magnitude: Axes,
    phase: Axes,
    frequency_hz: FloatArray,
    response: ComplexArray,
    colour: str,
    label: str,
) -> None:
    style = "--" if colour == LINEAR_BASELINE else "-"
    magnitude.plot(frequency_hz, 20 * np.log10(np.abs(response)), color=colour, linestyle=style, label=label)
    unwrapped = np.degrees(np.unwrap(np.angle(response)))
    phase.plot(frequency_hz, unwrapped, color=colour, linestyle=style)


@dataclass(frozen=True, eq=False)
class ResidualDiagnostics:
    """Residuals and what was computed from them.

    `t`, `residual` (samples,) in s and `unit`; `autocorrelation` (lags,) from lag 0, with `bound` for
    white noise at `bound_probability`; `frequency_hz`, `density` (bins,) in Hz and unit²/Hz without the
    zero frequency, with `white_density` the level of white noise of the same variance;
    `normal_quantiles`, `ordered` (points,) in standard deviations.
    """

    t: FloatArray
    residual: FloatArray
    unit: str
    autocorrelation: FloatArray
    bound: float
    frequency_hz: FloatArray
    density: FloatArray
    white_density: float
    normal_quantiles: FloatArray
    ordered: FloatArray
    bound_probability: float = 0.95


def residual_diagnostics(diagnostics: ResidualDiagnostics, what: str = "residuals") -> Figure:
    """Residual over time, autocorrelation, spectrum and normal quantiles; `what` names them."""
    d = diagnostics
    with drawing_settings():
        canvas = new_canvas(4.4)
        (over_time, correlation), (spectrum, quantiles) = canvas.subplots(2, 2)
        over_time.plot(*outline(d.t, d.residual), color=RESIDUAL, linewidth=0.6)
        over_time.set_title("over time")
        over_time.margins(x=0)
        over_time.set(xlabel="time (s)", ylabel=with_unit("residual", d.unit))

        lags = np.arange(len(d.autocorrelation))
        correlation.axhspan(-d.bound, d.bound, color=BAND_NOISE, linewidth=0)
        correlation.vlines(lags[1:], 0, d.autocorrelation[1:], color=RESIDUAL, linewidth=1.2)
        correlation.axhline(0, color=INK, linewidth=0.7)
        correlation.set_title("autocorrelation")
        reach = max(1.6 * d.bound, 1.1 * float(np.max(np.abs(d.autocorrelation[1:]), initial=0.0)))
        correlation.set(
            xlabel="lag (samples)", ylabel="autocorrelation", xlim=(0, lags[-1] + 0.5), ylim=(-reach, reach)
        )

        spectrum.loglog(d.frequency_hz, d.density, color=RESIDUAL, linewidth=0.7)
        spectrum.axhline(d.white_density, color=NOMINAL, linestyle="--", linewidth=1)
        spectrum.set_title("periodogram")
        square = f"{squared_unit(d.unit) or 1}/Hz"
        spectrum.set(xlabel="frequency (Hz)", ylabel=with_unit("power density", square))
        plain_log_ticks(spectrum, "x")
        plain_log_ticks(spectrum, "y")

        reach = float(np.max(np.abs(d.normal_quantiles)))
        quantiles.plot([-reach, reach], [-reach, reach], color=NOMINAL, linestyle="--", linewidth=1)
        shown = _evenly_spread(d.normal_quantiles, QUANTILE_POINTS)
        quantiles.plot(d.normal_quantiles[shown], d.ordered[shown], ".", color=RESIDUAL, markersize=3)
        quantiles.set_title("normal quantiles")
        quantiles.set(xlabel="normal quantile", ylabel="residual (its sd)")
        return finished(
            canvas,
            f"Tests of the {what}: over time; autocorrelation, with the "
            f"{format_percent(d.bound_probability)} bounds of white noise shaded; periodogram, "
            "with the level of white noise of the same variance dashed; quantiles against those of a "
            "normal distribution (dashed).",
            f"Four panels testing the {what}.",
        )


def _evenly_spread(ascending: FloatArray, count: int) -> list[int]:
    """Indices of at most `count` values of an ascending array, about equally far apart, with both ends."""
    targets = np.linspace(ascending[0], ascending[-1], count)
    found = np.searchsorted(ascending, targets).clip(0, len(ascending) - 1)
    return sorted({int(index) for index in found})
