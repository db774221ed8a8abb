"""A diagnosis from records alone: structure of G, effect and noise inferred together."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import welch

from bayes_hw.arrays import FloatArray
from bayes_hw.crew import crew
from bayes_hw.errors import InputError
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.gap.answer.corrected_train import motion_of
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.locate import Location
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate, Verdict
from bayes_hw.gap.case.case import check_records
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.joint.answer.advice import Drive, advice_on, experiment_for
from bayes_hw.gap.joint.answer.corrected_model import corrected_model
from bayes_hw.gap.joint.answer.encoder_noise import encoder_sigma, noise_doubt
from bayes_hw.gap.joint.answer.joint_notes import notes_on_search
from bayes_hw.gap.joint.decision.given_decision import GivenCalibration, GivenEvidence, decide_given
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import (
    JointDecision,
    decide_jointly,
    explaining,
    rivals_of,
)
from bayes_hw.gap.joint.decision.known_verdict import known_verdict
from bayes_hw.gap.joint.finding import beyond_limits, sentence, unfollowed
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.starts import Starts
from bayes_hw.gap.joint.fit.structure_moves import widened
from bayes_hw.gap.joint.fit.unreached_limits import unknown_reach
from bayes_hw.gap.joint.given.given_moves import as_given
from bayes_hw.gap.joint.given.given_search import search_given
from bayes_hw.gap.joint.posterior.given_posterior import INFLATION as GIVEN_INFLATION
from bayes_hw.gap.joint.posterior.given_posterior import laplace_given
from bayes_hw.gap.joint.posterior.joint_closure import (
    DRIFT,
    ESTIMATED,
    Floor,
    closure_of,
    of_axis,
    rms,
    spread,
    without_glitches,
)
from bayes_hw.gap.joint.posterior.joint_posterior import INFLATION, JointPosterior, averaged, laplace
from bayes_hw.gap.joint.posterior.reported_quantities import dominant_sections, sections_of_modes
from bayes_hw.gap.joint.residuals.remainder import leaves_a_cause, samples_of_variance
from bayes_hw.gap.joint.residuals.rounded_readings import readings_of
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.hidden_zone import clear_of_zone
from bayes_hw.gap.joint.search.joint_search import JointAnswer, search
from bayes_hw.gap.joint.search.known_input import BLOCKS, columns_of
from bayes_hw.gap.joint.search.observer import unobserved
from bayes_hw.gap.joint.search.whole_records import fitted_to, on_whole_records
from bayes_hw.identify.holes import with_holes, without_holes
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Start
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread
from bayes_hw.time_budget import at_most

PREDICTED_DRAWS, FEWEST_STABLE = 40, 5
SEGMENTS = 12
OWN_MODEL = (
    "the model given was identified from these very records, so that its structure may have taken up what is "
    "missing: it is opened again and inferred together with the effects"
)
"""Said of such a model."""

MOST_SAMPLES = 40_000
"""Of all records together that a search sees: of longer ones each record's beginning, in proportion."""

OF_SEARCH = 0.9
"""Of the time, that the search from records alone may take: the rest is for the numbers of what it found."""

OF_ROUNDED = 3.0
"""Factor on standard deviations where readings are rounded, held or late, so that errors are not independent,
where something without a name remains, an observer makes up for what a law lacks, or where the form of an
effect of a given model leaves noise that counts as a cause."""


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
    if not records:
        raise InputError(f"{name}: no record to train on; give at least one")
    check_records(name, records[0].sample_rate_hz, records, holdout)
    for column in columns_of(records):
        for record in holdout:
            if column not in record.known:
                raise InputError(f"{record.name}: no known input {column!r}, which the training records have")
    whole, samples = tuple(records), sum(len(record) for record in records)
    if samples > MOST_SAMPLES:
        records = [record.split(MOST_SAMPLES / samples)[0] for record in records]
        seen = f"on the beginnings of the records, {MOST_SAMPLES} of {samples} samples"
        fitted = "; every number was then fitted to all" if model is None else ""
        notes = (*notes, f"structure and effects were sought {seen}{fitted}")
    with one_blas_thread(), crew(jobs), np.errstate(all="ignore"):
        if model is None:
            with at_most(within_s):
                with at_most(OF_SEARCH * within_s):
                    found = search(records, progress.say)
                decision = decide_jointly(found)
                fit = explaining(found, decision)
                wider = widened(fit)
                if samples > MOST_SAMPLES:
                    found, records = on_whole_records(found, whole), whole
                    wider = fitted_to(wider, whole, found.base.response.weights)
            sections = sections_of_modes(fit, dominant_sections(fit), wider)
            poorly = poorly_described(decision) or fit.observer is not None
            inflation = OF_ROUNDED if poorly else INFLATION
            doubted = poorly or bool(fit.labels)
            units, rivals = records[0].units, rivals_of(found, decision, JointCalibration.built_in())
            posterior = laplace(wider, units, rng, inflation, sections, doubted)
            posteriors = [(laplace(one, units, rng, inflation), share) for one, share in rivals]
        else:
            with at_most(within_s):
                found = search_given(records, model, progress.say)
            decision = decide_given(GivenEvidence.of(found, model.noise_sigma))
            poorly = poorly_described(decision) or leaves_a_cause(found.fit)
            inflation = OF_ROUNDED if poorly else GIVEN_INFLATION
            units, rivals = records[0].units, rivals_of(found, decision, GivenCalibration.built_in())
            posterior = laplace_given(as_given(explaining(found, decision)), units, rng, inflation)
            posteriors = [(laplace_given(as_given(x), units, rng, inflation), share) for x, share in rivals]
        posterior = averaged(posterior, posteriors, rng)
        return _finished(
            name, tuple(records), tuple(holdout), found, decision, posterior, tuple(notes), rng, begin, lead,
            drive, start,
        )  # fmt: skip


def poorly_described(decision: JointDecision) -> bool:
    """Whether the noise of the answer is less than well described by a normal one, or something without a
    name is in it."""
    return bool(set(decision.answer) & {"encoder_quantization", "timing_jitter", OTHER})


def _finished(
    name: str,
    train: tuple[Record, ...],
    holdout: tuple[Record, ...],
    found: JointAnswer,
    decision: JointDecision,
    posterior: JointPosterior,
    notes: tuple[str, ...],
    rng: np.random.Generator,
    begin: float,
    lead: int,
    drive: Drive | None,
    start: Start,
) -> JointDiagnosis:
    fit, base, units = posterior.fit, found.bare, train[0].units
    train = tuple(r.counted_from(float(level)) for r, level in zip(train, fit.levels, strict=True))
    seen = clear_of_zone(fit, holdout) if found.clear_of_zone else None
    starts = Starts.of(fit, train, holdout, lead, start, seen)
    holdout = tuple(starts.levelled(record, fit) for record in holdout)
    sigma = encoder_sigma(found, decision, fit)
    if found.readings.taken_off:
        fit, base = readings_of(train, fit), readings_of(train, base)
    samples = samples_of_variance(fit.point.residuals)
    noise_error = sigma * (ESTIMATED / np.sqrt(2 * samples) + noise_doubt(found, decision))
    floor = Floor.of(fit, decision.answer, sigma)
    drifts = DRIFT in fit.labels
    some = [
        fit.response.values(posterior.coordinates[i])
        for i in rng.choice(len(posterior.coordinates), PREDICTED_DRAWS, replace=False)
    ]

    def closure_on(records: Sequence[Record], one: JointFit, other: JointFit) -> Closure:
        scored = [starts.unscored(r) if r in holdout else 0 for r in records]
        measured = [r.y_or_nan[n:] for r, n in zip(records, scored, strict=True)]
        before, shown = (
            [starts.predict(each, r)[n:] for r, n in zip(records, scored, strict=True)]
            for each in (one, other)
        )
        after = shown
        if drifts:
            steady = of_axis(other.values)
            after = [starts.predict(other, r, steady)[n:] for r, n in zip(records, scored, strict=True)]
        kept = without_glitches(measured, shown) if "outliers" in decision.answer else measured
        y = [m - (s - a) for m, s, a in zip(kept, shown, after, strict=True)]
        drawn = [
            [starts.predict(other, r, of_axis(values))[n:] for r, n in zip(records, scored, strict=True)]
            for values in (some if floor.hidden else ())
        ]
        found = closure_of(y, before, after, drawn, floor, rng)
        return replace(found, rmse_before=rms(measured, before), rmse_after=rms(measured, shown))

    gaps = [closure_on(train, base, fit), closure_on(holdout, base, fit)]
    first = starts.predict(base, holdout[0])[lead:]
    last = starts.predict(fit, holdout[0])[lead:]
    drawn = np.array([starts.predict(fit, holdout[0], values, rng)[lead:] for values in some])
    # No axis leaves where it was by its whole travel: such draws are of a motion that is not stable.
    stable = np.abs(drawn - last).max(axis=1) < fit.response.scale.travel
    doubt = _middle_spread(drawn[stable]) if stable.sum() >= FEWEST_STABLE else np.zeros_like(last)
    after = starts.predict(fit, holdout[0], of_axis(fit.values))[lead:] if drifts else last
    half = NORMAL_HALF_WIDTH * np.sqrt(doubt**2 + spread(fit) ** 2)
    if fit.observer is not None:
        # No simulation follows the motion, whatever the parameters: as far off as on the training records.
        half = np.maximum(half, NORMAL_HALF_WIDTH * spread(unobserved(fit)[0]))
    estimates = {n: Estimate.of(d, posterior.units.get(n, "")) for n, d in posterior.base.items()}
    estimates[NOISE_SIGMA] = Estimate.log_normal(sigma, noise_error / sigma, units.output)
    parameters = {
        n: Estimate.of(d, posterior.units.get(n, ""))
        for n, d in posterior.effects.items()
        if n.split(".")[0] in set(decision.answer) - {OTHER}
    }
    for key, value in found.readings.parameters.items():
        if key.split(".")[0] in decision.answer:
            unit = {"step": units.output, "size": units.output, "sd": "s"}.get(key.split(".")[1], "")
            parameters[key] = Estimate.log_normal(value, 0.1, unit)
    advice = tuple(advice_on(decision.answer, posterior, found, drive))
    verdict = Verdict(
        decision.answer,
        decision.probability,
        decision.confusable,
        _location(train, found, decision, sigma),
        gaps[0],
        gaps[1],
        parameters,
        estimates,
        experiment_for(decision.answer, decision.confusable),
        time.perf_counter() - begin,
        (*notes, *starts.notes, *notes_on_search(found, decision), *advice),
        known=known_verdict(found, posterior, train, holdout, closure_on),
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
        name, train, holdout, found, decision, posterior, verdict, first, after, last - half, last + half,
        corrected, advice,
    )  # fmt: skip


def _predictions(fit: JointFit, values: JointValues, records: Sequence[Record]) -> list[FloatArray]:
    return [fit.response.simulate(values, record.u, record.known).y for record in records]


def _middle_spread(drawn: FloatArray) -> FloatArray:
    """Standard deviation (samples,) of draws (draws, samples) by their middle two thirds: a normal in
    coordinates has a few draws whose response is far from any that the records allow."""
    low, high = np.quantile(drawn, [0.16, 0.84], axis=0)
    return np.asarray((high - low) / 2, dtype=np.float64)


def _location(train: Sequence[Record], found: JointAnswer, decision: JointDecision, sigma: float) -> Location:
    """Block, band and regime of the error of the best model without effects."""
    named = [label for label in decision.answer if label != OTHER]
    share: dict[str, float] = dict.fromkeys(("input", "linear", "drive", "disturbance", "sensor"), 0.0)
    for label, home in LABEL_BLOCKS.items():
        share[home] += decision.probability.get(label, 0.0)
    share["drive"] += 0.4 * decision.probability[OTHER]
    share["disturbance"] += 0.6 * decision.probability[OTHER]
    total = max(sum(share.values()), 1.0)
    share = {home: value / total for home, value in share.items()}
    block: str = "none"
    if decision.answer:
        block = str(LABEL_BLOCKS[named[0]]) if named else max(share, key=lambda b: share[b])
    elif followed := [one for one in found.known if one.accepted]:
        block = BLOCKS[followed[0].way]
    base = found.bare
    predicted = _predictions(base, base.values, train)
    errors = [with_holes(r.y - y, r.measured) for r, y in zip(train, predicted, strict=True)]
    residuals = [without_holes(e) for e in errors]
    rate = train[0].sample_rate_hz
    spectra = [welch(e, rate, nperseg=min(512, len(e)))[1] for e in residuals]
    frequency = welch(residuals[0], rate, nperseg=min(512, min(len(e) for e in residuals)))[0]
    power = np.mean([s[: len(frequency)] for s in spectra], axis=0)
    excess = np.cumsum(np.maximum(power - np.median(power), 0.0)[1:])
    low, high = float(frequency[1]), float(frequency[-1])
    if excess[-1] > 0:
        inside = frequency[1:][(excess / excess[-1] > 0.1) & (excess / excess[-1] <= 0.9)]
        if len(inside):
            low, high = float(inside[0]), float(inside[-1])
    regimes = _regimes(base, train, residuals, sigma)
    segments = tuple(
        float(
            np.sqrt(np.mean(np.concatenate([np.array_split(e, SEGMENTS)[i] for e in residuals]) ** 2)) / sigma
        )
        for i in range(SEGMENTS)
    )
    regime = max(regimes, key=lambda r: regimes[r])
    return Location(block, share, (low, high), regime, regimes, {}, segments)


def _regimes(
    base: JointFit, train: Sequence[Record], residuals: Sequence[FloatArray], sigma: float
) -> dict[str, float]:
    values, e = base.values, np.concatenate(list(residuals))
    runs = [base.response.simulate(values, record.u, record.known) for record in train]
    speed = np.concatenate([np.gradient(run.w) for run in runs])
    v = np.concatenate([run.v for run in runs])
    usual = float(np.sqrt(np.mean(speed**2)))
    turning = np.concatenate([[False], speed[1:] * speed[:-1] < 0])
    masks = {
        "all": np.ones(len(e), dtype=bool),
        "saturated": (v <= values.cascade.lower) | (v >= values.cascade.upper),
        "slow": np.abs(speed) < 0.1 * usual,
        "reversing": np.convolve(turning, np.ones(10), "full")[: len(e)] > 0,
    }
    return {n: float(np.mean(e[m] ** 2) / sigma**2) for n, m in masks.items() if m.sum() >= 20}
