"""How often the intervals held where an analysis was repeated with fresh noise: first page and section."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from rank_statistics import IntervalCoverage

from bayes_hw.report.page.document import Badge, Paragraph, Report, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_interval, format_number, format_percent

MOST_BADGES = 4
LEAST_SHARE = 0.91
"""Of all 94 % intervals together, below which the page says that they do not hold."""


@dataclass(frozen=True, eq=False)
class Repeats:
    """`repeats` of an analysis from fresh records alone, `converged` of them; how often the 94 % interval of
    every parameter held its true value, and its median width over the Cramer-Rao bound where there is one.
    """

    repeats: int
    converged: int
    held: Mapping[str, IntervalCoverage]
    median_width: Mapping[str, float]

    @property
    def all_parameters(self) -> IntervalCoverage:
        """Every interval of every repeat together."""
        entries = list(self.held.values())
        nominal = entries[0].nominal
        return IntervalCoverage(nominal, sum(e.inside for e in entries), sum(e.replicates for e in entries))


def with_repeats(report: Report, repeats: Repeats) -> Report:
    """`report`, its first page saying how often the intervals held, with a section before the last one."""
    held = repeats.all_parameters
    worst = min(repeats.held, key=lambda name: repeats.held[name].achieved)
    least = repeats.held[worst]
    sentence = (
        f" With {repeats.repeats} other seeds of the noise, from records alone, {held.inside} of"
        f" {held.replicates} 94 % intervals held the truth ({_percent(held)}, least often {_words(worst)}"
        f" with {least.inside} of {least.replicates}); {repeats.converged} of {repeats.repeats} samplers"
        " converged."
    )
    badge = Badge(
        f"intervals over {repeats.repeats} seeds",
        "good" if held.achieved >= LEAST_SHARE else "bad",
        f"{held.inside} of {held.replicates} hold, {_percent(held)}",
    )
    *before, last = report.sections
    return replace(
        report,
        verdict=report.verdict + sentence,
        badges=_beside(report.badges, badge),
        sections=(*before, _section(repeats), last),
    )


def _beside(badges: tuple[Badge, ...], last: Badge) -> tuple[Badge, ...]:
    """At most four, of which `last` is one: what is good and said last makes room first."""
    kept = list(badges)
    while len(kept) >= MOST_BADGES:
        good = [place for place, badge in enumerate(kept) if badge.state == "good"]
        del kept[good[-1] if good else -1]
    return (*kept, last)


def _section(repeats: Repeats) -> Section:
    rows = [
        (_words(name), *_cells(entry), _width(repeats.median_width.get(name)))
        for name, entry in repeats.held.items()
    ]
    return Section(
        "How often the intervals hold",
        (
            Paragraph(
                "The same commands, fresh noise every time; order, delay, blocks and noise are found anew"
                " from the records, then everything is sampled."
            ),
            Table(
                ("parameter", "held", "of", "share (%)", "95 % interval", "width over bound"),
                (*rows, ("all", *_cells(repeats.all_parameters), "")),
                f"94 % intervals over {repeats.repeats} seeds, with Clopper and Pearson's intervals of the "
                "shares; last, the median width over that at the Cramér-Rao bound with the true structure "
                "known. A mode that the fit lacks has no interval.",
                (1, 2, 3, 4, 5),
            ),
        ),
    )


def _cells(entry: IntervalCoverage) -> tuple[str, str, str, str]:
    low, high = entry.interval
    return (
        str(entry.inside),
        str(entry.replicates),
        f"{100 * entry.achieved:.1f}",
        format_interval(100 * low, 100 * high),
    )


def _width(value: float | None) -> str:
    return "" if value is None else format_number(value, 3)


def _percent(entry: IntervalCoverage) -> str:
    return format_percent(entry.achieved, 1)


def _words(name: str) -> str:
    return parameter_name(name).words
