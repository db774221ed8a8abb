"""The report on a gap between simulator and records: from a diagnosis to a document."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.effects.words import BLOCK_WORDS, label_words
from bayes_hw.provenance import Provenance
from bayes_hw.report.diagnosis.diagnosis_numbers import OTHER, numbers_section, share_interval
from bayes_hw.report.diagnosis.diagnosis_sections import (
    NO_NUMBER,
    advice_section,
    how_far_section,
    left_section,
    weighed_section,
    when_section,
    where_section,
)
from bayes_hw.report.diagnosis.figures_diagnosis import gap_on_record
from bayes_hw.report.page.document import (
    Badge,
    Block,
    Bullets,
    Callout,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
)
from bayes_hw.report.page.rounding import format_duration, format_number, format_percent
from bayes_hw.report.page.typography import typeset

BAND = 0.94
SURE = 0.9
MOST = 0.8
HALF = 0.5
BAND_GOOD = (0.9, 0.985)
BAND_POOR = 0.8
SMALLEST_GAP = 0.3
"""Of the noise: below it nothing is claimed."""


def diagnosis_report(diagnosis: Diagnosis, origin: Provenance) -> Report:
    """The report whose first page answers: is there a gap, which effect is it, how far does it shrink."""
    return Report(
        title=diagnosis.case.name,
        subtitle="What its simulator lacks, and how far the error shrinks with it",
        verdict=_verdict(diagnosis),
        badges=_badges(diagnosis),
        key_figure=gap_on_record(
            diagnosis.case.holdout[0],
            diagnosis.before,
            diagnosis.after,
            diagnosis.low,
            diagnosis.high,
            diagnosis.verdict.gap_holdout.noise_floor,
        ),
        sections=(
            how_far_section(diagnosis),
            advice_section(diagnosis),
            where_section(diagnosis),
            numbers_section(diagnosis),
            when_section(diagnosis),
            left_section(diagnosis),
            weighed_section(diagnosis),
            _records_section(diagnosis),
            _limits_section(diagnosis),
            Section("Where this comes from", (KeyValues(origin.rows()),), folded=True),
        ),
    )


def _verdict(diagnosis: Diagnosis) -> str:
    verdict = diagnosis.verdict
    parts = [typeset(diagnosis.sentence())]
    if verdict.confusable:
        rivals = ", ".join(label_words(other) for _, other in verdict.confusable)
        parts.append(f"These records cannot rule out {rivals} instead.")
    return " ".join(parts)


def _badges(diagnosis: Diagnosis) -> tuple[Badge, ...]:
    return (
        _answer_badge(diagnosis),
        _closed_badge(diagnosis),
        *_rival_badges(diagnosis),
        _band_badge(diagnosis),
    )


def _answer_badge(diagnosis: Diagnosis) -> Badge:
    verdict = diagnosis.verdict
    sure = f"{format_percent(verdict.certainty, 1)} sure"
    if not verdict.answer:
        return Badge("nothing is missing", "good", sure)
    if verdict.answer == OTHER:
        return Badge("not explained", "bad", f"none of the known effects fits, {sure}")
    block = verdict.where.block
    return Badge(
        " and ".join(map(label_words, verdict.answer)),
        "good" if verdict.certainty >= SURE else "warn",
        f"{sure}, acts {BLOCK_WORDS[block]}",
    )


def _closed_badge(diagnosis: Diagnosis) -> Badge:
    verdict, gap = diagnosis.verdict, diagnosis.verdict.gap_holdout
    low, high = gap.closed_hdi94
    if not verdict.answer:
        return Badge("nothing to explain", "good", "the error held out is the noise, as far as can be told")
    if verdict.answer == OTHER:
        return Badge("nothing explained", "bad", "the model stays as it was")
    if diagnosis.decision.explanation.cause_of_noise is not None and gap.closed < HALF:
        return Badge("not to be tracked", "warn", "the effect is random; the band is what improves")
    state = "good" if low >= MOST else "warn" if gap.closed >= HALF else "bad"
    return Badge(
        f"explains {format_percent(gap.closed)}",
        state,  # type: ignore[arg-type]
        f"of the avoidable error held out (94 %: {share_interval(low, high)})",
    )


def _rival_badges(diagnosis: Diagnosis) -> tuple[Badge, ...]:
    """Rivals are sought of a single effect only."""
    answer, confusable = diagnosis.verdict.answer, diagnosis.verdict.confusable
    if not answer:
        return ()
    if confusable:
        rivals = ", ".join(label_words(other) for _, other in confusable)
        return (Badge("not told apart", "warn", f"could also be {rivals}"),)
    if answer == OTHER:
        return (Badge("cause open", "warn", "see what is left, and the next experiment"),)
    if len(answer) > 1:
        return (Badge("rivals not sought", "warn", "of a pair; see the ranking"),)
    return (Badge("no rival", "good", "no other single effect explains these records nearly as well"),)


def _band_badge(diagnosis: Diagnosis) -> Badge:
    y = diagnosis.case.holdout[0].y
    held = float(np.mean((y >= diagnosis.low) & (y <= diagnosis.high)))
    good = BAND_GOOD[0] <= held <= BAND_GOOD[1]
    state = "good" if good else "bad" if held < BAND_POOR else "warn"
    label = "band holds" if good else "band too narrow" if held < BAND else "band wide"
    detail = f"{format_percent(held, 1)} of the samples held out lie in the {format_percent(BAND)} band"
    return Badge(label, state, detail)  # type: ignore[arg-type]


def _records_section(diagnosis: Diagnosis) -> Section:
    case = diagnosis.case
    records = [(r, "training") for r in case.train] + [(r, "held out") for r in case.holdout]
    starts = diagnosis.attribution.base_costs
    blocks: list[Block] = [
        Table(
            ("record", "used for", "samples", "length", "rate"),
            tuple(
                (r.name, use, str(len(r)), format_duration(r.duration_s), f"{r.sample_rate_hz:g} Hz")
                for r, use in records
            ),
            "Records. The outputs of those held out served to score the finished prediction only.",
            (2, 3, 4),
        ),
        Table(
            ("start of the base model", "cost", "above the best"),
            tuple(
                (str(i + 1), format_number(cost, 5), f"{cost - starts[0]:.2f}" if i else NO_NUMBER)
                for i, cost in enumerate(starts)
            ),
            "Fits of the base model from several starts, best first: half the sum of squared residuals in "
            "units of the nominal noise, priors included.",
            (1, 2),
        ),
    ]
    treated = [f"{record.name}: {step}" for record, _ in records for step in record.treatment]
    if treated:
        blocks += [Paragraph("What was done to the data after reading:"), Bullets(tuple(treated))]
    blocks += [Callout("warn", "Note", typeset(note)) for note in diagnosis.verdict.notes]
    return Section("Records, starts and notes", tuple(blocks), folded=True)


def _limits_section(diagnosis: Diagnosis) -> Section:
    held = len(diagnosis.case.holdout)
    tried = len(diagnosis.verdict.probability) - 2
    items = [
        f"Effects other than the {tried} labels of the catalogue: they can be seen as “other”, not named.",
        "Cause: the records show which description fits, not what brings it about. An effect that acts on "
        "the output as another does carries the other's name.",
        f"Gaps below {SMALLEST_GAP:g} of the noise: how often those are named right is not established, and "
        "“nothing is missing” does not deny them.",
        f"Other motions: the explained share was measured on {held} record{'s' * (held != 1)} held out; it "
        "holds for commands like these.",
        "Three or more effects at once: singles and pairs were fitted.",
        diagnosis.attribution.base.fit.hypothesis.builder.said_of_structure,
        "The probabilities are less sure than the evidences alone would make them, and were held against "
        "simulated cases only; a real axis can be less sure still.",
        "The intervals take the noise's own parameters as estimated.",
    ]
    if not diagnosis.case.model.noise_sigma > 0:
        items.append(
            "Small effects: no noise level was given, so that what is small beside the gap (a fifth of its "
            "root mean square) is called neither a second effect nor “other”."
        )
    return Section("What was not checked", (Bullets(tuple(items)),), folded=True)
