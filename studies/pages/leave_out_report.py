"""The report of the leave-one-out study: which effect is missing, and how far adding it shrinks the gap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from blind_check.leave_out import LeftOut
from matplotlib.lines import Line2D

from bayes_hw.gap.blind.counts import Share
from bayes_hw.gap.blind.score import GOALS
from bayes_hw.provenance import Provenance
from bayes_hw.report.blind.blind_report import share_state, share_text
from bayes_hw.report.page.document import Badge, Figure, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.drawing import drawable, drawing_settings, finished, new_canvas
from bayes_hw.report.page.palette import BLUE, MUTED, VERMILLION
from bayes_hw.report.page.rounding import format_percent

LOWEST = -0.5
BLOCK = "block right"
NOTICED = 0.9
"""Share of the answers that are to be `other` or confusable with what was struck."""


def leave_out_report(rows: Sequence[LeftOut], provenance: Provenance) -> Report:
    """The report whose first page shows the gap closed without and with each entry."""
    accepted = Share(sum(row.acceptable.hits for row in rows), sum(row.acceptable.trials for row in rows))
    block = Share(sum(row.block.hits for row in rows), sum(row.block.trials for row in rows))
    stated = float(np.average([row.block_stated for row in rows], weights=[r.block.trials for r in rows]))
    grows = sum(row.closed_with > row.closed_without for row in rows)
    return Report(
        title="Leave one effect out",
        subtitle=f"{len(rows)} entries of the catalogue struck in turn from data that carry them",
        verdict="With its entry struck, a missing effect is called other, or by a label stated to be"
        f" confusable with it, in {accepted.hits} of {accepted.trials} cases, and its block is right in"
        f" {block.hits}; putting the entry back closes more of the hold-out's gap for {grows} of"
        f" {len(rows)} effects.",
        badges=(
            Badge(
                "noticed",
                share_state(accepted, NOTICED),
                f"{accepted.hits} of {accepted.trials} answers without the entry",
            ),
            Badge(
                "block",
                share_state(block, GOALS[BLOCK]),
                f"right in {share_text(block)}, where {format_percent(stated)} was stated on average; goal"
                f" {format_percent(GOALS[BLOCK])}",
            ),
            Badge(
                "gap shrinks",
                "good" if grows == len(rows) else "warn",
                f"{grows} of {len(rows)} effects close more once they are added",
            ),
        ),
        key_figure=closures(rows),
        sections=(
            Section(
                "Every entry in turn",
                (
                    _table(rows),
                    _answers(rows),
                    Paragraph(
                        "Closed is the true fraction of the squared error of the hold-out that is removed, on"
                        " its noise-free angle. Stochastic effects and those that the angle does not show"
                        " (wind, drift, rounding, glitches, held samples) cannot be closed by a simulator."
                        " The free residual is a free force at the drive, over time, on the training"
                        " records: what enters the reading sample by sample (glitches, rounding, jitter)"
                        " is no force's doing."
                    ),
                ),
            ),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def closures(rows: Sequence[LeftOut]) -> Figure:
    """One row an entry: median closed fraction without it and with it."""
    with drawing_settings():
        canvas = new_canvas(0.9 + 0.22 * max(len(rows), 3))
        axes = canvas.subplots()
        for number, row in enumerate(rows):
            ends = np.clip([row.closed_without, row.closed_with], LOWEST, 1.0)
            axes.plot(ends, [number, number], color=MUTED, linewidth=1.0)
            for end, color in zip(ends, (VERMILLION, BLUE), strict=True):
                axes.plot(end, number, "<" if end == LOWEST else "o", color=color, markersize=4)
        axes.set_yticks(range(len(rows)), [drawable(row.label) for row in rows])
        axes.set(
            xlim=(LOWEST - 0.03, 1.03), xlabel="fraction of the reducible hold-out error removed (median)"
        )
        handles = [
            Line2D([], [], color=color, linestyle="none", marker="o", markersize=4, label=label)
            for color, label in ((VERMILLION, "entry struck from the catalogue"), (BLUE, "with its entry"))
        ]
        canvas.legend(handles=handles, loc="outside upper right", ncols=2)
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        return finished(
            canvas,
            "True closed fraction of the hold-out, median over the cases of each effect: orange with the "
            "entry struck from the catalogue, blue with it; an arrow where it is less than "
            f"{format_percent(LOWEST)}.",
            f"Closed fractions of {len(rows)} effects without and with their entry.",
        )


def _table(rows: Sequence[LeftOut]) -> Table:
    return Table(
        (
            "effect",
            "other",
            "other or confusable",
            "block right",
            "block stated",
            "missing response shown",
            "closed without",
            "closed with",
        ),
        tuple(
            (
                row.label,
                f"{row.other.hits} of {row.other.trials}",
                share_text(row.acceptable),
                f"{row.block.hits} of {row.block.trials}",
                format_percent(row.block_stated),
                _percent(row.shown),
                _percent(row.closed_without),
                _percent(row.closed_with),
            )
            for row in rows
        ),
        "Answers and blocks with the entry struck, and the mean probability stated for the block that is"
        " named; share of the missing response that the free residual then shows; closed fractions without"
        " and with it.",
        (4, 5, 6, 7),
    )


def _answers(rows: Sequence[LeftOut]) -> Table:
    return Table(
        ("effect", "named with its entry", "answers without it"),
        tuple(
            (
                row.label,
                share_text(row.named_with),
                ", ".join(f"{answer} {count}" for answer, count in row.answers),
            )
            for row in rows
        ),
        "What the missing effect was taken for.",
    )


def _percent(value: float) -> str:
    return format_percent(value) if np.isfinite(value) else "none"
