"""The page on records alone: what the axis does, what a plain model lacks, how sure, and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.analysis import Beginning
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.words_of_answer import words_of
from bayes_hw.gap.joint.answer.effect_view import effect_view
from bayes_hw.gap.joint.answer.free_function import EffectView, Seen
from bayes_hw.gap.joint.finding import MOST_SAID
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis
from bayes_hw.gap.joint.posterior.joint_closure import differ
from bayes_hw.identify.holes import with_holes
from bayes_hw.infer.residual_tests import ResidualReport, examine_residuals
from bayes_hw.provenance import Provenance
from bayes_hw.report.diagnosis.figures_diagnosis import effect_figure, gap_on_record
from bayes_hw.report.diagnosis.joint_sections import (
    advice_section,
    axis_section,
    evidence_section,
    notes_section,
    numbers_section,
    odds_section,
    refuted_section,
    residuals_section,
)
from bayes_hw.report.page.document import Badge, Figure, KeyValues, Report, Section
from bayes_hw.report.page.rounding import format_percent
from bayes_hw.report.page.typography import typeset

SURE = 0.9
BAND_GOOD = (0.9, 0.985)
GONE_GOOD, GONE_POOR = 0.8, 0.4


@dataclass(frozen=True, eq=False)
class JointPage:
    """What the page and its sections are made from, each computed once."""

    diagnosis: JointDiagnosis

    @cached_property
    def tests(self) -> ResidualReport:
        """Of what the model with the answer's effects leaves of the training records."""
        fit, train = self.diagnosis.posterior.fit, self.diagnosis.train
        whitener = fit.point.whitener
        order = whitener.order
        residuals = [
            with_holes(r.y - fit.response.along(fit.values, number).y, r.measured)
            for number, r in enumerate(train)
        ]
        fitted = order if fit.slow is None else len(fit.slow.at)
        return examine_residuals(train, residuals, whitener.coefficients[order, :order], fitted)

    @cached_property
    def view(self) -> EffectView | None:
        """What convinces of the first label of the answer."""
        answer = self.diagnosis.verdict.answer
        if not answer:
            return None
        return effect_view(Seen(self.diagnosis.posterior.fit, self.diagnosis.found.readings), answer[0])

    @cached_property
    def prediction(self) -> Figure:
        """The record held out."""
        found = self.diagnosis
        floor = found.verdict.gap_holdout.noise_floor
        return gap_on_record(found.holdout[0], found.before, found.after, found.low, found.high, floor)


def joint_report(diagnosis: JointDiagnosis, origin: Provenance, refuted: Beginning | None = None) -> Report:
    """One page that answers, with the evidence below; `refuted` is a plain model of the same records, whose
    numbers are shown folded, as those of a model that does not hold."""
    page = JointPage(diagnosis)
    sections = [
        evidence_section(diagnosis, page.prediction if page.view is not None else None),
        advice_section(diagnosis),
        axis_section(diagnosis),
        numbers_section(diagnosis),
        residuals_section(page.tests),
        odds_section(diagnosis),
    ]
    if refuted is not None:
        sections.append(refuted_section(diagnosis, refuted))
    return Report(
        title=diagnosis.name,
        subtitle=_subtitle(diagnosis),
        verdict=typeset(diagnosis.sentence()),
        badges=_badges(page),
        key_figure=page.prediction if page.view is None else effect_figure(page.view),
        sections=(
            *sections,
            notes_section(diagnosis),
            Section("Where this comes from", (KeyValues(origin.rows()),), folded=True),
        ),
    )


def _subtitle(diagnosis: JointDiagnosis) -> str:
    count = len(diagnosis.train)
    model = (
        "the given model lacks, found as torques that act through its G"
        if diagnosis.found.fit.of_a_given_model
        else "its model lacks"
    )
    return (
        f"What the axis does and what {model}: from {count} record{'s' * (count > 1)}, "
        f"checked on {diagnosis.holdout[0].name}"
    )


def _badges(page: JointPage) -> tuple[Badge, ...]:
    diagnosis = page.diagnosis
    return (_cause(diagnosis), _gone(diagnosis), _band(diagnosis), _left(page.tests))


def _cause(diagnosis: JointDiagnosis) -> Badge:
    verdict = diagnosis.verdict
    sure = f"{format_percent(verdict.certainty, 1)} sure"
    if not verdict.answer:
        return Badge("nothing missing", "good", sure)
    rivals = ", ".join(words_of(rival) for _, rival in verdict.confusable)
    label = " and ".join("cause unknown" if n == OTHER else words_of(n) for n in verdict.answer)
    alone = verdict.certainty >= SURE and not rivals
    return Badge(
        label,
        "bad" if verdict.answer == (OTHER,) else "good" if alone else "warn",
        sure + (f"; {rivals} would explain it as well" if rivals else ""),
    )


def _gone(diagnosis: JointDiagnosis) -> Badge:
    gap = diagnosis.verdict.gap_holdout
    low, high = gap.closed_hdi94
    if not (diagnosis.verdict.answer and differ(diagnosis.before, diagnosis.after, gap.rmse_before)):
        detail = f"the error on {diagnosis.holdout[0].name} is that of the plain model"
        return Badge("nothing was added", "warn" if diagnosis.verdict.answer else "good", detail)
    sure = (
        ""
        if low > MOST_SAID
        else f" (94 %: {format_percent(low, 1)} to {format_percent(min(high, 0.999), 1)})"
    )
    size = "over 99 %" if gap.closed > MOST_SAID else format_percent(max(gap.closed, 0.0))
    return Badge(
        f"{size} of the error gone",
        "good" if gap.closed >= GONE_GOOD else "bad" if gap.closed < GONE_POOR else "warn",
        f"of what a model could avoid on {diagnosis.holdout[0].name}, held out{sure}",
    )


def _band(diagnosis: JointDiagnosis) -> Badge:
    record = diagnosis.holdout[0]
    measured = record.measured_samples
    inside = float(np.mean(((record.y >= diagnosis.low) & (record.y <= diagnosis.high))[measured]))
    good = BAND_GOOD[0] <= inside <= BAND_GOOD[1]
    label = "bands hold" if good else "bands too narrow" if inside < BAND_GOOD[0] else "bands too wide"
    detail = f"{format_percent(inside, 1)} of {record.name} lies in the 94 % band"
    return Badge(label, "good" if good else "warn", detail)


def _left(tests: ResidualReport) -> Badge:
    failed = [test for test in tests.tests if not test.passed]
    if not failed:
        return Badge("what is left is noise", "good", "all four tests of the residuals passed")
    return Badge(
        "something is left",
        "bad" if not tests.white else "warn",
        "; ".join(test.meaning.split(":")[0] for test in failed[:2]),
    )
