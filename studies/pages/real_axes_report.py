"""The report on diagnoses of measured axes: a section an axis, with what others have published beside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.answer.sentence import sentence
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.provenance import Provenance
from bayes_hw.report.diagnosis.diagnosis_numbers import closure_table, parameter_table
from bayes_hw.report.diagnosis.diagnosis_sections import NO_NUMBER, ranking_table
from bayes_hw.report.diagnosis.figures_diagnosis import gap_on_record, label_probabilities
from bayes_hw.report.page.document import Badge, Block, Figure, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.rounding import format_number, format_percent
from bayes_hw.report.page.typography import typeset


@dataclass(frozen=True)
class Compared:
    """A figure of this study beside the published one (text with its unit); NaN where the answer has none."""

    quantity: str
    unit: str
    here: float
    published: str


@dataclass(frozen=True)
class RealAxis:
    """One measured axis: its diagnosis, what is known to be missing, a remark, figures beside published."""

    name: str
    diagnosis: Diagnosis
    expected: str
    remark: str
    compared: tuple[Compared, ...]


@dataclass(frozen=True)
class Parted:
    """A diagnosis of the same records parted otherwise: what was named, how sure, errors held out."""

    name: str
    named: str
    probability: float
    rmse_before: float
    rmse_after: float
    unit: str


def real_axes_report(axes: Sequence[RealAxis], parted: Sequence[Parted], origin: Provenance) -> Report:
    """The report whose first page says what was named on every axis."""
    return Report(
        title="Three measured axes, three simulators",
        subtitle="Simulators of any kind diagnosed on measured records, the cause not told",
        verdict=" ".join(f"{axis.name}: {_answer(axis)}." for axis in axes),
        badges=tuple(_badge(axis) for axis in axes),
        key_figure=_gap(axes[0]),
        sections=(
            Section("In numbers", (_overview(axes),)),
            *(_section(axis, number > 0) for number, axis in enumerate(axes)),
            *([_parted_section(parted)] if parted else []),
            Section("Provenance", (KeyValues(origin.rows()),)),
        ),
    )


def _parted_section(parted: Sequence[Parted]) -> Section:
    table = Table(
        ("record and part", "named", "probability", "rmse before", "rmse after"),
        tuple(
            (
                row.name,
                row.named,
                format_percent(row.probability),
                format_number(row.rmse_before, 3, row.unit),
                format_number(row.rmse_after, 3, row.unit),
            )
            for row in parted
        ),
        "What is named where other parts of the records are held out. From the backward half of the DC "
        "motor's staircase alone an edge forwards cannot be known, and nothing is gained there.",
        (2, 3, 4),
    )
    return Section("The same records parted otherwise", (table,))


def _answer(axis: RealAxis) -> str:
    verdict = axis.diagnosis.verdict
    named = " and ".join(verdict.answer) or "no structural gap"
    return f"{named}, {format_percent(verdict.gap_holdout.closed)} of the avoidable error held out closed"


def _badge(axis: RealAxis) -> Badge:
    verdict = axis.diagnosis.verdict
    named = " and ".join(verdict.answer) or "no structural gap"
    state = "bad" if verdict.answer in ((), ("other",)) else "good" if verdict.certainty > 0.9 else "warn"
    return Badge(named, state, f"{axis.name}: {format_percent(verdict.certainty, 1)} sure")  # type: ignore[arg-type]


def _overview(axes: Sequence[RealAxis]) -> Table:
    rows = []
    for axis in axes:
        verdict, unit = axis.diagnosis.verdict, axis.diagnosis.case.model.units.output
        gap = verdict.gap_holdout
        rows.append(
            (
                axis.name,
                axis.expected,
                axis.diagnosis.decision.explanation.name if verdict.answer != ("other",) else "other",
                format_number(gap.rmse_before, 3, unit),
                format_number(gap.rmse_after, 3, unit),
                format_percent(gap.closed),
            )
        )
    return Table(
        ("axis and simulator", "known to be missing", "named", "rmse before", "rmse after", "closed"),
        tuple(rows),
        "What the diagnosis named, with the root mean square error on the part held out before and after.",
        (3, 4, 5),
    )


def _gap(axis: RealAxis) -> Figure:
    found = axis.diagnosis
    return gap_on_record(
        found.case.holdout[0],
        found.before,
        found.after,
        found.low,
        found.high,
        found.verdict.gap_holdout.noise_floor,
    )


def _section(axis: RealAxis, with_gap: bool) -> Section:
    verdict = axis.diagnosis.verdict
    blocks: list[Block] = [
        Paragraph(typeset(sentence(axis.diagnosis))),
        Paragraph(axis.remark),
        *([_gap(axis)] if with_gap else []),
        Table(
            ("quantity", "here", "published, or measured otherwise"),
            tuple(
                (
                    row.quantity,
                    format_number(row.here, 3, row.unit) if np.isfinite(row.here) else NO_NUMBER,
                    row.published,
                )
                for row in axis.compared
            ),
            "Figures of this diagnosis beside those of others.",
            (1,),
        ),
        closure_table(axis.diagnosis),
        *([parameter_table(verdict)] if verdict.parameters else []),
        label_probabilities(verdict.probability, verdict.answer),
        ranking_table(axis.diagnosis),
    ]
    return Section(axis.name, tuple(blocks))
