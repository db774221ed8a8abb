"""The report on records alone: what the axis does, what a cascade lacks, how sure, and what to do."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.joint.given_response import GivenFit
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis, summary
from bayes_hw.provenance import Provenance
from bayes_hw.report.diagnosis.diagnosis_sections import estimate_rows
from bayes_hw.report.diagnosis.figures_diagnosis import gap_on_record, label_probabilities
from bayes_hw.report.page.document import Badge, Bullets, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.rounding import format_percent
from bayes_hw.report.page.typography import typeset

SURE = 0.9


def joint_report(diagnosis: JointDiagnosis, origin: Provenance) -> Report:
    """One page that answers, with the evidence below."""
    verdict = diagnosis.verdict
    return Report(
        title=f"What the records of {diagnosis.name} say",
        subtitle=_subtitle(diagnosis),
        verdict=typeset(summary(diagnosis)),
        badges=_badges(diagnosis),
        key_figure=gap_on_record(
            diagnosis.holdout[0],
            diagnosis.before,
            diagnosis.after,
            diagnosis.low,
            diagnosis.high,
            verdict.gap_holdout.noise_floor,
        ),
        sections=(
            Section("What to do", (Bullets(tuple(typeset(note) for note in verdict.notes)),
                                   Paragraph(typeset(f"Next experiment: {verdict.next_experiment}.")))),
            Section("Which effect", (label_probabilities(verdict.probability, verdict.answer),
                                     *_evidence(diagnosis))),
            Section("Parameters", (_table(diagnosis),)),
            Section("Provenance", (KeyValues(origin.rows()),)),
        ),
    )  # fmt: skip


def _subtitle(diagnosis: JointDiagnosis) -> str:
    if isinstance(diagnosis.found.fit, GivenFit):
        return "Base parameters of the model, effect and noise inferred together, through ports on its G"
    return "Structure, effect and noise inferred together, without any model"


def _badges(diagnosis: JointDiagnosis) -> tuple[Badge, ...]:
    verdict = diagnosis.verdict
    y = diagnosis.holdout[0].y
    inside = float(np.mean((y >= diagnosis.low) & (y <= diagnosis.high)))
    if not verdict.answer:
        first = Badge("no structural gap", "good", f"{format_percent(verdict.probability['none'], 1)} sure")
    else:
        sure = min(verdict.probability[label] for label in verdict.answer)
        first = Badge(
            " and ".join(verdict.answer),
            "good" if sure >= SURE else "warn",
            f"{format_percent(sure, 1)} sure",
        )
    band = Badge(
        "band holds" if 0.88 <= inside <= 0.985 else "band off",
        "good" if 0.88 <= inside <= 0.985 else "warn",
        f"{format_percent(inside, 1)} of the samples held out lie in the 94 % band",
    )
    return first, band


def _evidence(diagnosis: JointDiagnosis) -> tuple[Table, ...]:
    found = diagnosis.found
    rows = [(label, f"{nats:.0f}") for label, nats in {**found.nats, **found.readings.nats}.items()]
    rows_of = set(found.nats)
    rivals = sorted(found.rivals.items(), key=lambda item: -item[1])
    rows += [
        (f"{label}, alone in place of it", f"{nats:.0f}")
        for label, nats in rivals
        if nats > 0 and label not in rows_of
    ]
    if not rows:
        return ()
    return (
        Table(
            ("effect", "nats"),
            tuple(rows),
            _worth(diagnosis),
            (1,),
        ),
    )


def _worth(diagnosis: JointDiagnosis) -> str:
    if isinstance(diagnosis.found.fit, GivenFit):
        return "What each is worth, base parameters and noise free."
    return "What each is worth, G and noise free (and grown again without it)."


def _table(diagnosis: JointDiagnosis) -> Table:
    estimates = {**diagnosis.verdict.parameters, **diagnosis.verdict.base}
    header = ("parameter", "posterior mean ± sd", "94 % HDI")
    return Table(header, estimate_rows(estimates), "Estimated together.", (1, 2))
