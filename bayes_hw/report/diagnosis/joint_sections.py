"""Sections of the page on records alone, in the order in which an engineer doubts."""

from __future__ import annotations

from bayes_hw.analysis import Beginning
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.words_of_answer import words_of
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis
from bayes_hw.infer.residual_tests import ResidualReport
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.report.axis.axis_sight import axis_sight, errors_over, velocity_step
from bayes_hw.report.axis.figures_axis import (
    command_and_angle,
    errors_figure,
    response_figure,
    step_figure,
)
from bayes_hw.report.diagnosis.diagnosis_numbers import estimate_rows
from bayes_hw.report.diagnosis.figures_diagnosis import label_probabilities
from bayes_hw.report.page.document import Block, Bullets, Callout, Figure, Paragraph, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_number, format_p_value, format_value
from bayes_hw.report.page.typography import typeset

LIMITS = ("saturation.lower", "saturation.upper")
JUMP = 3.0
"""Standard deviations by which a number must move to be said to jump."""


def evidence_section(diagnosis: JointDiagnosis, prediction: Figure | None) -> Section:
    """The record held out, where it is not on the first screen, and the error over speed and position."""
    blocks: list[Block] = [] if prediction is None else [prediction]
    errors = errors_over(diagnosis.train, diagnosis.found.base, diagnosis.posterior.fit)
    blocks.append(errors_figure(errors, diagnosis.train[0].units.output))
    return Section("Does it predict what it has not seen?", tuple(blocks))


def advice_section(diagnosis: JointDiagnosis) -> Section:
    """What can be done on the axis, and the experiment that confirms."""
    verdict = diagnosis.verdict
    said = diagnosis.advice
    blocks: list[Block] = []
    if said:
        blocks.append(Bullets(tuple(typeset(one) for one in said)))
    blocks.append(Paragraph(typeset(f"Next experiment: {verdict.next_experiment}.")))
    return Section("What to do", tuple(blocks))


def axis_section(diagnosis: JointDiagnosis) -> Section:
    """Command and angle, response over frequency, step of the velocity."""
    units, base = diagnosis.train[0].units, diagnosis.verdict.base
    limits = [base[name].mean for name in LIMITS if name in base]
    sight = axis_sight(diagnosis.train, diagnosis.posterior)
    blocks: list[Block] = [command_and_angle(diagnosis.train, limits), response_figure(sight, units)]
    if sight.remark:
        blocks.append(Callout("warn", "The model beyond what was measured", sight.remark))
    blocks.append(step_figure(velocity_step(diagnosis.train, diagnosis.posterior), units))
    return Section("The axis", tuple(blocks))


def numbers_section(diagnosis: JointDiagnosis) -> Section:
    """Every parameter of the model with the effects."""
    estimates = {**diagnosis.verdict.parameters, **diagnosis.verdict.base}
    rows = tuple((parameter_name(name).words, *row) for name, *row in estimate_rows(estimates))
    holds = diagnosis.verdict.answer != (OTHER,)
    of = "the axis with the effect in its model" if diagnosis.verdict.answer else "the axis"
    blocks: list[Block] = []
    if not holds:
        blocks.append(
            Callout(
                "bad",
                "Of a model that does not hold",
                "Something is missing that was not found, so that every number below may have moved to make "
                "up for it; the intervals do not count that.",
            )
        )
    blocks.append(
        Table(
            ("parameter", "mean ± sd", "94 % interval"),
            rows,
            f"Numbers of {of}, estimated together (94 %: highest-density interval).",
            (1, 2),
        )
    )
    return Section("How sure are the numbers?", tuple(blocks), folded=not holds)


def residuals_section(tests: ResidualReport) -> Section:
    """Tests of what the model with the effects leaves."""
    return Section(
        "What is left",
        (
            Table(
                ("test", "p‑value", "passed", "meaning"),
                tuple(
                    (t.name, format_p_value(t.p_value), "yes" if t.passed else "no", t.meaning)
                    for t in tests.tests
                ),
                "Tests of what the model leaves of the training records, each at 1 %.",
                (1,),
            ),
        ),
        folded=all(test.passed for test in tests.tests),
    )


def odds_section(diagnosis: JointDiagnosis) -> Section:
    """Every label with its probability, and what each explanation is worth."""
    found, verdict = diagnosis.found, diagnosis.verdict
    worth = [*found.nats.items(), *found.readings.nats.items()]
    rows = [(label, f"{nats:.0f}") for label, nats in worth]
    known = {label for label, _ in rows}
    rivals = sorted(found.rivals.items(), key=lambda item: -item[1])
    rows += [(f"{n}, alone in place of it", f"{v:.0f}") for n, v in rivals if v > 0 and n not in known]
    blocks: list[Block] = [label_probabilities(verdict.probability, verdict.answer)]
    if rows:
        blocks.append(
            Table(
                ("effect", "log-likelihood gained"),
                tuple(rows),
                "What each explanation gains over the best model without any, in natural logarithms, the "
                "rest of the model and the noise free.",
                (1,),
            )
        )
    return Section("What else was weighed", tuple(blocks), folded=True)


def refuted_section(diagnosis: JointDiagnosis, refuted: Beginning) -> Section:
    """The plain model's numbers beside the corrected ones, and why it does not hold."""
    plain = plain_numbers(refuted.model)
    base = diagnosis.verdict.base
    rows, jumps = [], []
    for name, value in plain.items():
        words = parameter_name(name).words
        if name not in base:
            rows.append((words, format_number(value), "—", "—"))
            continue
        e = base[name]
        apart = abs(value - e.mean) / e.sd if e.sd > 0 else 0.0
        rows.append((words, format_number(value), format_value(e.mean, e.sd), f"{apart:.1f}"))
        if apart > JUMP:
            jumps.append(f"{words} by {apart:.0f} standard deviations")
    missing = " and ".join(words_of(label) for label in diagnosis.verdict.answer)
    moved = f" With {missing} in the model, numbers jump: {'; '.join(jumps)}." if jumps else ""
    tests = [(t.name, format_p_value(t.p_value), t.meaning) for t in refuted.residuals.tests]
    return Section(
        "Numbers of a model that does not hold",
        (
            Paragraph(
                "The four-step estimate without any effect fits these records with a noise of order "
                f"{refuted.noise_order}, which takes up what the model lacks.{moved} They are here to be "
                "compared and for nothing else."
            ),
            Table(
                ("parameter", "of a model that does not hold", "with the effect", "apart (sd)"),
                tuple(rows),
                "Limits, dead zone and modes of the plain estimate.",
                (1, 2, 3),
            ),
            Table(
                ("test", "p‑value", "meaning"), tuple(tests), "Tests of the plain model's residuals.", (1,)
            ),
        ),
        folded=True,
    )


def plain_numbers(model: HammersteinWiener) -> dict[str, float]:
    """What a model says of limits, dead zone and modes, named as in posterior.json."""
    found = {
        LIMITS[0]: model.saturation.lower,
        LIMITS[1]: model.saturation.upper,
        "dead_zone.half_width": model.dead_zone.half_width,
    }
    for number, mode in enumerate(sorted(model.dominant_modes, key=lambda m: m.frequency_hz), start=1):
        found[f"mode{number}.frequency_hz"] = mode.frequency_hz
        found[f"mode{number}.damping_ratio"] = mode.damping_ratio
    return found


def notes_section(diagnosis: JointDiagnosis) -> Section:
    """How it was found and what was not checked."""
    said = [typeset(n) for n in diagnosis.verdict.notes if n not in diagnosis.advice]
    limits = [
        "Effects outside the catalogue can be seen, not named.",
        "A description is named, not what brings it about on the axis.",
        "Other motions than those recorded: the held-out record is like them.",
        "Frequencies that the command does not reach.",
    ]
    return Section(
        "How it was found, and what was not checked",
        (Bullets(tuple(said)), Paragraph("Not checked:"), Bullets(tuple(limits))),
        folded=True,
    )
