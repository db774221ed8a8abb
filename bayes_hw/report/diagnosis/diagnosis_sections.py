"""Sections of a diagnosis: where the gap lies, which effect it is, how far it shrinks."""

from __future__ import annotations

import inspect
from collections.abc import Mapping

import numpy as np

from bayes_hw.gap.answer.base_shift import BaseShift, base_shifts
from bayes_hw.gap.answer.locate import EVERYWHERE
from bayes_hw.gap.answer.ranking import Ranked, ranking
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate, Verdict
from bayes_hw.gap.criticism.latent_force import latent_force
from bayes_hw.gap.criticism.residual_map import noise_power, residual_map
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.noise.spectra import mean_spectrum
from bayes_hw.report.diagnosis.figures_diagnosis import (
    block_shares,
    error_before_and_after,
    gap_on_record,
    label_probabilities,
    regimes_and_coherences,
    residual_spectrum,
    time_frequency,
    time_segments,
)
from bayes_hw.report.diagnosis.figures_latent_force import latent_force_figure
from bayes_hw.report.page.document import Block, Bullets, Callout, Paragraph, Section, Table, ZoomableRecord
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import (
    format_estimate,
    format_interval,
    format_number,
    format_percent,
    format_value,
)
from bayes_hw.report.page.typography import MINUS, typeset

OTHER = ("other",)
ZOOM_SHARE = 0.1
RANKED_SHOWN = 24
NO_NUMBER = "—"

BLOCK_MEANINGS = {
    "input": "the command side: what happens between the command and the limited velocity",
    "linear": "the linear dynamics G",
    "drive": "the drive train: friction, play, ripple",
    "disturbance": "a disturbance from outside that no record shows",
    "sensor": "the output: encoder and output map",
    "none": "no block",
}


def where_section(diagnosis: Diagnosis) -> Section:
    """By block, by band, in time and frequency, by regime, in time."""
    where, explanation = diagnosis.verdict.where, diagnosis.decision.explanation
    base = diagnosis.attribution.base.fit
    rate = base.hypothesis.scale.rate
    before = mean_spectrum(base.residuals, rate)
    changed = explanation is not diagnosis.attribution.base
    name = explanation.name
    if diagnosis.verdict.answer == OTHER:
        name += " (the best of the catalogue, which is not the answer)"
    loudest = int(np.argmax([np.mean(e**2) for e in base.residuals]))
    low, high = where.band_hz
    blocks: list[Block] = [
        Paragraph(
            f"Block: {where.block}, {BLOCK_MEANINGS.get(where.block, 'registered by another package')}. "
            f"Most of the excess lies between {format_number(low)} and {format_number(high, unit='Hz')}; "
            f"{_loudest_regime(where.regime)}. All of this is of the re-estimated model's "
            "residuals on the training records."
        ),
        block_shares(where.share, where.block),
        residual_spectrum(
            before,
            mean_spectrum(explanation.fit.residuals, rate) if changed else None,
            noise_power(explanation, before.frequencies),
            where.band_hz,
            diagnosis.case.model.units.output,
            name,
        ),
    ]
    if explanation.followed is not None:
        blocks.append(
            Callout(
                "info",
                "After, each sample is predicted from those before it",
                "The motion cannot be predicted for long, so that the explanation is judged by a simulation "
                "that the measured output corrects at every sample. What it predicts without is in figure 1.",
            )
        )
    if explanation.cause_of_noise is not None:
        blocks.append(
            Callout(
                "info",
                "Before and after look alike",
                f"Stochastic ({' and '.join(explanation.cause_of_noise.labels)}): what is expected of the "
                "residuals changes, the residuals themselves stay.",
            )
        )
    blocks += [
        time_frequency(
            residual_map(base.residuals[loudest], explanation), diagnosis.case.train[loudest].name
        ),
        regimes_and_coherences(where.regimes, where.coherences, where.regime),
        time_segments(where.segments),
        Paragraph(_of_change_points(diagnosis)),
        latent_force_figure(
            latent_force(base, loudest, explanation.encoder_noise),
            diagnosis.case.train[loudest].name,
            (diagnosis.case.model.units.output, diagnosis.case.model.units.time),
        ),
    ]
    return Section("Where", tuple(blocks))


def _loudest_regime(regime: str) -> str:
    if regime == EVERYWHERE:
        return "in no regime is the residual larger than in all samples together"
    return f"the residual is largest in the regime “{regime}”"


def _of_change_points(diagnosis: Diagnosis) -> str:
    """When the size of the base model's error changes for good."""
    points, unit = diagnosis.verdict.where.change_points, diagnosis.case.model.units.time
    if not points:
        return "The size of the error has no change point within any training record."
    found = ", ".join(
        f"{diagnosis.case.train[p.record].name} at {format_number(p.time_s, unit=unit)} "
        f"(then {format_number(p.ratio)} times as large)"
        for p in points
    )
    return f"Change points of the size of the error: {found}. Where a sweep passes a mode there are such too."


def which_section(diagnosis: Diagnosis) -> Section:
    """Probabilities, ranking, what cannot be told apart, the next experiment, what is left."""
    verdict = diagnosis.verdict
    blocks: list[Block] = [
        label_probabilities(verdict.probability, verdict.answer),
        ranking_table(diagnosis),
    ]
    if verdict.confusable:
        pairs = tuple(f"{one} and {other}" for one, other in verdict.confusable)
        blocks += [Paragraph("These records cannot tell apart:"), Bullets(pairs)]
    elif len(verdict.answer) > 1:
        blocks.append(Paragraph("Rivals of a pair were not sought; the ranking shows what comes near."))
    elif verdict.answer and verdict.answer != OTHER:
        blocks.append(Paragraph("No other single effect comes near the evidence of the answer."))
    if verdict.next_experiment:
        blocks.append(Callout("info", "Next experiment", verdict.next_experiment))
    blocks.append(
        Table(
            ("what is left", "surprise (nats)", "size / noise"),
            tuple(
                (left.kind, f"{left.surprise:.2f}", f"{left.size:.2f}")
                for left in diagnosis.decision.leftovers
            ),
            f"What stays in the residuals beside {diagnosis.decision.explanation.name}: descriptions that "
            "name no cause, each with minus the logarithm of the probability of as much by chance, and its "
            "size in units of the noise. A surprising one of some size makes the verdict “other”; so does an "
            "effect in a block where functions that name no cause find next to nothing.",
            (1, 2),
        )
    )
    described = [
        Callout(
            "info",
            f"What {effect.name} means here",
            typeset(_one_paragraph(inspect.getdoc(type(effect)) or "")),
        )
        for effect in diagnosis.decision.explanation.fit.hypothesis.effects
        if effect.label in verdict.answer
    ]
    return Section("Which effect", (*blocks, *described))


def _one_paragraph(docstring: str) -> str:
    return " ".join(docstring.replace("`", "").split())


def ranking_table(diagnosis: Diagnosis) -> Table:
    unit = diagnosis.case.model.units.output
    floor = diagnosis.verdict.gap_train.noise_floor
    ranked = ranking(diagnosis.attribution, floor, diagnosis.left_out)
    return Table(
        ("effect", "gain in log-evidence", "left-out blocks", "weight", f"rmse left ({unit})", "would close"),
        tuple(_ranked_row(row, diagnosis.decision.explanation.labels) for row in ranked[:RANKED_SHOWN]),
        "Ranking of what was tried, the best form of every effect and pair, on the training records. The "
        f"gain is over the re-estimated model with coloured noise; {NO_NUMBER} in its column: fitted on "
        "plain residuals only, and not among the best. “Left-out blocks”, of the first few that have "
        "one: log predictive density of every twelfth of a record given the rest, less that of the best, ± "
        "its standard error; “weight”: in the mixture of predictions that is best at it (stacking). "
        "“Would close”: share of the avoidable squared error that it removes; a stochastic effect alone "
        f"leaves it ({NO_NUMBER}). ▸ the explanation chosen. The "
        "probabilities above are less sure than these evidences alone would make them; how far they can be "
        "relied on is what a blind check measures.",
        (1, 2, 3, 4, 5),
    )


def _ranked_row(row: Ranked, chosen: tuple[str, ...]) -> tuple[str, ...]:
    mark = "▸ " if row.labels == chosen else ""
    gain = NO_NUMBER if row.gain is None else f"{row.gain:.1f}".replace("-", MINUS)
    if row.closes is None:
        closes = NO_NUMBER
    else:
        closes = format_percent(row.closes) if row.closes >= -1 else f"< {MINUS}100 %"
    if row.left_out is None:
        density = weight = NO_NUMBER
    else:
        behind = f"{row.left_out.density:.1f} ± {row.left_out.error:.1f}".replace("-", MINUS)
        density = behind if row.left_out.density < 0 else "best"
        weight = f"{row.left_out.weight:.2f}"
    return (mark + row.name, gain, density, weight, format_number(row.rmse), closes)


def how_far_section(diagnosis: Diagnosis) -> Section:
    """Errors before and after, the hold-out record to zoom, parameters of effects and base."""
    verdict = diagnosis.verdict
    unit = diagnosis.case.model.units.output
    blocks: list[Block] = [
        error_before_and_after(verdict.gap_train, verdict.gap_holdout, unit),
        closure_table(diagnosis),
    ]
    blocks += _unclosed(diagnosis)
    blocks.append(_zoomable(diagnosis))
    if verdict.parameters:
        blocks.append(parameter_table(verdict))
    elif verdict.answer == OTHER:
        blocks.append(Paragraph("No effect of the catalogue was added, so there are no parameters of one."))
    blocks.append(_base_table(diagnosis))
    return Section("How far it shrinks", tuple(blocks))


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


def _unclosed(diagnosis: Diagnosis) -> list[Block]:
    """Why nothing, or not all, is closed, where that is so by nature."""
    verdict, explanation = diagnosis.verdict, diagnosis.decision.explanation
    if not verdict.answer:
        return [Paragraph("Nothing was added to the model: before and after are the same.")]
    if verdict.answer == OTHER:
        return [
            Callout(
                "warn",
                "Nothing was added",
                "No entry of the catalogue explains the gap, so before and after are the same model.",
            )
        ]
    if explanation.cause_of_noise is None:
        return []
    gain = explanation.log_evidence - diagnosis.attribution.base.log_evidence
    return [
        Callout(
            "info",
            "No simulator can track a stochastic effect",
            f"What is random ({' and '.join(explanation.cause_of_noise.labels)}) is not known beforehand on "
            "another record. What is gained is a better description of the error, and with it of the band: "
            f"log-evidence {format_number(gain)} over the re-estimated model with coloured noise.",
        )
    ]


def _closure_row(name: str, gap: Closure, unit: str) -> tuple[str, ...]:
    low, high = gap.closed_hdi94
    return (
        name,
        format_number(gap.rmse_before, 3, unit),
        format_number(gap.rmse_after, 3, unit),
        format_number(gap.noise_floor, 3, unit),
        format_percent(gap.closed),
        f"{format_percent(low)} to {format_percent(high)}",
    )


def _zoomable(diagnosis: Diagnosis) -> ZoomableRecord:
    record = diagnosis.case.holdout[0]
    return ZoomableRecord(
        record.t - record.t[0],
        record.y,
        diagnosis.after,
        diagnosis.low,
        diagnosis.high,
        record.units.time,
        record.units.output,
        "94 % band of y",
        gap_on_record(
            record,
            diagnosis.before,
            diagnosis.after,
            diagnosis.low,
            diagnosis.high,
            diagnosis.verdict.gap_holdout.noise_floor,
            _widest_gap(diagnosis),
        ),
        record.name,
    )


def _widest_gap(diagnosis: Diagnosis) -> tuple[float, float]:
    """The stretch, in s from the first sample, about the largest error before."""
    record = diagnosis.case.holdout[0]
    t = record.t - record.t[0]
    length = ZOOM_SHARE * t[-1]
    middle = t[int(np.argmax(np.abs(record.y - diagnosis.before)))]
    start = float(np.clip(middle - length / 2, 0.0, t[-1] - length))
    return start, start + float(length)


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
        way += "other explanations by their probability"
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
