"""The report of a calibration from records alone: do the intervals hold when nothing is handed over?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from calibration_summary import CalibrationStudy
from rank_statistics import IntervalCoverage
from recovery import LEVELS
from recovery_summary import RecoverySummary

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import (
    Badge,
    Block,
    Bullets,
    KeyValues,
    Paragraph,
    Report,
    Section,
    State,
    Table,
)
from bayes_hw.report.page.rounding import format_interval, format_number, format_p_value, format_percent
from pages.calibration_report import calibration_report
from pages.figures_coverage import coverage_by_kind, widths_over_bound

HALF_WIDTH = "dead_zone.half_width"

TOLD_FROM = 0.85
"""Coverage of 94 % intervals that a study must be large enough to exclude before it says that they hold."""

WIDTH_AIM = 1.3
"""Median width over the Cramer-Rao bound that is still called efficient."""


@dataclass(frozen=True, eq=False)
class EndToEndStudy:
    """Replicates of axes drawn `wide`, of `effect_free` ones of another simulator, of drawn ones whose
    records begin `in_motion`, of the `twin`, and of the twin with its structure chosen through a linear model
    of order 8 at most, `capped`; `axes` are the wide replicates as plain data, `members` those of the twin,
    both ways in pairs, `most_steps` of the sampler, and `ranks` the sampler alone with the structure known.
    """

    wide: RecoverySummary
    effect_free: RecoverySummary
    in_motion: RecoverySummary
    twin: RecoverySummary
    capped: RecoverySummary
    axes: tuple[Mapping[str, Any], ...]
    members: tuple[tuple[Mapping[str, Any], Mapping[str, Any]], ...]
    most_steps: int
    ranks: CalibrationStudy

    @property
    def fault_found(self) -> bool:
        """Whether the check fails where it must."""
        return not self.capped.holds


def end_to_end_report(study: EndToEndStudy, provenance: Provenance) -> Report:
    """The report whose first page answers: do the intervals hold from the records alone?"""
    ranks = calibration_report(study.ranks, provenance)
    return Report(
        title="Intervals from records alone",
        subtitle="Identified and sampled from nothing but records; then the sampler alone",
        verdict=_verdict(study),
        badges=_badges(study),
        key_figure=coverage_by_kind(study.wide, f"{study.wide.axes} axes drawn wide"),
        sections=(
            _method_section(study),
            _coverage_section(study),
            _width_section(study),
            _where_section(study),
            _fault_section(study),
            Section("The sampler alone, structure known", (Paragraph(ranks.verdict), ranks.key_figure)),
            *(replace(part, title=f"Sampler alone: {part.title}") for part in ranks.sections[:-1]),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(study: EndToEndStudy) -> str:
    wide, free = study.wide, study.effect_free
    held = wide.all_parameters
    text = (
        f"From the records of {wide.axes} axes drawn wide, {held.inside} of {held.replicates} 94 % intervals"
        f" hold the truth ({_share(held)}; at best, with the same noise, {_share(wide.all_at_best[-1])})"
    )
    text += (
        ", and every kind of parameter stays in its band"
        + ("." if _tells(wide) else f", which so few axes leave wide: {_bounds(held)} is not excluded.")
        if wide.holds
        else f"; NOT calibrated: {_kinds(wide)} outside {'their' if len(wide.outside()) > 1 else 'its'} band."
    )
    text += (
        f" Intervals are {format_number(wide.median_width, 3)} times as wide as the Cramér-Rao bound allows"
        f" (median). {wide.converged} of {wide.axes} samplers converged; {wide.lacking} of {wide.modes} modes"
        f" were not found. Effect-free axes at 20 Hz: {_share(free.all_parameters)} hold,"
        f" {free.converged} of {free.axes} converged. Records begun in motion:"
        f" {_share(study.in_motion.all_parameters)} hold, {study.in_motion.converged} of"
        f" {study.in_motion.axes} converged."
    )
    capped, present = study.capped.all_parameters, study.twin.all_parameters
    both = (
        f"{capped.inside} of {capped.replicates} intervals of {study.capped.axes} twins hold, where"
        f" {present.inside} of {present.replicates} do with the defaults."
    )
    return text + (
        f" With the structure chosen through a linear model of order 8 at most, the same check fails as it"
        f" must: {both}"
        if study.fault_found
        else f" The check did NOT find the structure of a linear model: {both}"
    )


def _bounds(coverage: IntervalCoverage) -> str:
    low, high = coverage.interval
    return f"{100 * low:.0f} to {100 * high:.0f} %"


def _kinds(summary: RecoverySummary) -> str:
    return ", ".join(f"{kind} ({100 * level:.0f} %)" for kind, level in summary.outside())


def _badges(study: EndToEndStudy) -> tuple[Badge, ...]:
    wide, free = study.wide, study.effect_free
    return (
        Badge(
            _holding(wide),
            _state(wide.holds and _tells(wide), wide.holds),
            f"{format_p_value(wide.p_value)} for all kinds and levels together, {wide.axes} axes",
        ),
        Badge(
            "efficient" if wide.median_width <= WIDTH_AIM else "wide",
            "good" if wide.median_width <= WIDTH_AIM else "warn",
            f"median width {format_number(wide.median_width, 3)} of the Cramér-Rao bound",
        ),
        Badge(
            "samplers converged" if _all_converged(wide) else "some not converged",
            "good" if _all_converged(wide) else "warn",
            f"{wide.converged} of {wide.axes} within {study.most_steps} steps; all are counted",
        ),
        Badge(
            "20 Hz, effect-free",
            _state(free.holds and _tells(free) and _all_converged(free), free.holds),
            f"{_share(free.all_parameters)} hold, {free.converged} of {free.axes} converged",
        ),
        Badge(
            "fault found" if study.fault_found else "fault missed",
            "good" if study.fault_found else "bad",
            f"structure of a linear model, order 8 at most: {_share(study.capped.all_parameters)} hold",
        ),
    )


def _tells(summary: RecoverySummary) -> bool:
    """Whether so many axes would have told intervals that hold as rarely as TOLD_FROM."""
    return summary.all_parameters.interval[0] > TOLD_FROM


def _holding(summary: RecoverySummary) -> str:
    if not summary.holds:
        return "intervals do not hold"
    return "intervals hold" if _tells(summary) else "too few axes to tell"


def _all_converged(summary: RecoverySummary) -> bool:
    return summary.converged == summary.axes


def _state(good: bool, fair: bool) -> State:
    return "good" if good else "warn" if fair else "bad"


def _share(coverage: IntervalCoverage) -> str:
    return format_percent(coverage.achieved, 1)


def _method_section(study: EndToEndStudy) -> Section:
    wide = study.wide
    return Section(
        "What was done",
        (
            Paragraph(
                "An axis is drawn, its records are simulated, and they alone go to identify and sample with"
                " their defaults: order, delay, integrator, static blocks, noise and start are found anew"
                f" every time. The sampler stops at {study.most_steps} steps where it has not converged. Of"
                " the axes drawn wide a fifth are members of the rounding box of the printed transfer"
                " function under the twin's sweeps. The others have an integrator and up to eleven more"
                " poles: light modes beside their antiresonances, damped pairs, lags, now and then a fraction"
                " of a sample of delay. Rates are log-uniform from 10 to 500 Hz, delays reach one second or"
                " 6 % of a record, noise is white, autoregressive or of heavy tails (Student t with 3 to 8"
                " degrees of freedom), limits clip 0.2 to 30 % of the commands."
            ),
            Paragraph(
                "A mode of the axis is that of the fit whose frequency is nearest, within 15 %; one that the"
                " fit lacks has no interval: it is counted, not scored. The gain is the steady velocity a"
                " command, which does not depend on the order found. The 94 % interval is the reported"
                " highest-density one, the others are central. The bands treat the intervals of one axis as"
                " independent."
            ),
            KeyValues(
                (
                    ("axes drawn wide", str(wide.axes)),
                    ("processor time an axis", f"{format_number(wide.seconds, 2)} s"),
                    ("modes not found", f"{wide.lacking} of {wide.modes}"),
                    ("no posterior", str(wide.refused)),
                )
            ),
        ),
    )


def _sets(study: EndToEndStudy) -> dict[str, RecoverySummary]:
    return {
        "drawn wide": study.wide,
        "effect-free, 20 Hz": study.effect_free,
        "begun in motion": study.in_motion,
        "twin": study.twin,
    }


def _coverage_section(study: EndToEndStudy) -> Section:
    blocks: list[Block] = [_coverage_table(label, summary) for label, summary in _sets(study).items()]
    figure = coverage_by_kind(study.effect_free, f"{study.effect_free.axes} effect-free axes at 20 Hz")
    return Section(
        "Coverage",
        (
            Paragraph(
                "Effect-free axes are drive trains of masses and springs under two or three families of"
                " commands, simulated by code that shares nothing with the model. Axes begun in motion are"
                " drawn wide, each record without its first quarter: the state they begin in is estimated."
                " None is of the rounding box: what is left of its records never comes near the dead zone."
            ),
            Paragraph(
                "At best: intervals at the Cramér-Rao bound about the estimate that one finds from the same"
                " records who knows the true structure, the true noise and where to begin, linearised at the"
                " truth; where they miss, the noise is to blame."
            ),
            *blocks,
            figure,
        ),
    )


def _coverage_table(label: str, summary: RecoverySummary) -> Table:
    rows = tuple(
        (
            kind,
            str(entries[0].replicates),
            *(_with_interval(entry) for entry in entries),
            _shares(summary.at_best.get(kind, ())),
        )
        for kind, entries in summary.coverage.items()
    )
    every, best = summary.all_levels, _shares(summary.all_at_best)
    total = ("all", str(every[-1].replicates), *(_with_interval(entry) for entry in every), best)
    return Table(
        ("kind", "intervals", *(f"{100 * level:.0f} %" for level in LEVELS), "at best"),
        (*rows, total),
        f"{label}: {summary.axes} axes, {summary.converged} converged. Share of the intervals that hold the "
        "truth, in per cent, with 95 % binomial intervals; the same at best of the three levels (none is "
        f"made for the noise). Of {summary.missed} misses at 94 %, {summary.missed_alone} hold at best.",
        tuple(range(1, 3 + len(LEVELS))),
    )


def _shares(coverages: Sequence[IntervalCoverage]) -> str:
    return " / ".join(f"{100 * each.achieved:.1f}" for each in coverages)


def _with_interval(coverage: IntervalCoverage) -> str:
    low, high = coverage.interval
    return f"{100 * coverage.achieved:.1f} {format_interval(100 * low, 100 * high)}"


def _width_section(study: EndToEndStudy) -> Section:
    sets = {label: summary.widths for label, summary in _sets(study).items()}
    return Section(
        "Efficiency",
        (
            widths_over_bound({label: sets[label] for label in ("drawn wide", "twin")}, WIDTH_AIM),
            Table(
                ("axes", "kind", "intervals", "median", "90 %"),
                tuple(
                    (
                        label,
                        kind,
                        str(len(widths)),
                        format_number(float(np.median(widths)), 3),
                        format_number(float(np.quantile(widths, 0.9)), 3),
                    )
                    for label, kinds in sets.items()
                    for kind, widths in kinds.items()
                ),
                "94 % intervals over those at the Cramér-Rao bound with the true structure known: median and "
                "90 % quantile.",
                (2, 3, 4),
            ),
        ),
    )


GROUPS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "source": lambda facts: str(facts["source"]),
    "commands": lambda facts: str(facts["commands"]),
    "noise": lambda facts: "heavy tails" if "Student" in facts["noise"] else str(facts["noise"]),
    "rate": lambda facts: "below 50 Hz" if facts["rate_hz"] < 50 else "50 Hz and more",
    "order": lambda facts: "3 to 7" if facts["true_order"] < 8 else "8 to 12",
    "delay": lambda facts: "below 0.1 s" if facts["true_delay_s"] < 0.1 else "0.1 s and more",
}


def _where_section(study: EndToEndStudy) -> Section:
    rows: list[tuple[str, ...]] = []
    for group, label_of in GROUPS.items():
        labels = sorted({label_of(each["facts"]) for each in study.axes})
        rows += [
            _group_row(group, label, [e for e in study.axes if label_of(e["facts"]) == label])
            for label in labels
        ]
    return Section(
        "Where it holds and where not",
        (
            Table(
                ("by", "axes with", "axes", "converged", "94 % intervals that hold"),
                tuple(rows),
                "The axes drawn wide, in groups; shares with 95 % binomial intervals.",
                (2, 3, 4),
            ),
            Bullets(
                (
                    "Axes that the model does not describe are not drawn here.",
                    "Records start at rest.",
                    "A mode that the records do not show is not missed by an interval: see how many were"
                    " not found.",
                )
            ),
        ),
    )


def _group_row(group: str, label: str, axes: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    held = [bool(h[-1]) for each in axes for h in each.get("inside", {}).values()]
    share = _with_interval(IntervalCoverage(LEVELS[-1], sum(held), len(held))) if held else ""
    converged = sum(bool(each.get("converged")) for each in axes)
    return group, label, str(len(axes)), str(converged), share


def _fault_section(study: EndToEndStudy) -> Section:
    return Section(
        "A check that can fail",
        (
            Paragraph(
                "The twin's order is nine. With order, delay and integrator chosen through a linear model of"
                " at most eight poles, and the blocks fitted to that, the dead zone and the limits take up"
                " what G lacks, though all of it is sampled free. The same records of"
                f" {study.capped.axes} members of the rounding box, identified both ways."
            ),
            _by_kind(study),
            _by_member(study.members),
            coverage_by_kind(study.capped, "structure of a linear model"),
            coverage_by_kind(study.twin, "the same records with the defaults"),
        ),
    )


def _by_kind(study: EndToEndStudy) -> Table:
    """94 % intervals that hold, of every kind, both ways."""
    kinds = list(dict.fromkeys([*study.twin.coverage, *study.capped.coverage]))
    sides = (study.twin, study.capped)
    rows = [
        (kind, *(_with_interval(s.coverage[kind][-1]) if kind in s.coverage else "" for s in sides))
        for kind in kinds
    ]
    rows.append(("all", *(_with_interval(s.all_parameters) for s in sides)))
    rows.append(("p-value", *(format_p_value(s.p_value) for s in sides)))
    rows.append(("median width", *(format_number(s.median_width, 3) for s in sides)))
    return Table(
        ("kind", "defaults", "structure of a linear model"),
        tuple(rows),
        "94 % intervals that hold the truth, in per cent, with 95 % binomial intervals; the p-value of all"
        " kinds and levels together; widths over the Cramér-Rao bound.",
        (1, 2),
    )


def _by_member(members: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Table:
    """Order, intervals that hold and half width of every member, both ways."""
    rows = []
    for number, both in enumerate(members):
        truth = next(
            (each["estimate"][HALF_WIDTH][0] for each in both if HALF_WIDTH in each.get("estimate", {})), None
        )
        rows.append(
            (
                str(number),
                "" if truth is None else format_number(truth, 3),
                *(text for each in both for text in _one_way(each)),
            )
        )
    return Table(
        ("twin", "true half width", *("order", "held", "half width") * 2),
        tuple(rows),
        "Every twin with the defaults (left) and with the structure of a linear model (right): order found,"
        " 94 % intervals that hold, and the half width's posterior mean and standard deviation (deg).",
        tuple(range(1, 8)),
    )


def _one_way(replicate: Mapping[str, Any]) -> tuple[str, str, str]:
    if "refused" in replicate:
        return "", "refused", ""
    held = [bool(inside[-1]) for inside in replicate["inside"].values()]
    _, mean, sd = replicate["estimate"].get(HALF_WIDTH, (0.0, np.nan, np.nan))
    half_width = f"{format_number(mean, 3)} ± {format_number(sd, 2)}" if np.isfinite(mean) else ""
    return str(replicate["order"]), f"{sum(held)} of {len(held)}", half_width
