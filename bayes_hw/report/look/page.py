"""The page as one self-contained HTML file: no script, style or picture from outside.

uPlot draws the plots: it is made for long time series, zooms, keeps several panels on one axis of time, and
is 50 kB; Bokeh's and Plotly's scripts are above the size that a page may have.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from bayes_hw.files import staged, write_json, write_text_atomically
from bayes_hw.first_look.advice import coherent_band, reverses
from bayes_hw.first_look.known_columns import KnownColumn
from bayes_hw.first_look.look import Look
from bayes_hw.quantities import output_word
from bayes_hw.report.look.plots import ARCSEC, is_limited, plots
from bayes_hw.report.page.page_head import environment, page_of, script_json
from bayes_hw.report.page.rounding import (
    format_duration,
    format_estimate,
    format_interval,
    format_number,
    format_percent,
)
from bayes_hw.report.page.typography import NO_BREAK_SPACE, visible

JSON, PAGE = "look.json", "report.html"
FOLDER = files("bayes_hw.report.look")
SHARED = files("bayes_hw.report.page") / "templates"


def to_html(look: Look, title: str = "") -> str:
    """The whole page."""
    script = "\n".join(
        [(FOLDER / "uplot" / "uPlot.iife.min.js").read_text("utf-8"), (FOLDER / "look.js").read_text("utf-8")]
    )
    style = "\n".join(
        [
            (SHARED / "report.css").read_text("utf-8"),
            (FOLDER / "uplot" / "uPlot.min.css").read_text("utf-8"),
            (FOLDER / "look.css").read_text("utf-8"),
        ]
    )
    return page_of(
        _templates(),
        title=visible(title or ", ".join(record.name for record in look.records)),
        style=style,
        script=script,
        subtitle=visible(subtitle(look)),
        advice=look.advice,
        cards=cards(look),
        facts=[*facts(look), *treatment(look)],
        records=[record.name for record in look.records],
        output=output_word(look.records[0].units.output),
        distortion=look.distortion,
        plots=script_json(plots(look)),
        has_response=look.response is not None,
        has_noise=look.noise is not None,
        limited=is_limited(look),
        repeats=look.repeated.is_seen,
    )


def write(look: Look, folder: Path, title: str = "") -> None:
    """look.json and report.html into `folder`, both or neither; raises InputError where it cannot be."""
    page = to_html(look, title)
    with staged(folder) as place:
        write_json(place / JSON, look.to_dict())
        write_text_atomically(place / PAGE, page)


def first_screen(look: Look) -> str:
    """The sentence, the cards and the advice alone, as a fragment for notebooks."""
    return environment(_templates()).get_template("first.html").render(advice=look.advice, cards=cards(look))


def subtitle(look: Look) -> str:
    """How much was recorded."""
    samples = sum(len(record) for record in look.records)
    return (
        f"{len(look.records)} record{'s' * (len(look.records) > 1)}, {format_duration(look.duration_s)} at "
        f"{look.records[0].sample_rate_hz:g} Hz, {samples:,} samples"
    )


def treatment(look: Look) -> list[tuple[str, str]]:
    """What was done to the records, for the table at the end; nothing where nothing was."""
    first = look.records[0]
    moved = [f"{o:.6g}" for o in look.origins if o != 0]
    unit = first.units.output
    done = [f"{output_word(unit)}s count from where each record begins ({', '.join(moved)} {unit})"]
    said = [*(done if moved else []), *first.treatment]
    return [("how the records were read", "; ".join(said))] if said else []


def cards(look: Look) -> list[dict[str, str]]:
    """At most four: limits, response, delay, noise."""
    units, band = look.records[0].units, coherent_band(look.response)
    low, high = look.at_limits
    met = low + high
    return [
        _card(
            "good" if met > 0 else "warn",
            f"limits asked for in {format_percent(met)} of the samples" if met > 0 else "limits not met",
            (f"below {format_percent(low)}, above {format_percent(high)}; " if met > 0 else "")
            + f"the axis {reverses(look.reversals)}",
        ),
        _card(
            "bad" if band is None else "good",
            "no frequency response" if band is None else f"response from {band[0]:.2g} to {band[1]:.2g} Hz",
            "coherence nowhere above 0.8" if band is None else "coherence above 0.8",
        ),
        _card(
            "warn" if look.delay is None or not look.delay.is_close else "good",
            "delay unknown"
            if look.delay is None
            else f"delay {format_interval(look.delay.low, look.delay.high, 's')}",
            "first motion after a command, 94 % interval; a slow start counts as delay",
        ),
        _card(
            "info",
            f"noise {format_number(look.noise_sigma, 3, units.output)}",
            "standard deviation" + _arcsec(look.noise_sigma, units.output) + _beside(look),
        ),
    ]


def facts(look: Look) -> list[tuple[str, str]]:
    """Names and values of the table at the end."""
    units, statics = look.records[0].units, look.apart
    slope, error = look.drift_per_hour
    rows = [
        ("lower limit", _known(statics.lower, units.input, "not met")),
        ("upper limit", _known(statics.upper, units.input, "not met")),
        ("dead zone, half width", _known(statics.half_width, units.output, _no_dead_zone(look))),
        *_repeated(look),
        ("noise, standard deviation", format_number(look.noise_sigma, 3, units.output) + _beside(look)),
        ("white part of it", format_number(look.white_sigma, 3, units.output)),
        ("resolution", _known(look.resolution, units.output, "no step seen")),
        ("drift", format_estimate(slope, error, f"{units.output}/h")),
        ("reversals", str(look.reversals)),
        (
            "speed, falling less rising command",
            "not seen both ways"
            if look.speed.hysteresis != look.speed.hysteresis
            else format_percent(look.speed.hysteresis, 1),
        ),
    ]
    for name, regime in look.regimes.items():
        if regime.stretches:
            settling = (
                "" if regime.settling_s is None else f", settles in {format_duration(regime.settling_s)}"
            )
            rows.append(
                (
                    f"{name}, {regime.stretches} stretches",
                    f"{format_duration(regime.seconds)}, "
                    f"rms error {format_number(regime.error_rms, 3, units.output)}"
                    f"{_arcsec(regime.error_rms, units.output)}{settling}",
                )
            )
    if look.distortion is not None:
        rows.append(
            (
                "what a linear response leaves" + _beside(look),
                f"explained by even powers of the command {format_percent(look.distortion.even)}, "
                f"by odd ones {format_percent(look.distortion.odd)}; the rest is noise"
                + (" and what reversals leave" if look.repeated.is_seen else ""),
            )
        )
    if look.feedback is not None:
        hint = "a loop was closed" if look.feedback.closed_loop else "no sign of a closed loop"
        rows.append(("command against past noise", f"correlation {look.feedback.correlation:.2g}: {hint}"))
    rows += [(f"error beside {column.name}", _following(column)) for column in look.known]
    return [(visible(name), visible(value)) for name, value in rows]


def _beside(look: Look) -> str:
    """That what repeats with direction and angle is not in it, where something does."""
    return ", beside what repeats with direction and angle" if look.repeated.is_seen else ""


def _repeated(look: Look) -> list[tuple[str, str]]:
    """Hysteresis and ripples, and the error with them."""
    unit, repeated, rows = look.records[0].units.output, look.repeated, []
    behind = repeated.hysteresis
    if behind is not None:
        value = (
            format_estimate(abs(behind.half_width), behind.standard_error, unit)
            if behind.is_clear
            else f"none seen, below {format_number(behind.bound, 2, unit)} (94 %)"
        )
        rows.append(("hysteresis by direction, half width", value))
    for ripple in repeated.ripples:
        size, period = (format_number(value, 3, unit) for value in (ripple.amplitude, ripple.period))
        rows.append(("error periodic in the angle", f"amplitude {size}, period {period}"))
    if repeated.is_seen:
        squares = sum(float(error @ error) for error in look.errors)
        rms = (squares / sum(map(len, look.errors))) ** 0.5
        rows.append(("error of the linear response, rms", format_number(rms, 3, unit)))
    return rows


def _following(column: KnownColumn) -> str:
    if not column.follows:
        return f"coherence nowhere above {column.bound:.2f}: the error does not follow it"
    return (
        f"coherence up to {column.coherence.max():.2f}, at {column.strongest_hz:.2g} Hz: "
        f"{format_percent(column.share)} of the error follows it"
    )


def _card(state: str, label: str, detail: str) -> dict[str, str]:
    return {"state": state, "label": visible(label), "detail": visible(detail)}


def _no_dead_zone(look: Look) -> str:
    """What to say of one that was not found: nothing where the strokes do not tell."""
    return "not to be told from these records" if look.repeated.hysteresis is None else "none seen"


def _known(value: float | None, unit: str, otherwise: str) -> str:
    return otherwise if value is None else format_number(value, 3, unit)


def _arcsec(value: float, unit: str) -> str:
    return (
        f" ({format_number(value * ARCSEC[unit], 3)}{NO_BREAK_SPACE}arcsec)"
        if unit in ARCSEC and unit != "arcsec"
        else ""
    )


def _templates() -> dict[str, str]:
    return {name: (FOLDER / name).read_text("utf-8") for name in ("look.html", "first.html")}
