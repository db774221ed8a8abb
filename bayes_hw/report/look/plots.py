"""The plots of the page as plain data: what look.js hands to uPlot."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import TRUSTED
from bayes_hw.first_look.look import Look
from bayes_hw.quantities import output_word
from bayes_hw.record import Record
from bayes_hw.report.page.content import extremes

MOST_SAMPLES = 120_000
"""Samples that the page carries in full; of more, each stretch keeps its smallest and its largest."""

ARCSEC = {"deg": 3600.0, "arcmin": 60.0, "arcsec": 1.0, "rad": 648000 / np.pi, "mrad": 648 / np.pi}


def plots(look: Look) -> list[dict[str, Any]]:
    """Each {"id", "title", "note", "x", "series", ...}, in the order of the page."""
    first = look.records[0]
    share = MOST_SAMPLES / sum(len(record) for record in look.records)
    drawn = [
        time_plot(f"time-{k}", record, error, share)
        for k, (record, error) in enumerate(zip(look.records, look.errors, strict=True))
    ]
    if look.response is not None:
        drawn += response_plots(look)
    if look.noise is not None:
        drawn.append(
            _plot(
                "noise",
                f"noise density, {first.units.output}/√Hz",
                "frequency, Hz",
                look.noise.frequency_hz,
                {"noise": np.sqrt(2 * look.noise.density)},
                log_x=True,
                log_y=True,
            )
        )
    speed, position = look.speed, look.position
    drawn.append(
        _plot(
            "speed",
            f"speed, {first.units.output}/s",
            f"command, {first.units.input}",
            speed.command,
            {"while the command rises": speed.rising, "while it falls": speed.falling},
            points=True,
        )
    )
    drawn.append(
        _plot(
            "position",
            f"mean error, {first.units.output}",
            f"{output_word(first.units.output)}, {first.units.output}",
            position.angle,
            {"mean error": position.mean},
            band=(position.mean - 2 * position.standard_error, position.mean + 2 * position.standard_error),
            points=True,
        )
    )
    return drawn


def is_limited(look: Look) -> bool:
    """Whether a limit or a dead zone is met, so that the response with and without them differ."""
    found = look.statics
    return any(value is not None for value in (found.lower, found.upper, found.half_width))


def time_plot(name: str, record: Record, error: FloatArray, share: float) -> dict[str, Any]:
    """Command, angle and error of one record, in three panels on one axis of time."""
    stretch = 1 if share >= 1 else int(np.ceil(2 / share))
    stretches = -(-len(record) // stretch)
    units = record.units
    panels = (
        (f"command, {units.input}", "command", record.u),
        (f"{output_word(units.output)}, {units.output}", "angle", record.y),
        (f"error, {units.output}", "error", error),
    )
    return {
        "id": name,
        "kind": "time",
        "step": (1 if stretch == 1 else stretch / 2) / record.sample_rate_hz,
        "points": stretches if stretch == 1 else 2 * stretches,
        "x_label": f"time, {units.time}",
        "panels": [
            {"label": label, "role": role, "origin": (origin := float(np.median(v)))}
            | {"values": _packed(extremes(v, stretch) - origin, "<f4")}
            for label, role, v in panels
        ],
    }


def response_plots(look: Look) -> list[dict[str, Any]]:
    """Magnitude with its band, rate, phase and coherence over frequency."""
    assert look.response is not None
    linear, raw, units = look.response.linear, look.response.best_linear, look.records[0].units
    f, x = linear.frequency_hz, "frequency, Hz"
    seen = linear.coherence > TRUSTED
    shown = [np.where(seen, v, np.nan) for v in (linear.magnitude, linear.lower, linear.upper)]
    as_recorded = np.where(raw.coherence > TRUSTED, raw.magnitude, np.nan)
    met = is_limited(look)
    name = "within the limits" if met else "response"
    series = {name: shown[0]}
    coherence = {name if met else "coherence": linear.coherence}
    if met:
        series["as recorded"] = np.interp(f, raw.frequency_hz, as_recorded)
        coherence["as recorded"] = np.interp(f, raw.frequency_hz, raw.coherence)
    bottom = np.nanmin(shown[0]) / 5 if seen.any() else 0.0
    return [
        _plot(
            "magnitude",
            f"output over command, {units.output}/({units.input})",
            x,
            f,
            series,
            band=(np.maximum(shown[1], bottom), shown[2]),
            log_x=True,
            log_y=True,
        ),
        _plot(
            "rate",
            f"rate over command, {units.velocity_gain}",
            x,
            f,
            {name: shown[0] * linear.rate_factor},
            band=(np.maximum(shown[1], bottom) * linear.rate_factor, shown[2] * linear.rate_factor),
            log_x=True,
            log_y=True,
        ),
        _plot("phase", "phase, deg", x, f, {"phase": np.where(seen, linear.phase_deg, np.nan)}, log_x=True),
        _plot(
            "coherence",
            "coherence",
            x,
            f,
            coherence,
            log_x=True,
            span=(0.0, 1.02),
        ),
    ]


def _plot(
    name: str,
    label: str,
    x_label: str,
    x: FloatArray,
    series: Mapping[str, FloatArray],
    *,
    band: tuple[FloatArray, FloatArray] | None = None,
    log_x: bool = False,
    log_y: bool = False,
    points: bool = False,
    span: tuple[float, float] | None = None,
) -> dict[str, Any]:
    return {
        "id": name,
        "kind": "curve",
        "label": label,
        "x_label": x_label,
        "x": _numbers(x),
        "series": [{"label": key, "values": _numbers(values)} for key, values in series.items()],
        "band": None if band is None else [_numbers(edge) for edge in band],
        "log_x": log_x,
        "log_y": log_y,
        "points": points,
        "span": span,
    }


def _numbers(values: FloatArray) -> list[float | None]:
    return [float(f"{v:.6g}") if np.isfinite(v) else None for v in values]


def _packed(values: FloatArray, dtype: str) -> str:
    return base64.b64encode(np.asarray(values).astype(dtype).tobytes()).decode("ascii")
