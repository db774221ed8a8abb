"""The report on a plan: what to record of an axis, what each part is for, how to play and keep it."""

from __future__ import annotations

import numpy as np

from bayes_hw.first_look.plan import AxisLimits, Plan, angle
from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import (
    Badge,
    Bullets,
    Figure,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
)
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, outline
from bayes_hw.report.page.palette import DATA, GRID, MODEL, VERMILLION
from bayes_hw.report.page.rounding import format_duration, format_interval, format_number

KEEPING = (
    "Start from rest, and leave the axis at rest at the end: a start in motion has to be estimated.",
    "Record the command that the drive was given, not the one that was asked for, and the angle as read, "
    "unfiltered, both at the same instants.",
    "Keep the clock's stamps as they are. A file without stamps needs its rate said: --rate.",
    "Write down the units: deg beside rad is the commonest mistake.",
    "Change nothing between the repeats: same tuning, same temperature, same balance.",
    "Keep the hold-out out of every fit. It is for the score alone.",
)


def plan_report(plan: Plan, limits: AxisLimits, origin: Provenance) -> Report:
    """The report whose first page answers: what is to be played, and does the axis allow it?"""
    return Report(
        title="What to record",
        subtitle="Commands to play on an axis not yet known, within what it may do",
        verdict=_verdict(plan),
        badges=_badges(plan, limits),
        key_figure=_commands_figure(plan, limits),
        sections=(
            Section(
                "What each part is for",
                (
                    Table(
                        ("part", "from", "to", "largest command", "shows"),
                        tuple(
                            (
                                part.name,
                                format_duration(part.start_s),
                                format_duration(part.end_s),
                                format_number(_largest(plan, part.start_s, part.end_s)),
                                part.shows,
                            )
                            for part in plan.parts
                        ),
                        "Parts of train.csv, in the order in which they are played.",
                        (1, 2, 3),
                    ),
                ),
            ),
            Section("Why so", (Bullets(plan.reasons),)),
            Section("How to play and keep it", (Bullets(KEEPING),)),
            Section(
                "Then",
                (
                    Paragraph(
                        "Look at the records before any model: bayes-hw look train_1.csv train_2.csv "
                        "holdout.csv --out look/. It says which of these things they show. Then: bayes-hw "
                        "report train_1.csv train_2.csv --holdout holdout.csv --out report/."
                    ),
                ),
            ),
            Section("Provenance", (KeyValues(origin.rows()),)),
        ),
    )


def _verdict(plan: Plan) -> str:
    rate = plan.sample_rate_hz
    train, holdout = (format_duration(len(u) / rate) for u in (plan.train, plan.holdout))
    total = format_duration((2 * len(plan.train) + len(plan.holdout)) / rate)
    return (
        f"Play train.csv ({train}) twice and holdout.csv ({holdout}) once, recorded at {rate:g} Hz: {total} "
        "in all. The first two are for the fit, the third for the score."
    )


def _badges(plan: Plan, limits: AxisLimits) -> tuple[Badge, ...]:
    both, rate = (plan.train, plan.holdout), plan.sample_rate_hz
    velocity = max(float(np.abs(u).max()) for u in both)
    acceleration = max(float(np.abs(np.diff(u)).max()) * rate for u in both)
    moved = np.concatenate([angle(u, limits, rate) for u in both])
    samples = rate / plan.highest_hz
    return (
        Badge(
            "largest command",
            "good",
            f"{format_number(velocity)} of {format_number(limits.velocity)} allowed",
        ),
        Badge(
            "largest change in 1 s",
            "good",
            f"{format_number(acceleration)} of {format_number(limits.acceleration)} allowed",
        ),
        Badge(
            "angle from the start",
            "good",
            f"{format_interval(float(moved.min()), float(moved.max()))} of an ideal axis, of "
            f"{format_interval(limits.low, limits.high)} allowed",
        ),
        Badge("rate", "good", f"{samples:.0f} samples in a cycle of {plan.highest_hz:g} Hz, the highest"),
    )


def _largest(plan: Plan, start_s: float, end_s: float) -> float:
    start, end = (round(t * plan.sample_rate_hz) for t in (start_s, end_s))
    return float(np.abs(plan.train[start:end]).max())


def _commands_figure(plan: Plan, limits: AxisLimits) -> Figure:
    """Both commands and where an ideal axis goes, with the limits."""
    with drawing_settings():
        canvas = new_canvas(4.0)
        widths = [len(plan.train), len(plan.holdout)]
        panels = canvas.subplots(2, 2, sharey="row", sharex="col", width_ratios=widths)
        for column, (name, u) in enumerate((("train", plan.train), ("holdout", plan.holdout))):
            above, below = panels[:, column]
            t = np.arange(len(u)) / plan.sample_rate_hz
            if name == "train":
                for part in plan.parts[::2]:
                    for panel in (above, below):
                        panel.axvspan(part.start_s, part.end_s, color=GRID, alpha=0.5, linewidth=0)
            above.set_title(f"{name}.csv")
            above.plot(*outline(t, u), color=DATA, linewidth=0.7)
            below.plot(*outline(t, angle(u, limits, plan.sample_rate_hz)), color=MODEL, linewidth=0.9)
            for panel, ends in (
                (above, (-limits.velocity, limits.velocity)),
                (below, (limits.low, limits.high)),
            ):
                for end in ends:
                    panel.axhline(end, color=VERMILLION, linestyle="--", linewidth=0.9)
            below.set(xlabel="time (s)", xlim=(0, t[-1]))
        panels[0, 0].set_ylabel("command")
        panels[1, 0].set_ylabel("angle, ideal axis")
        return finished(
            canvas,
            "The command for training and the one held out (above), and where an axis without limits, modes "
            "and play would go (below). Dashed: what the axis may do. Grey: rest.",
            "Two commands over time above the angles of an ideal axis.",
        )
