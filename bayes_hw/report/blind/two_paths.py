"""The same cases with their model and from the records alone, side by side."""

from __future__ import annotations

from bayes_hw.gap.blind.score import Score
from bayes_hw.report.blind.share_words import share_text
from bayes_hw.report.page.document import Paragraph, Section, Table
from bayes_hw.report.page.rounding import format_duration, format_number, format_percent


def two_paths_section(given: Score, alone: Score) -> Section:
    """Shares with 95 % intervals of both paths, and what the second states against what came true."""
    names = [name for name in given.headline if given.headline[name].trials or alone.headline[name].trials]
    rows = [(name, share_text(given.headline[name]), share_text(alone.headline[name])) for name in names]
    rows.append(("Brier score", format_number(given.brier), format_number(alone.brier)))
    rows.append(("cases", str(given.cases), str(alone.cases)))
    rows.append(
        (
            "time a case, median",
            format_duration(given.median_seconds),
            format_duration(alone.median_seconds),
        )
    )
    stated = tuple(
        (f"{format_percent(b.low)} to {format_percent(b.high)}", format_percent(b.mean), share_text(b.share))
        for b in alone.answer_reliability
        if b.share.trials
    )
    return Section(
        "With a model, and from the records alone",
        (
            Paragraph(
                "The second column is of the same cases with their model withheld. There more delay and a "
                "further mode are part of the G that is inferred, and count as no gap."
            ),
            Table(("figure", "model given", "records alone"), tuple(rows), "Shares and 95 % intervals."),
            Table(
                ("stated", "mean", "right"),
                stated,
                "From the records alone: how sure answers were, and how many were right.",
            ),
        ),
    )
