"""What an engineer looks at first: command and angle, response, step, error over speed and position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import FrequencyResponse
from bayes_hw.quantities import output_word
from bayes_hw.record import Record, Units
from bayes_hw.report.axis.axis_sight import ErrorOver, Sight, StepOfVelocity
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import (
    drawable,
    drawing_settings,
    finished,
    new_canvas,
    outline,
    plain_log_ticks,
    with_unit,
)
from bayes_hw.report.page.palette import BAND_PARAMETERS, DATA, INK, MODEL, MUTED, VERMILLION

SHOWN = 0.3
"""Coherence above which a measured response is drawn."""


def command_and_angle(records: Sequence[Record], limits: Sequence[float]) -> Figure:
    """Command with the limits found, and angle or position, of every record in a column, four at most."""
    shown = list(records)[:4]
    units = shown[0].units
    word = output_word(units.output)
    with drawing_settings():
        canvas = new_canvas(2.6)
        rows = canvas.subplots(2, len(shown), squeeze=False, sharex="col", sharey="row")
        for column, record in enumerate(shown):
            t = record.t - record.t[0]
            command, angle = rows[0][column], rows[1][column]
            for limit in limits:
                command.axhline(limit, color=VERMILLION, linewidth=0.8, linestyle="--")
            command.plot(*outline(t, record.u), color=MUTED, linewidth=0.7)
            angle.plot(*outline(t, record.y + record.origin), color=DATA, linewidth=0.9)
            command.set_title(drawable(record.name))
            angle.set_xlabel(with_unit("time", units.time))
        rows[0][0].set_ylabel(with_unit("command", units.input))
        rows[1][0].set_ylabel(with_unit(word, units.output))
        canvas.align_ylabels()
        more = f" {len(records) - len(shown)} further records are not drawn." if len(records) > 4 else ""
        return finished(
            canvas,
            f"What was recorded: command (above, the limits found dashed) and measured {word} (below).{more}",
            f"Command and {word} over time of {len(shown)} records.",
        )


def response_figure(sight: Sight, units: Units) -> Figure:
    """Measured response of the velocity with its coherence beside the model's."""
    with drawing_settings():
        canvas = new_canvas(3.6)
        magnitude, coherence = canvas.subplots(2, 1, height_ratios=(2.6, 1), sharex=True)
        band = {"color": BAND_PARAMETERS, "alpha": 0.5, "linewidth": 0}
        f = sight.frequency_hz
        magnitude.fill_between(f, _db(sight.low), _db(sight.high), label="G, 94 %", **band)
        magnitude.plot(f, _db(sight.model), color=MODEL, label="G")
        if sight.alike is not None:
            m = sight.alike
            magnitude.plot(
                m.frequency_hz,
                _seen_db(m, sight.gain),
                color=VERMILLION,
                linewidth=0.9,
                label="with the effect",
            )
        if sight.measured is not None:
            m = sight.measured
            magnitude.plot(
                m.frequency_hz, _seen_db(m, sight.gain), ".", color=DATA, markersize=3, label="measured"
            )
            coherence.plot(m.frequency_hz, m.coherence, color=INK, linewidth=0.9)
        low, high = magnitude.get_ylim()
        magnitude.set_ylim(max(low, -60.0), min(high, 60.0))
        for number, mode in enumerate(sight.modes, start=1):
            for axes in (magnitude, coherence):
                axes.axvline(mode, color=MUTED, linewidth=0.7, linestyle=":")
            magnitude.annotate(
                f"f{number} {mode:.3g} Hz", (mode, 0.0), xycoords=("data", "axes fraction"), xytext=(3, 3),
                textcoords="offset points", va="bottom", fontsize=8, rotation=90, color=INK,
            )  # fmt: skip
        magnitude.set_xscale("log")
        plain_log_ticks(coherence, "x")
        magnitude.set_ylabel("velocity over\ncommand (dB)")
        coherence.set(ylabel="coherence", ylim=(0, 1.05))
        coherence.set_xlabel(with_unit("frequency", "Hz"))
        canvas.align_ylabels()
        canvas.legend(loc="outside upper right", ncols=4)
        return finished(
            canvas,
            f"Response of the velocity to the limited command, over its steady value of {sight.gain:.3g} "
            f"{units.velocity_gain or '1'}: measured where the coherence (below: the share of the motion "
            "that the command explains linearly) exceeds 0.3, the same estimate of what the model with its "
            "effects simulates, and the linear block G alone. Points and the thin line should agree; where "
            "the coherence is low, nothing was measured.",
            "Magnitude of the velocity response, measured and modelled, with coherence below.",
        )


def step_figure(step: StepOfVelocity, units: Units) -> Figure:
    """Velocity after a step of the command."""
    with drawing_settings():
        canvas = new_canvas(2.3)
        axes = canvas.subplots()
        axes.fill_between(step.t, step.low, step.high, color=BAND_PARAMETERS, alpha=0.6, linewidth=0)
        plain = step.without is step.velocity
        if not plain:
            axes.plot(step.t, step.without, color=VERMILLION, linewidth=1.0, label="without the effect")
        axes.plot(step.t, step.velocity, color=MODEL, label="model")
        axes.set_xlabel(with_unit("time from the step", units.time))
        axes.set_ylabel(with_unit("velocity", f"{units.output}/s"))
        axes.set_xlim(step.t[0], step.t[-1])
        canvas.legend(loc="outside upper right", ncols=2)
        return finished(
            canvas,
            f"Velocity after a step of the command from rest to {step.command:.3g} {units.input}, as the "
            f"model has it (band: 94 %){'' if plain else ', and its linear part alone'}.",
            "Step response of the velocity with a band.",
        )


def errors_figure(errors: Sequence[ErrorOver], unit: str) -> Figure:
    """Mean error over speed and over position, before and after."""
    with drawing_settings():
        canvas = new_canvas(2.5)
        panels = canvas.subplots(1, len(errors), sharey=True, squeeze=False)[0]
        for axes, error in zip(panels, errors, strict=True):
            axes.axhline(0, color=INK, linewidth=0.6)
            if error.compared:
                axes.plot(error.x, error.before, "o-", color=VERMILLION, markersize=3, label="before")
            axes.errorbar(
                error.x, error.after, yerr=2 * error.standard_error, fmt="o-", color=MODEL, markersize=3,
                elinewidth=1, label="after",
            )  # fmt: skip
            axes.set_xlabel(with_unit(error.name, error.unit))
        panels[0].set_ylabel(with_unit("mean error", unit))
        compared = any(error.compared for error in errors)
        handles, labels = panels[0].get_legend_handles_labels()
        if compared:
            canvas.legend(handles, labels, loc="outside upper right", ncols=2)
        return finished(
            canvas,
            "Mean error over speed and over position on the training records"
            + (
                ": of the best model without the effect (before) and with it (after, two standard errors)."
                if compared
                else ", two standard errors of white noise. Friction, play and waves of the reading show."
            ),
            "Mean error over speed and position, before and after.",
        )


def _seen_db(response: FrequencyResponse, gain: float) -> FloatArray:
    """Of the velocity over `gain`, (frequencies,), where the command explains it."""
    magnitude = response.magnitude * response.rate_factor / abs(gain)
    return _db(np.where(response.coherence > SHOWN, magnitude, np.nan))


def _db(magnitude: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(20 * np.log10(magnitude))
