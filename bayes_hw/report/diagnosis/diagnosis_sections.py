"""Sections of a diagnosis around a model, in the order in which an engineer doubts."""

from __future__ import annotations

import inspect
import math

import numpy as np

from bayes_hw.gap.answer.locate import EVERYWHERE
from bayes_hw.gap.answer.ranking import Ranked, ranking
from bayes_hw.gap.criticism.latent_force import latent_force
from bayes_hw.gap.criticism.residual_map import noise_power, residual_map
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.effects.descriptions import DESCRIPTIONS
from bayes_hw.gap.effects.words import label_words
from bayes_hw.gap.noise.spectra import mean_spectrum
from bayes_hw.report.diagnosis.diagnosis_numbers import OTHER, closure_table
from bayes_hw.report.diagnosis.figures_diagnosis import (
    block_shares,
    gap_on_record,
    label_probabilities,
    latent_force_figure,
    regimes_and_coherences,
    residual_spectrum,
    time_frequency,
    time_segments,
)
from bayes_hw.report.page.document import Block, Bullets, Callout, Paragraph, Section, Table, ZoomableRecord
from bayes_hw.report.page.rounding import (
    format_number,
    format_p_value,
    format_percent,
)
from bayes_hw.report.page.typography import MINUS, typeset

ZOOM_SHARE = 0.1
"""No closed share is said to be larger."""

RANKED_SHOWN = 24
NO_NUMBER = "—"

BLOCK_MEANINGS = {
    "input": "on the command side, between the command and the limited velocity",
    "linear": "in the linear dynamics G",
    "drive": "in the drive train: friction, play, ripple",
    "disturbance": "from outside, by a disturbance that no record shows",
    "sensor": "at the output: encoder and output map",
    "none": "nowhere",
}


def where_section(diagnosis: Diagnosis) -> Section:
    """By place in the axis, by frequency, by regime."""
    where, explanation = diagnosis.verdict.where, diagnosis.decision.explanation
    base = diagnosis.attribution.base.fit
    rate = base.hypothesis.scale.rate
    before = mean_spectrum(base.residuals, rate)
    changed = explanation is not diagnosis.attribution.base
    name = explanation.name
    if diagnosis.verdict.answer == OTHER:
        name += " (the best of the catalogue, which is not the answer)"
    low, high = where.band_hz
    blocks: list[Block] = [
        Paragraph(
            f"It enters {BLOCK_MEANINGS.get(where.block, 'at a place registered by another package')}. "
            f"Most of the error lies between {format_number(low)} and {format_number(high, unit='Hz')}; "
            f"{_loudest_regime(where.regime)}. All of this is of what the model, its numbers estimated "
            "again, leaves of the training records."
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
        regimes_and_coherences(where.regimes, where.coherences, where.regime),
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
                f"Random ({' and '.join(map(label_words, explanation.cause_of_noise.labels))}): what is "
                "expected of the errors changes, the errors themselves stay.",
            )
        )
    return Section("Where does it show?", tuple(blocks))


def when_section(diagnosis: Diagnosis) -> Section:
    """In time and frequency, over the records, and the force that would make up for it."""
    where, explanation = diagnosis.verdict.where, diagnosis.decision.explanation
    base = diagnosis.attribution.base.fit
    loudest = int(np.argmax([np.mean(e**2) for e in base.residuals]))
    name, units = diagnosis.case.train[loudest].name, diagnosis.case.model.units
    blocks: list[Block] = [
        time_frequency(residual_map(base.residuals[loudest], explanation), name),
        time_segments(where.segments),
        Paragraph(_of_change_points(diagnosis)),
        latent_force_figure(
            latent_force(base, loudest, explanation.encoder_noise), name, (units.output, units.time)
        ),
    ]
    return Section("When does it show?", tuple(blocks), folded=True)


def _loudest_regime(regime: str) -> str:
    if regime == EVERYWHERE:
        return "it is no larger in any state of motion than in all samples together"
    return f"it is largest in the samples “{regime}”"


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


def advice_section(diagnosis: Diagnosis) -> Section:
    """What each effect of the answer is, what it would look like, what to do about it, and the experiment
    that confirms."""
    verdict = diagnosis.verdict
    effects = diagnosis.decision.explanation.fit.hypothesis.effects
    registered = {effect.label: effect.description for effect in effects}
    blocks: list[Block] = []
    for label in verdict.answer:
        described = DESCRIPTIONS.get(label) or registered.get(label)
        if described is not None:
            said = (f"What it looks like: {described.looks}", f"What to do: {described.remedy}")
            told = [f"Not {label_words(n)}: {how}" for n, how in described.neighbours.items()]
            blocks += [Paragraph(f"{described.title}: {described.meaning}."), Bullets((*said, *told))]
    blocks += [
        Callout(
            "info",
            f"The law of {effect.name}",
            typeset(_one_paragraph(inspect.getdoc(type(effect)) or "")),
        )
        for effect in effects
        if effect.label in verdict.answer
    ]
    if verdict.confusable:
        pairs = tuple(f"{label_words(one)} and {label_words(other)}" for one, other in verdict.confusable)
        blocks += [Paragraph("These records cannot tell apart:"), Bullets(pairs)]
    elif len(verdict.answer) > 1:
        blocks.append(Paragraph("Rivals of a pair were not sought; the ranking shows what comes near."))
    elif verdict.answer and verdict.answer != OTHER:
        blocks.append(Paragraph("No other single effect explains these records nearly as well."))
    blocks.append(Paragraph(typeset(f"Next experiment: {verdict.next_experiment}.")))
    return Section("What is it, and what to do?", tuple(blocks))


def left_section(diagnosis: Diagnosis) -> Section:
    """What stays beside the explanation."""
    table = Table(
        ("what is left", "chance in noise alone", "size / noise"),
        tuple(
            (left.kind, format_p_value(min(1.0, math.exp(-left.negative_log_p))), f"{left.size:.2f}")
            for left in diagnosis.decision.leftovers
        ),
        f"What stays beside {diagnosis.decision.explanation.name}: descriptions that name no cause, each "
        "with the probability of as much by chance, and its size in units of the noise. An unlikely one of "
        "some size makes the verdict “other”; so does an effect in a place where functions that name no "
        "cause find next to nothing.",
        (1, 2),
    )
    return Section("What is left?", (table,), folded=diagnosis.verdict.answer != OTHER)


def weighed_section(diagnosis: Diagnosis) -> Section:
    """Probabilities of all labels, and the ranking of what was tried."""
    verdict = diagnosis.verdict
    blocks = (label_probabilities(verdict.probability, verdict.answer), ranking_table(diagnosis))
    return Section("What else was weighed?", blocks, folded=True)


def _one_paragraph(docstring: str) -> str:
    return " ".join(docstring.replace("`", "").split())


def ranking_table(diagnosis: Diagnosis) -> Table:
    unit = diagnosis.case.model.units.output
    floor = diagnosis.verdict.gap_train.noise_floor
    ranked = ranking(diagnosis.attribution, floor, diagnosis.left_out)
    return Table(
        (
            "effect",
            "gain in log-evidence",
            "left-out blocks",
            "weight",
            f"rmse left ({unit})",
            "would explain",
        ),
        tuple(_ranked_row(row, diagnosis.decision.explanation.labels) for row in ranked[:RANKED_SHOWN]),
        "Ranking of what was tried, the best form of every effect and pair, on the training records. The "
        f"gain is over the re-estimated model with coloured noise; {NO_NUMBER} in its column: fitted on "
        "plain residuals only, and not among the best. “Left-out blocks”, of the first few that have "
        "one: log predictive density of every twelfth of a record given the rest, less that of the best, ± "
        "its standard error; “weight”: in the mixture of predictions that is best at it (stacking). "
        "“Would explain”: share of the avoidable squared error that it removes; a stochastic effect alone "
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
    """Errors before and after, and the hold-out record to zoom."""
    blocks = (closure_table(diagnosis), *_unclosed(diagnosis), _zoomable(diagnosis))
    return Section("Does it predict what it has not seen?", blocks)


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
    random = " and ".join(map(label_words, explanation.cause_of_noise.labels))
    return [
        Callout(
            "info",
            "No simulator can track it",
            f"What is random ({random}) is not known beforehand on another record. What is gained is a "
            "better description of the error, and with it of the band.",
        )
    ]


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
