"""Numbers of a diagnosis around a model: errors before and after, parameters of effects and of the base."""

from __future__ import annotations

from collections.abc import Mapping

from bayes_hw.gap.answer.base_average import BaseShift, base_shifts
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate, Verdict
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.report.page.document import Block, Paragraph, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import (
    format_estimate,
    format_interval,
    format_number,
    format_percent,
    format_value,
)

OTHER = ("other",)
NEVER_ALL = 0.999


def numbers_section(diagnosis: Diagnosis) -> Section:
    """Parameters of the effects, and of the base model before and after."""
    verdict = diagnosis.verdict
    blocks: list[Block] = []
    if verdict.parameters:
        blocks.append(parameter_table(verdict))
    elif verdict.answer == OTHER:
        blocks.append(Paragraph("No effect of the catalogue was added, so there are no parameters of one."))
    blocks.append(_base_table(diagnosis))
    return Section("How sure are the numbers?", tuple(blocks))


def closure_table(diagnosis: Diagnosis) -> Table:
    """Errors before and after on both kinds of record."""
    verdict, unit = diagnosis.verdict, diagnosis.case.model.units.output
    return Table(
        ("records", "rmse before", "rmse after", "noise floor", "closed", "94 % interval"),
        (
            _closure_row("training", verdict.gap_train, unit),
            _closure_row("held out", verdict.gap_holdout, unit),
        ),
        "Root mean square errors, and the share of the avoidable squared error (beyond the noise) that "
        "the answer's effects remove. The interval counts the uncertainty of the parameters and the "
        "finite length of the records.",
        (1, 2, 3, 4, 5),
    )


def share_interval(low: float, high: float) -> str:
    """Ends of the interval of a closed share."""
    return " to ".join(format_percent(min(end, NEVER_ALL), 1) for end in (low, high))


def parameter_table(verdict: Verdict) -> Table:
    """Parameters of the answer's effects."""
    return Table(
        ("parameter of the effect", "posterior mean ± sd", "94 % HDI"),
        estimate_rows(verdict.parameters),
        "Parameters of the answer's effects. HDI: highest-density interval.",
        (1, 2),
    )


def estimate_rows(estimates: Mapping[str, Estimate]) -> tuple[tuple[str, str, str], ...]:
    """Name, mean and standard deviation, interval: rounded by what they are known to."""
    return tuple(
        (name, format_estimate(e.mean, e.sd, e.unit), format_interval(*e.hdi94, e.unit))
        for name, e in estimates.items()
    )


def _closure_row(name: str, gap: Closure, unit: str) -> tuple[str, ...]:
    low, high = gap.closed_hdi94
    return (
        name,
        format_number(gap.rmse_before, 3, unit),
        format_number(gap.rmse_after, 3, unit),
        format_number(gap.noise_floor, 3, unit),
        format_percent(gap.closed),
        share_interval(low, high),
    )


def _base_table(diagnosis: Diagnosis) -> Table:
    added = bool(diagnosis.verdict.answer) and diagnosis.verdict.answer != OTHER
    pushed = (
        " Pushed: fitted alone less estimated with the effects, in standard deviations of the latter: what "
        "the missing effect had done to the parameter."
        if added
        else ""
    )
    if diagnosis.verdict.answer == OTHER:
        way = "about the best explanation that failed, as far off as those lie apart: no model here holds"
    else:
        way = f"{'jointly with the effects of the answer' if added else 'without effects'}, averaged over "
        way += "other explanations by their probability (where an unlikely one puts a number far off, its sd "
        way += "is wider than its interval)"
    header = ("base parameter", "as given", "fitted alone", "estimated", "94 % HDI")
    shifts = base_shifts(diagnosis.attribution.base, diagnosis.case.model.noise_sigma, diagnosis.verdict.base)
    return Table(
        (*header, "pushed (sd)") if added else header,
        tuple(_base_row(shift, added) for shift in shifts),
        "Parameters of the base model: as given in the model file, fitted to the training records without "
        f"any effect, and estimated {way}.{pushed}",
        (1, 2, 3, 4, 5) if added else (1, 2, 3, 4),
    )


def _base_row(shift: BaseShift, added: bool) -> tuple[str, ...]:
    joint = shift.joint
    row = (
        parameter_name(shift.name).words,
        format_value(shift.nominal, joint.sd),
        format_value(shift.alone, joint.sd),
        format_estimate(joint.mean, joint.sd, joint.unit),
        format_interval(*joint.hdi94),
    )
    return (*row, format_number(shift.pushed, 2)) if added else row
