"""Figures of the study of interval widths: over length, over amplitude and by kind of command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, plain_log_ticks
from bayes_hw.report.page.palette import INK, MUTED, PAPER, ensemble_colour

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
TICKS_APART = 1.35


@dataclass(frozen=True, eq=False)
class WidthCurve:
    """Relative half widths (settings,) of one parameter; `from_prior` where the prior decides."""

    symbol: str
    setting: FloatArray
    relative: FloatArray
    from_prior: BoolArray


def widths_by_setting(
    lengths: Sequence[WidthCurve], amplitudes: Sequence[WidthCurve], limits: tuple[float, float]
) -> Figure:
    """Relative half widths over length, beside 1/sqrt(length), and over amplitude, with the limits."""
    with drawing_settings():
        canvas = new_canvas(3.6)
        left, right = canvas.subplots(1, 2, sharey=True)
        _curves(left, lengths)
        _curves(right, amplitudes)
        t = lengths[0].setting
        middle = float(np.exp(np.mean([np.log(curve.relative[0]) for curve in lengths])))
        left.plot(t, middle * np.sqrt(t[0] / t), color=INK, linestyle="--", linewidth=1.6)
        for limit in limits:
            right.axvline(abs(limit), color=MUTED, linestyle=":", linewidth=1.4)
        left.set(xlabel="length of a record (s)", ylabel="half the 94 % interval / true value")
        right.set(xlabel="amplitude of the sweep (deg/s)")
        handles = [
            Line2D(
                [], [], color=ensemble_colour(i), marker=MARKERS[i % len(MARKERS)], ms=4, label=curve.symbol
            )
            for i, curve in enumerate(lengths)
        ]
        handles += [
            Line2D([], [], color=INK, linestyle="--", label="1/√length"),
            Line2D([], [], color=MUTED, linestyle=":", label="limits"),
            Line2D(
                [], [], color=MUTED, marker="o", markerfacecolor=PAPER, linestyle="", label="prior decides"
            ),
        ]
        canvas.legend(handles=handles, loc="outside upper center", ncols=6)
        return finished(
            canvas,
            "Half the 94 % interval over the true value. Left: over the length of each of two records; the"
            " dashed line falls as 1/√length. Right: over the amplitude at one length; dotted, the sizes of"
            " the two limits. Open markers: the records leave the parameter to its prior.",
            f"Interval widths of {len(lengths)} parameters over length and amplitude, logarithmic axes.",
        )


def widths_by_kind(kinds: Mapping[str, Mapping[str, tuple[float, bool]]]) -> Figure:
    """One row a kind of command, one marker a parameter; open where the prior decides."""
    symbols = list(next(iter(kinds.values())))
    with drawing_settings():
        canvas = new_canvas(1.1 + 0.36 * max(len(kinds), 3))
        axes = canvas.subplots()
        for row, widths in enumerate(kinds.values()):
            for number, (relative, from_prior) in enumerate(widths.values()):
                colour = ensemble_colour(number)
                axes.plot(
                    relative,
                    row + 0.08 * (number - (len(symbols) - 1) / 2),
                    MARKERS[number % len(MARKERS)],
                    color=colour,
                    markerfacecolor=PAPER if from_prior else colour,
                    markersize=5,
                )
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set_yticks(range(len(kinds)), list(kinds))
        axes.set(xlabel="half the 94 % interval / true value")
        axes.invert_yaxis()
        canvas.legend(
            handles=[
                Line2D(
                    [], [], color=ensemble_colour(i), marker=MARKERS[i % len(MARKERS)], ls="", ms=5, label=s
                )
                for i, s in enumerate(symbols)
            ],
            loc="outside upper center",
            ncols=len(symbols),
        )
        return finished(
            canvas,
            "Half the 94 % interval over the true value for other commands of one length and amplitude; open"
            " markers where the records leave the parameter to its prior.",
            f"Interval widths for {len(kinds)} kinds of command.",
        )


def _curves(axes: Axes, curves: Sequence[WidthCurve]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for number, curve in enumerate(curves):
        colour, marker = ensemble_colour(number), MARKERS[number % len(MARKERS)]
        axes.plot(curve.setting, curve.relative, color=colour, marker=marker, markersize=4)
        open_at = curve.from_prior
        axes.plot(
            curve.setting[open_at],
            curve.relative[open_at],
            marker,
            color=colour,
            markerfacecolor=PAPER,
            markersize=5,
        )
    axes.xaxis.set_major_locator(FixedLocator(_apart(curves[0].setting)))
    axes.xaxis.set_minor_locator(NullLocator())
    plain_log_ticks(axes, "x")
    plain_log_ticks(axes, "y")


def _apart(settings: FloatArray) -> list[float]:
    """The settings that can be labelled beside each other on a logarithmic axis."""
    kept: list[float] = []
    for setting in settings:
        if not kept or setting > TICKS_APART * kept[-1]:
            kept.append(float(setting))
    return kept
