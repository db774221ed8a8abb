"""Figures of a diagnosis: the gap on the record held out, where it lies, which effect, how far it shrinks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import LogLocator

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.latent_force import LatentForce
from bayes_hw.gap.criticism.residual_map import ResidualMap
from bayes_hw.gap.effects.words import BLOCK_WORDS
from bayes_hw.gap.joint.answer.free_function import EffectView
from bayes_hw.gap.noise.spectra import Spectrum
from bayes_hw.record import Record
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    envelope,
    finished,
    new_canvas,
    outline,
    plain_log_ticks,
    with_unit,
    wrapped,
)
from bayes_hw.report.page.palette import BAND_NOISE, DATA, INK, MODEL, MUTED, NOMINAL, VERMILLION
from bayes_hw.report.page.rounding import format_number, format_percent
from bayes_hw.report.page.typography import squared_unit, typeset_unit

QUANTITY_CHARACTERS = 34
"""That fit beside a figure of an effect."""

BEFORE = VERMILLION
AFTER = MODEL
OTHER_BAR = "#b9c3cc"
LOUDEST = LinearSegmentedColormap.from_list("gap", ["#ffffff", "#BFE0F5", MODEL, "#1b1b3a"])
SHOWN_FROM = 0.01
"""Probability above which a label has a bar."""

LEAST_DECIBELS = 20.0
"""The colour scale of a map reaches at least this far, so that a map of noise looks like one."""


def gap_on_record(
    record: Record,
    before: FloatArray,
    after: FloatArray,
    low: FloatArray,
    high: FloatArray,
    noise_sigma: float,
    stretch: tuple[float, float] | None = None,
) -> Figure:
    """Record, predictions and errors of both over time; of `stretch` (start, end) in s only, where given.

    `before`, `after`, `low`, `high` have shape (samples,), output units as `noise_sigma`.
    """
    part = "" if stretch is None else f", {stretch[0]:.4g} to {stretch[1]:.4g} s"
    with drawing_settings():
        return finished(
            gap_canvas(record, before, after, low, high, noise_sigma, stretch),
            f"The record held out, “{record.name}”{part}: measured output and its prediction by the "
            "re-estimated model (before) and by the same with the answer's effects (after). Below, record "
            "minus prediction with the 94 % band of the measured output and the noise floor.",
            "Output and prediction errors over time, before and after the effects are added.",
        )


def gap_canvas(
    record: Record,
    before: FloatArray,
    after: FloatArray,
    low: FloatArray,
    high: FloatArray,
    noise_sigma: float,
    stretch: tuple[float, float] | None = None,
) -> Canvas:
    """The drawing of `gap_on_record`."""
    time = record.t - record.t[0]
    kept = slice(None) if stretch is None else slice(*np.searchsorted(time, stretch))
    t, y = time[kept], record.y[kept]
    b, a, lower, upper = before[kept], after[kept], low[kept], high[kept]
    with drawing_settings():
        canvas = new_canvas(4.2)
        whole, *errors = canvas.subplots(3, 1, height_ratios=(1.2, 1.0, 1.0), sharex=True)
        whole.plot(*outline(t, y), color=DATA, linewidth=1.6, label="record")
        whole.plot(*outline(t, b), color=BEFORE, linewidth=0.9, label="before")
        whole.plot(*outline(t, a), color=AFTER, linewidth=0.9, label="after")
        whole.set_ylabel(with_unit("output", record.units.output))
        reach = 1.05 * max(float(np.abs(y - b).max()), float(np.abs(y - a).max()))
        for axes, mean, colour, name in zip(
            errors, (b, a), (BEFORE, AFTER), ("before", "after"), strict=True
        ):
            if name == "after":
                band = envelope(t, lower - a, upper - a)
                axes.fill_between(*band, color=BAND_NOISE, linewidth=0, label="94 % band")
            axes.plot(*outline(t, y - mean), color=colour, linewidth=0.7)
            for side in (-1, 1):
                label = "noise floor, ± one sd" if (name, side) == ("after", 1) else None
                axes.axhline(side * noise_sigma, color=INK, linewidth=0.9, linestyle="--", label=label)
            axes.set_ylim(-reach, reach)
            axes.set_ylabel("error\n" + with_unit(name, record.units.output))
        error = errors[1]
        error.set_xlabel(with_unit("time from first sample", record.units.time))
        error.set_xlim(t[0], t[-1])
        canvas.align_ylabels()
        handles, labels = whole.get_legend_handles_labels()
        more, words = error.get_legend_handles_labels()
        canvas.legend(handles + more, labels + words, loc="outside upper center", ncols=5, columnspacing=1.1)
    return canvas


def block_shares(share: Mapping[str, float], named: str) -> Figure:
    """Probability of every block that the cause enters there; the block `named` stands out."""
    return _bars(
        {BLOCK_WORDS.get(name, name): 100 * value for name, value in share.items()},
        {BLOCK_WORDS.get(named, named)},
        "probability (%)",
        "Where it enters: probability of every place, two causes counted half each. Of an effect of the "
        "catalogue that is where it acts; where none is found, places are compared by how much functions "
        f"that name no cause explain there. Verdict: {BLOCK_WORDS.get(named, named)}.",
        f"Bars of {len(share)} blocks; the verdict is {named}.",
        100.0,
    )


def label_probabilities(probability: Mapping[str, float], answer: Sequence[str]) -> Figure:
    """Marginal probability that each label is present, none and other among them: those above `SHOWN_FROM`,
    and the answer; the others in one line."""
    blue = set(answer) or {"none"}
    ordered = sorted(probability.items(), key=lambda item: -item[1])
    shown = {name: 100 * p for name, p in ordered if p > SHOWN_FROM or name in blue}
    rest = [p for name, p in ordered if name not in shown]
    others = f" Not drawn: {len(rest)} more, each {format_percent(rest[0], 1)} or less." if rest else ""
    return _bars(
        shown,
        blue,
        "probability (%)",
        "Which: probability that each effect is present. The bars need not add up to 100 %: two "
        f"effects can be present at once. Blue: the answer.{others}",
        f"Bars of {len(shown)} labels; the answer is {', '.join(answer) or 'none'}.",
        100.0,
    )


def _bars(
    values: Mapping[str, float], blue: set[str], quantity: str, caption: str, alt: str, limit: float
) -> Figure:
    with drawing_settings():
        canvas = new_canvas(0.65 + 0.2 * len(values))
        axes = canvas.subplots()
        _draw_bars(axes, values, blue, lambda percent: format_percent(percent / 100, 1))
        axes.set_xlim(0, 1.12 * limit)
        axes.set_xlabel(quantity)
        return finished(canvas, caption, alt)


def _draw_bars(
    axes: Axes,
    values: Mapping[str, float],
    blue: set[str],
    label: Callable[[float], str] = lambda value: format_number(value, 2),
) -> None:
    at = np.arange(len(values))
    colours = [MODEL if name in blue else OTHER_BAR for name in values]
    axes.barh(at, list(values.values()), height=0.68, color=colours)
    for row, value in enumerate(values.values()):
        axes.annotate(
            label(value),
            (value, row),
            (3, 0),
            textcoords="offset points",
            va="center",
            size=8,
        )
    axes.set_yticks(at, [drawable(name) for name in values])
    axes.invert_yaxis()
    axes.grid(False, axis="y")


def residual_spectrum(
    base: Spectrum,
    after: Spectrum | None,
    floor: FloatArray,
    band_hz: tuple[float, float],
    unit: str,
    after_name: str,
) -> Figure:
    """Residual spectra of the base model and of `after`, `floor` of the noise at the base's frequencies."""
    low, high = band_hz
    with drawing_settings():
        canvas = new_canvas(2.7)
        axes = canvas.subplots()
        axes.axvspan(low, max(high, 1.02 * low), color=NOMINAL, alpha=0.18, linewidth=0, label="named band")
        axes.loglog(base.frequencies, base.power, color=BEFORE, linewidth=1.0, label="before")
        if after is not None:
            axes.loglog(after.frequencies, after.power, color=AFTER, linewidth=1.0, label="after")
        axes.loglog(base.frequencies, floor, color=INK, linestyle="--", linewidth=1.0, label="noise")
        axes.set_xlim(base.frequencies[0], base.frequencies[-1])
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel(with_unit("power a sample", squared_unit(unit)))
        plain_log_ticks(axes, "x")
        plain_log_ticks(axes, "y")
        canvas.legend(loc="outside upper center", ncols=4)
        second = "" if after is None else f", and with {after_name}"
        return finished(
            canvas,
            f"Where by band: spectrum of the training residuals of the re-estimated model{second}, with "
            f"that of the noise. Shaded: {low:.3g} to {high:.3g} Hz, the shortest band that holds most of "
            "the excess.",
            "Residual spectra before and after, with the noise and the named band.",
        )


def time_frequency(shown: ResidualMap, record_name: str) -> Figure:
    """The base residual's power over the noise's, by time and frequency."""
    top = max(LEAST_DECIBELS, float(np.quantile(shown.decibels, 0.995)))
    f = shown.frequencies
    edges = np.concatenate([[f[0] / np.sqrt(2)], np.sqrt(f[1:] * f[:-1]), [f[-1] + 0.5 * (f[-1] - f[-2])]])
    step = shown.times[1] - shown.times[0] if len(shown.times) > 1 else 2 * shown.times[0]
    starts = np.append(shown.times - step / 2, shown.times[-1] + step / 2)
    with drawing_settings():
        canvas = new_canvas(2.8)
        axes = canvas.subplots()
        mesh = axes.pcolormesh(
            starts, edges, shown.decibels, cmap=LOUDEST, vmin=0.0, vmax=top, rasterized=True
        )
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        plain_log_ticks(axes, "y")
        axes.grid(False)
        axes.set(xlabel="time from first sample (s)", ylabel="frequency (Hz)")
        bar = canvas.colorbar(mesh, ax=axes, label="dB over the noise", pad=0.02)
        bar.outline.set_visible(False)  # type: ignore[operator]
        return finished(
            canvas,
            f"Where in time and frequency: residual of the re-estimated model on the training record "
            f"“{record_name}”, in dB over the noise. Blank: no more than the noise. One window of pure noise "
            "reaches 6 dB one time in fifty.",
            "Map of the residual's power over the noise by time and frequency.",
        )


def regimes_and_coherences(
    regimes: Mapping[str, float], coherences: Mapping[str, float], named: str
) -> Figure:
    """Mean square over the noise in every regime; coherence of the residual with functions of u."""
    with drawing_settings():
        canvas = new_canvas(0.75 + 0.24 * max(len(regimes), len(coherences)))
        left, right = canvas.subplots(1, 2, width_ratios=(1.25, 1.0))
        _draw_bars(left, regimes, {named})
        left.axvline(1.0, color=INK, linestyle="--", linewidth=1.0)
        left.set_xlim(0, 1.15 * max([*regimes.values(), 1.0]))
        left.set_xlabel("mean square /\nthat of the noise")
        _draw_bars(right, {typeset_unit(name): share for name, share in coherences.items()}, set())
        right.set_xlim(0, 1.15 * max([*coherences.values(), 0.1]))
        right.set_xlabel("mean squared\ncoherence")
        return finished(
            canvas,
            "Where by regime: mean square of the residual over the noise's in the samples of every regime "
            "(dashed: as large as the noise; blue: the regime named), and mean squared coherence of the "
            "residual with functions of the command and of motion.",
            f"Bars of {len(regimes)} regimes and {len(coherences)} coherences.",
        )


def time_segments(segments: Sequence[float]) -> Figure:
    """Rms of the residual in equal parts of the records, in units of the noise."""
    edges = np.linspace(0, 100, len(segments) + 1)
    with drawing_settings():
        canvas = new_canvas(1.7)
        axes = canvas.subplots()
        axes.stairs(segments, edges, fill=True, color=OTHER_BAR)
        axes.stairs(segments, edges, color=BEFORE, linewidth=1.2)
        axes.axhline(1.0, color=INK, linestyle="--", linewidth=1.0)
        axes.set(xlim=(0, 100), xlabel="part of the record (%)", ylabel="rms / noise")
        axes.set_ylim(0, 1.1 * max([*segments, 1.0]))
        return finished(
            canvas,
            f"Where in time: rms of the residual in {len(segments)} equal parts of the training records, in "
            "units of the noise (dashed).",
            "Rms of the residual over the course of the records.",
        )


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
        axes.set_ylabel(wrapped(with_unit(view.quantity, view.quantity_unit), QUANTITY_CHARACTERS))
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
