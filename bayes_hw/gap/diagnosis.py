"""The whole diagnosis of one case, a page: pose, search, criticise, answer, measure."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.confusable import confusable_pairs
from bayes_hw.gap.answer.corrected_train import corrected_train
from bayes_hw.gap.answer.decide import Decision, best_of_sets, choose, chosen_among, decide, remains_of
from bayes_hw.gap.answer.experiment import experiment_for
from bayes_hw.gap.answer.free_levels import counted_from_levels
from bayes_hw.gap.answer.judgement import OTHER, Remains
from bayes_hw.gap.answer.locate import locate
from bayes_hw.gap.answer.measure import measure
from bayes_hw.gap.answer.notes import notes_on
from bayes_hw.gap.answer.ranking import white_choice
from bayes_hw.gap.answer.sentence import sentence
from bayes_hw.gap.answer.unknown_noise import of_the_gap, with_plain_estimates, without_small_seconds
from bayes_hw.gap.answer.verdict import Verdict
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.criticism.block_functions import block_negative_log_p
from bayes_hw.gap.criticism.latent_force import free_residual
from bayes_hw.gap.criticism.left_out import LeftOut, compare_left_out
from bayes_hw.gap.criticism.residual_diagnostics import residual_diagnostics
from bayes_hw.gap.fit.exact_maximum import with_exact_maxima
from bayes_hw.gap.fit.explanation import Explanation, is_far_ahead
from bayes_hw.gap.search.attribute import Attribution, attribute
from bayes_hw.gap.search.question import Question, question
from bayes_hw.gap.search.state import Search
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread
from bayes_hw.time_budget import at_most

FREE_RESIDUAL, CORRECTED = "free_residual.csv", "corrected.json"


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a report needs: the case, fits, decision, predictions of the first record held out.

    `left_out` compares sets of labels by how they predict blocks of the training records left out; `final` is
    the explanation that predicts, `draws` (draws, parameters) are posterior draws of its coordinates.
    """

    case: Case | SimulatorCase
    attribution: Attribution
    decision: Decision
    verdict: Verdict
    before: FloatArray
    after: FloatArray
    low: FloatArray
    high: FloatArray
    left_out: Mapping[tuple[str, ...], LeftOut]
    final: Explanation
    draws: FloatArray

    @property
    def name(self) -> str:
        """Of the case."""
        return self.case.name

    @property
    def holdout(self) -> tuple[Record, ...]:
        """The records held out, their angles counted from their levels."""
        return tuple(self.case.holdout)

    def sentence(self) -> str:
        """The verdict in words."""
        return sentence(self)

    def write(self, out: Path) -> None:
        """verdict.json, holdout_prediction.csv, and of a given model corrected.json; where the answer is
        `other`, free_residual.csv too.

        All or none: see `staged`.
        """
        held = self.holdout[0]
        angles = {"before": self.before, "after": self.after, "lo": self.low, "hi": self.high}
        columns = {"t": held.t} | {name: angle + held.origin for name, angle in angles.items()}
        with staged(out, instead_of=[FREE_RESIDUAL, CORRECTED]) as place:
            if isinstance(self.case, Case):
                content = corrected_train(self.case, self.final, self.draws, self.verdict)
                write_json(place / CORRECTED, content)
            write_csv(place / "holdout_prediction.csv", columns)
            if self.verdict.answer == (OTHER,):
                noise = self.decision.explanation.encoder_noise
                write_csv(place / FREE_RESIDUAL, free_residual(self.attribution.base.fit, noise))
            self.verdict.write(place / "verdict.json")


class FullSimulator(Protocol):
    """The real simulator behind a fast one: sets a question up about it, and fits explanations on it."""

    def posed(self, asked: Question) -> Question:
        """The question with the base model moved by what the fast simulator lacks."""
        ...

    def refined(self, asked: Question, attribution: Attribution) -> Attribution:
        """The attribution with what may be answered fitted to the full simulator."""
        ...


def diagnose(
    case: Case | SimulatorCase,
    rng: np.random.Generator,
    *,
    jobs: int = 1,
    without: frozenset[str] = frozenset(),
    calibration: Calibration | None = None,
    progress: Progress | None = None,
    full: FullSimulator | None = None,
    within_s: float = float("inf"),
) -> Diagnosis:
    """Diagnose one case; labels in `without` are left out of the catalogue.

    The outputs of the records held out are used to score the finished prediction only. Where the case's
    simulator is a fast stand-in, `full` moves it to where the real one is. A search that takes `within_s`
    seconds begins nothing further, nor do fits on the full simulator after as many, and a note says so.
    """
    begin = time.perf_counter()
    progress = progress or Progress(quiet=True)
    calibration = calibration or Calibration.built_in()
    with one_blas_thread(), np.errstate(all="ignore"):
        asked = question(case, without)
        if full is not None:
            asked = full.posed(asked)
        with at_most(within_s):
            attribution = _search(asked, calibration, rng, jobs, progress)
        if full is not None:
            progress.say("the full simulator")
            with at_most(within_s):
                attribution = full.refined(asked, attribution)
        best, scores = choose(attribution, asked.nominal_sigma, calibration)
        progress.say("what is left")
        remains = _criticism(asked, attribution, best)
        decision = decide(best, scores, remains, asked.labels, calibration)
        if not asked.noise_is_known:
            attribution, decision = with_plain_estimates(attribution, decision, asked.measured)
        case = counted_from_levels(case, decision.explanation)
        progress.say("how far")
        measured = measure(case, attribution, decision, calibration, rng, Each(jobs))
        where = locate(attribution, decision, asked.base.commands, measured.sigma)
        confusable = confusable_pairs(decision.answer, scores, calibration.confusable_evidence)
        left_out = compare_left_out(best_of_sets(attribution))
        verdict = Verdict(
            decision.answer,
            decision.probability,
            confusable,
            where,
            measured.gap_train,
            measured.gap_holdout,
            measured.parameters,
            measured.base,
            experiment_for(decision.answer, confusable),
            time.perf_counter() - begin,
            notes_on(case, attribution, decision, left_out),
            white_choice(attribution),
        )
    held, half = measured.held, measured.half_width
    low, high = held.shown[0] - half, held.shown[0] + half
    return Diagnosis(
        case,
        attribution,
        decision,
        verdict,
        held.before[0],
        held.after[0],
        low,
        high,
        left_out,
        measured.final,
        measured.draws,
    )


def _search(
    asked: Question, calibration: Calibration, rng: np.random.Generator, jobs: int, progress: Progress
) -> Attribution:
    """All explanations, those that matter at the maximum of their exact likelihood."""
    nominal = asked.nominal_sigma
    chosen = partial(chosen_among, nominal_sigma=nominal, calibration=calibration)
    search = Search(
        asked.base, asked.measured, asked.effects, frozenset(asked.labels), rng, jobs, progress.say, chosen
    )
    found = attribute(search)
    if not asked.noise_is_known:
        found = without_small_seconds(found, calibration.small_share)
    best, _ = choose(found, nominal, calibration)
    return replace(found, explanations=with_exact_maxima(found.explanations, best))


def _criticism(asked: Question, attribution: Attribution, best: Explanation) -> Remains:
    """What `best` leaves, in size against the noise, or against the gap where the noise is not known."""
    inputs = asked.base.commands
    left = residual_diagnostics(best, inputs, asked.nominal_sigma)
    if not asked.noise_is_known:
        left = of_the_gap(left, best, attribution.base)
    negative_log_p = block_negative_log_p(attribution.base.fit, inputs)
    ahead = is_far_ahead(attribution.explanations)
    return remains_of(attribution.base, best, left, negative_log_p, ahead)
