"""A diagnosis from records alone or around a model: pose, infer, measure, answer."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.crew import crew
from bayes_hw.errors import InputError
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.gap.answer.corrected_train import motion_of
from bayes_hw.gap.answer.experiment import experiment_for
from bayes_hw.gap.answer.verdict import Verdict
from bayes_hw.gap.case.case import check_records
from bayes_hw.gap.joint.answer.advice import Drive, advice_on
from bayes_hw.gap.joint.answer.corrected_model import corrected_model
from bayes_hw.gap.joint.answer.encoder_noise import encoder_sigma, noise_doubt
from bayes_hw.gap.joint.answer.joint_estimates import base_estimates, effect_estimates
from bayes_hw.gap.joint.answer.joint_location import location_of
from bayes_hw.gap.joint.answer.joint_notes import notes_on_search
from bayes_hw.gap.joint.answer.joint_prediction import Predictor
from bayes_hw.gap.joint.decision.joint_decision import JointDecision
from bayes_hw.gap.joint.decision.known_verdict import known_verdict
from bayes_hw.gap.joint.finding import beyond_limits, sentence, unfollowed
from bayes_hw.gap.joint.fit.starts import Starts
from bayes_hw.gap.joint.fit.unreached_limits import unknown_reach
from bayes_hw.gap.joint.inferred import Inferred, infer_alone, infer_around
from bayes_hw.gap.joint.posterior.joint_closure import ESTIMATED, Floor
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.residuals.remainder import samples_of_variance
from bayes_hw.gap.joint.residuals.rounded_readings import readings_of
from bayes_hw.gap.joint.search.hidden_zone import clear_of_zone
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.gap.joint.search.known_input import columns_of
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Start
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

OWN_MODEL = (
    "the model given was identified from these very records, so that its structure may have taken up what is "
    "missing: it is opened again and inferred together with the effects"
)
"""Said of such a model."""

MOST_SAMPLES = 40_000
"""Of all records together that a search sees: of longer ones each record's beginning, in proportion."""


@dataclass(frozen=True, eq=False)
class JointDiagnosis:
    """What was found from records alone; predictions (samples,) are of the first record held out: the angle
    of the axis before and after, and the band of what the encoder shows, its drift included."""

    name: str
    train: tuple[Record, ...]
    holdout: tuple[Record, ...]
    found: JointAnswer
    decision: JointDecision
    posterior: JointPosterior
    verdict: Verdict
    before: FloatArray
    after: FloatArray
    low: FloatArray
    high: FloatArray
    corrected: dict[str, object]
    advice: tuple[str, ...] = ()

    def sentence(self) -> str:
        """What the axis does, what its model lacks and how sure that is."""
        if nothing := unfollowed(self.train):
            return nothing
        follows = " ".join(str(one["sentence"]) for one in self.verdict.known.values() if one["follows"])
        held_out = self.holdout[0]
        reach = unknown_reach(self.posterior.fit, held_out)
        beyond = "" if reach is None else beyond_limits(held_out, *reach)
        said = sentence(self.verdict, bool(self.found.fit.labels), held_out.name, beyond)
        return f"{follows} {said}".strip()

    def write(self, out: Path) -> None:
        """verdict.json, holdout_prediction.csv (angles of the encoder), corrected.json: all or none."""
        first = self.holdout[0]
        angles = {
            "before": self.before,
            "after": self.after,
            "lo": self.low,
            "hi": self.high,
            "y": first.y_or_nan,
        }
        columns = {"t": first.t} | {name: angle + first.origin for name, angle in angles.items()}
        with staged(out, instead_of=["free_residual.csv"]) as place:
            write_csv(place / "holdout_prediction.csv", columns)
            self.verdict.write(place / "verdict.json")
            write_json(place / "corrected.json", self.corrected)


def diagnose_records(
    records: Sequence[Record],
    holdout: Sequence[Record],
    rng: np.random.Generator,
    *,
    name: str = "records",
    notes: Sequence[str] = (),
    progress: Progress | None = None,
    lead: int = 0,
    drive: Drive | None = None,
    model: HammersteinWiener | None = None,
    start: Start = "auto",
    jobs: int = 1,
    within_s: float = float("inf"),
) -> JointDiagnosis:
    """Diagnose `records` without any model, or around `model` as it is given but for its base parameters;
    the outputs of `holdout` only score the finished prediction.

    The first `lead` samples of every record held out are simulated and not scored: those of a record whose
    end alone is held out. The diagnosis then holds the ends. One that begins in motion is predicted from the
    state that fits its beginning, unless `start` is "rest" (see `Starts`). What is known of the `drive`
    states torques in N m. `jobs` threads change no number. A search that takes `within_s` seconds ends with
    what it has, and a note says so.

    Raises InputError where there is no record, one at another rate or one too short, and
    where the G of a model answers within the sample.
    """
    begin = time.perf_counter()
    progress = progress or Progress(quiet=True)
    _check(name, records, holdout)
    whole = tuple(records)
    seen, samples = whole, sum(len(record) for record in records)
    if samples > MOST_SAMPLES:
        seen = tuple(record.split(MOST_SAMPLES / samples)[0] for record in whole)
        fitted = "; every number was then fitted to all" if model is None else ""
        part = f"on the beginnings of the records, {MOST_SAMPLES} of {samples} samples"
        notes = (*notes, f"structure and effects were sought {part}{fitted}")
    with one_blas_thread(), crew(jobs), np.errstate(all="ignore"):
        if model is None:
            inferred = infer_alone(seen, whole, within_s, progress.say, rng)
        else:
            inferred = infer_around(model, seen, within_s, progress.say, rng)
        return _measured(name, inferred, tuple(holdout), tuple(notes), rng, begin, lead, drive, start)


def _check(name: str, records: Sequence[Record], holdout: Sequence[Record]) -> None:
    """Raises InputError where records cannot be diagnosed together."""
    if not records:
        raise InputError(f"{name}: no record to train on; give at least one")
    check_records(name, records[0].sample_rate_hz, records, holdout)
    for column in columns_of(records):
        for record in holdout:
            if column not in record.known:
                raise InputError(f"{record.name}: no known input {column!r}, which the training records have")


def _measured(
    name: str,
    inferred: Inferred,
    holdout: tuple[Record, ...],
    notes: tuple[str, ...],
    rng: np.random.Generator,
    begin: float,
    lead: int,
    drive: Drive | None,
    start: Start,
) -> JointDiagnosis:
    """What was inferred, measured on the records trained on and held out, and put into words."""
    found, decision, posterior = inferred.found, inferred.decision, inferred.posterior
    fit, base, units = posterior.fit, found.bare, inferred.records[0].units
    train = tuple(
        record.counted_from(float(level)) for record, level in zip(inferred.records, fit.levels, strict=True)
    )
    zone = clear_of_zone(fit, holdout) if found.clear_of_zone else None
    starts = Starts.of(fit, train, holdout, lead, start, zone)
    holdout = tuple(starts.levelled(record, fit) for record in holdout)
    sigma = encoder_sigma(found, decision, fit)
    if found.readings.taken_off:
        fit, base = readings_of(train, fit), readings_of(train, base)
    samples = samples_of_variance(fit.point.residuals)
    relative_error = ESTIMATED / np.sqrt(2 * samples) + noise_doubt(found, decision)
    floor = Floor.of(fit, decision.answer, sigma)
    predictor = Predictor.of(posterior, fit, decision.answer, starts, holdout, floor, rng)
    on_train, on_holdout = (predictor.closure(records, base, fit) for records in (train, holdout))
    prediction = predictor.band(base, holdout[0], lead)
    advice = tuple(advice_on(decision.answer, posterior, found, drive))
    verdict = Verdict(
        decision.answer,
        decision.probability,
        decision.confusable,
        location_of(train, found, decision, sigma),
        on_train,
        on_holdout,
        effect_estimates(posterior, decision.answer, found.readings, units),
        base_estimates(posterior, sigma, relative_error, units),
        experiment_for(decision.answer, decision.confusable),
        time.perf_counter() - begin,
        (*notes, *starts.notes, *notes_on_search(found, decision), *advice),
        known=known_verdict(found, posterior, train, holdout, predictor.closure),
    )
    corrected = corrected_model(name, train, posterior, sigma) | {
        "answer": list(decision.answer),
        "probability": {label: decision.probability[label] for label in decision.answer},
        "motion": motion_of(train),
        "next_experiment": verdict.next_experiment,
    }
    if lead:
        holdout = tuple(record.window(lead / record.sample_rate_hz, np.inf) for record in holdout)
    return JointDiagnosis(
        name, train, holdout, found, decision, posterior, verdict, *prediction, corrected, advice
    )
