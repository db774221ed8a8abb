"""The report of the power study: the smallest gap that is named right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from blind_check.power import PROBABILITY, SmallestGap

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import Badge, Bullets, Figure, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.drawing import drawable, drawing_settings, finished, new_canvas, plain_log_ticks
from bayes_hw.report.page.palette import BLUE, MUTED, VERMILLION
from bayes_hw.report.page.rounding import format_percent

AXIS = (0.06, 3.5)
TICKS = (0.1, 0.2, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class PowerStudy:
    """Smallest gaps by effect (in the setting `reference`) and by setting (over all effects).

    `outcomes` holds gap over sigma, and whether it was named right, of every case in the reference setting.
    """

    by_effect: Mapping[str, SmallestGap]
    by_setting: Mapping[str, SmallestGap]
    reference: str
    outcomes: Mapping[str, Sequence[tuple[float, bool]]]


def power_report(study: PowerStudy, provenance: Provenance) -> Report:
    """The report whose first page shows the smallest gap of every effect."""
    level = format_percent(PROBABILITY)
    return Report(
        title="Power of the diagnosis",
        subtitle=f"The smallest gap, in units of the noise, that is named right with {level} probability",
        verdict=_verdict(study),
        badges=tuple(
            Badge(name, "good" if np.isfinite(gap.gap) else "warn", f"{gap_text(gap)}, {gap.trials} cases")
            for name, gap in study.by_setting.items()
        ),
        key_figure=smallest_gaps(study.by_effect, study.outcomes, f"Every effect, {study.reference}"),
        sections=(
            Section(
                "Record length and excitation",
                (
                    smallest_gaps(study.by_setting, {}, "All effects together, by setting"),
                    _table(study.by_setting, "setting"),
                ),
            ),
            Section("By effect", (_table(study.by_effect, "effect"),)),
            Section(
                "How it was found",
                (
                    Paragraph(
                        "Every case carries one effect, whose strength leaves a gap drawn log-uniformly, in"
                        " root mean square over the training records after the base parameters are"
                        " re-estimated. The share named exactly right is a logistic curve in the logarithm"
                        " of the gap; given are posterior median and 95 % interval, with an even prior over"
                        " the gaps tried and a factor of ten beyond, and a slope by which the share rises"
                        " from 1 in 10 to 9 in 10 within a factor of 1.7 to 54."
                    ),
                    Bullets(
                        (
                            "A smallest gap below or beyond all gaps tried is given as a bound.",
                            "Averages over forms of an effect, plants, noise colours and nominal models; a"
                            " form may be easier or harder than its label.",
                        )
                    ),
                ),
            ),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def gap_text(gap: SmallestGap) -> str:
    """Gap and interval, with bounds where only the side is known."""
    low, high = (_bound(end) for end in gap.interval)
    return f"{_bound(gap.gap)} [{low}, {high}]"


def smallest_gaps(
    gaps: Mapping[str, SmallestGap], outcomes: Mapping[str, Sequence[tuple[float, bool]]], what: str
) -> Figure:
    """One row a name: the smallest gap with its interval, and the cases behind it where given."""
    names = list(gaps)
    with drawing_settings():
        canvas = new_canvas(0.8 + 0.24 * max(len(names), 3))
        axes = canvas.subplots()
        for row, name in enumerate(names):
            for gap, right in outcomes.get(name, ()):
                marker, colour = ("|", MUTED) if right else ("x", VERMILLION)
                axes.plot(gap, row + 0.25, marker, color=colour, markersize=4)
            ends = np.clip(gaps[name].interval, *AXIS)
            axes.plot(ends, [row, row], color=BLUE, linewidth=1.8)
            if AXIS[0] < gaps[name].gap < AXIS[1]:
                axes.plot(gaps[name].gap, row, "o", color=BLUE, markersize=4)
        axes.set_xscale("log")
        axes.set(xlim=AXIS, xlabel="gap / noise", xticks=TICKS)
        plain_log_ticks(axes, "x")
        axes.set_yticks(range(len(names)), [drawable(name) for name in names])
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        marks = " Below it the cases: a stroke is named right, an orange cross is not." if outcomes else ""
        return finished(
            canvas,
            f"{what}: the gap named right with {format_percent(PROBABILITY)} probability and its 95 %"
            f" interval; a line without a dot ends beyond the gaps tried.{marks}",
            f"Smallest gaps of {len(names)} rows with intervals.",
        )


def _verdict(study: PowerStudy) -> str:
    level = format_percent(PROBABILITY)
    every = study.by_setting[study.reference]
    sentence = (
        f"An effect is named right with {level} probability from a gap of {_bound(every.gap)} times the noise"
        f" on (95 % interval {' to '.join(map(_bound, every.interval))}; {study.reference},"
        f" {every.trials} cases)."
    )
    shown = [name for name, gap in study.by_effect.items() if np.isfinite(gap.interval[1])]
    if not shown:
        return sentence + " For no effect alone did its cases suffice for an upper bound."
    hardest = max(shown, key=lambda name: study.by_effect[name].interval[1])
    return sentence + (
        f" Alone, {len(shown)} of {len(study.by_effect)} effects have an upper bound within the gaps tried,"
        f" the largest {hardest} with {study.by_effect[hardest].interval[1]:.2f}."
    )


def _table(gaps: Mapping[str, SmallestGap], first: str) -> Table:
    return Table(
        (first, "smallest gap / noise, 95 % interval", "cases"),
        tuple((name, gap_text(gap), str(gap.trials)) for name, gap in gaps.items()),
        "The smallest gap that is named right with the stated probability.",
        (2,),
    )


def _bound(gap: float) -> str:
    if gap == 0.0:
        return "below those tried"
    return f"{gap:.2f}" if np.isfinite(gap) else "beyond those tried"
