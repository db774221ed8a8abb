"""The whole diagnosis of one case: base, where, which, how far, verdict."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.csv_output import write_csv
from bayes_hw.files import staged
from bayes_hw.gap.answer.base_average import averaged_base, noise_beside
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.confusable import confusable_pairs, next_experiment
from bayes_hw.gap.answer.decide import Decision, best_of_sets, choose, chosen_among, decide, remains_of
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.locate import locate
from bayes_hw.gap.answer.notes import notes_on
from bayes_hw.gap.answer.shrink import (
    DRAWS_SIMULATED,
    Closure,
    closure,
    hides_motion,
    measured_closure,
    moves_unseen,
    predicted,
    without_glitches,
)
from bayes_hw.gap.answer.unknown_noise import (
    first_sigma,
    of_the_gap,
    with_plain_estimates,
    without_small_seconds,
)
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate, Verdict
from bayes_hw.gap.answer.white_choice import white_choice
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.repeats import repeated_floor
from bayes_hw.gap.case.scale import axis_scale
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.criticism.block_functions import block_surprises
from bayes_hw.gap.criticism.latent_force import free_residual
from bayes_hw.gap.criticism.left_out import LeftOut, compare_left_out
from bayes_hw.gap.criticism.leftover import leftovers
from bayes_hw.gap.effects.any_simulator import STOCHASTIC_ON_OUTPUT, effects_for
from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS, catalogue
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.draws import posterior_draws
from bayes_hw.gap.fit.exact_maximum import with_exact_maxima
from bayes_hw.gap.fit.explanation import Explanation, is_far_ahead
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.fit.interval import NORMAL_HALF_WIDTH
from bayes_hw.gap.search.attribute import Attribution, Attributor
from bayes_hw.gap.simulate.builder import Builder
from bayes_hw.gap.simulate.chain import ChainBuilder
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder, simulator_scale
from bayes_hw.identify.holes import masks_of
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

UNKNOWN_NOISE_SHARE = 1e-3
"""Of the travel: the noise assumed to start with where the model names none."""

RIVAL_FITS = 3
"""Of a chaotic response, whose distance from the best tells how well its parameters are known."""

FREE_RESIDUAL = "free_residual.csv"

SECONDS_FOR_DRAWS = 20.0
"""Only a slow simulator takes them; it then makes do with fewer draws."""

CHAOS_IN_NOISE = 0.1
"""Share by which the noise's estimate beside a chaotic response may be off: some of its motion passes for it.

Of 17 simulated backlashes in the compliance 13 estimates were within it, the others above.
"""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a report needs: the case, fits, decision, predictions of the first record held out.

    `left_out` compares sets of labels by how they predict blocks of the training records left out.
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


def diagnose(
    case: Case | SimulatorCase,
    rng: np.random.Generator,
    *,
    jobs: int = 1,
    without: frozenset[str] = frozenset(),
    calibration: Calibration | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose one case; labels in `without` are struck from the catalogue.

    The outputs of the records held out are used to score the finished prediction only.
    """
    begin = time.perf_counter()
    progress = progress or Progress(quiet=True)
    calibration = calibration or Calibration.built_in()
    with one_blas_thread(), np.errstate(all="ignore"):
        nominal = case.model.noise_sigma
        base, effects, labels = _posed(case, without)
        inputs = list(base.inputs)
        measured = [record.y for record in case.train]
        chosen = partial(chosen_among, nominal_sigma=nominal, calibration=calibration)
        attributor = Attributor(base, measured, effects, frozenset(labels), rng, jobs, progress.say, chosen)
        attribution = attributor.run()
        if not nominal > 0:
            attribution = without_small_seconds(attribution)
        best, scores = choose(attribution, nominal, calibration)
        attribution = replace(attribution, explanations=with_exact_maxima(attribution.explanations, best))
        best, scores = choose(attribution, nominal, calibration)
        progress.say("what is left")
        left = leftovers(best, inputs, nominal)
        if not nominal > 0:
            left = of_the_gap(left, best, attribution.base)
        surprises = block_surprises(attribution.base.fit, inputs)
        ahead = is_far_ahead(attribution.explanations)
        remains = remains_of(attribution.base, best, left, surprises, ahead)
        decision = decide(best, scores, remains, labels, calibration)
        if not nominal > 0:
            attribution, decision = with_plain_estimates(attribution, decision, measured)
        final = attribution.base if decision.answer == (OTHER,) else decision.explanation
        progress.say("how far")
        return _finished(
            case,
            attribution,
            decision,
            final,
            inputs,
            scores,
            calibration,
            rng,
            begin,
            Each(jobs),
        )


def _posed(
    case: Case | SimulatorCase, without: frozenset[str]
) -> tuple[Hypothesis, tuple[Effect, ...], list[str]]:
    """The base hypothesis, the effects to try and every label in question."""
    nominal = case.model.noise_sigma
    travel = max(float(np.ptp(record.y)) for record in case.train)
    floor = repeated_floor(case.train)
    sigma = nominal if nominal > 0 else min(floor, UNKNOWN_NOISE_SHARE * travel)
    inputs = [record.u for record in case.train]
    masks = masks_of(case.train)
    unread = None if masks is None else tuple(~mask for mask in masks)
    builder: Builder
    if isinstance(case, Case):
        builder = chains = ChainBuilder(case.model)
        train = chains.train(chains.axis.nominal)
        scale = axis_scale(case.model, case.train, sigma, train.stiffness)
        effects, known = catalogue(without), set(LABEL_BLOCKS)
    else:
        builder = SimulatorBuilder(case.model)
        scale = simulator_scale(case.model, case.train, sigma)
        if not nominal > 0:
            sigma = (
                floor
                if np.isfinite(floor)
                else first_sigma(
                    Hypothesis(builder, scale, inputs, unread=unread), [record.y for record in case.train]
                )
            )
            scale = simulator_scale(case.model, case.train, sigma)
        effects, known = effects_for(scale, case.model.force_door, without), set(STOCHASTIC_ON_OUTPUT)
    known |= {effect.label for effect in effects}
    labels = [label for label in LABEL_BLOCKS if label in known - without]
    labels += sorted(known - without - set(labels))
    return Hypothesis(builder, scale, inputs, unread=unread), effects, labels


def _finished(
    case: Case | SimulatorCase,
    attribution: Attribution,
    decision: Decision,
    final: Explanation,
    inputs: Sequence[FloatArray],
    scores: dict[tuple[str, ...], float],
    calibration: Calibration,
    rng: np.random.Generator,
    begin: float,
    each: Each,
) -> Diagnosis:
    hypothesis = final.fit.hypothesis
    same = [e for e in attribution.explanations if e.name == final.name and e is not final]
    rivals = [e.fit.coordinates for e in same[:RIVAL_FITS]]
    posterior = posterior_draws(final, rng, SECONDS_FOR_DRAWS, rivals, each)
    draws = posterior.values
    sigma = final.encoder_sigma
    if decision.answer == (OTHER,):
        sigma, _ = noise_beside(decision.explanation, case.model.noise_sigma, repeated_floor(case.train))
    correlation = final.noise_correlation
    samples = final.fit.readings
    noise_error = sigma * np.sqrt((1 + correlation**2) / (1 - correlation**2) / (2 * samples))
    some = draws[rng.choice(len(draws), min(DRAWS_SIMULATED, len(draws)), replace=False)]
    if final.cannot_be_predicted:
        noise_error = float(np.hypot(noise_error, CHAOS_IN_NOISE * sigma))
    base = attribution.base
    gaps: list[Closure] = []
    before_held: list[FloatArray] = []
    after_held: list[FloatArray] = []
    shown_held: list[FloatArray] = []
    draws_held: list[list[FloatArray]] = []
    for commands, records in ((list(inputs), case.train), (case.held_out_inputs, case.holdout)):
        at = partial(_predicted_ends, commands, [len(record) for record in records])
        read = partial(_only_measured, records)
        outputs = read([record.y for record in records])
        before = at(base, base.fit.values)
        after = before if final is base else at(final, final.fit.values, drift=False)
        shown = before if final is base else at(final, final.fit.values)
        drawn = [at(final, values, drift=False) for values in some]
        if final.followed is not None:
            after, shown = _mean(drawn), _mean([at(final, values) for values in some])
        if final is base:
            gaps.append(_unchanged(read(before), outputs, sigma))
        else:
            seen_before, seen_after, seen = read(before), read(after), read(shown)
            seen_drawn = [read(each) for each in drawn]
            readings = without_glitches(final, outputs, seen)
            if moves_unseen(final) or final.cannot_be_predicted:
                drift = _differences(seen, seen_after)
                drifts = []
                if any(np.any(record) for record in drift):
                    drifts = [
                        _differences(_differences(read(at(final, values)), angle), drift)
                        for values, angle in zip(some, seen_drawn, strict=True)
                    ]
                steady = _differences(readings, drift)
                found = measured_closure(
                    seen_before, seen_after, steady, sigma, noise_error, correlation, rng, drifts
                )
            else:
                hidden = hides_motion(final)
                found = closure(
                    seen_before, seen_after, seen_drawn, readings, seen, sigma, correlation, rng, hidden
                )
            gaps.append(found.with_errors_of(outputs, seen_before, seen, sigma))
        before_held, after_held, shown_held, draws_held = before, after, shown, drawn
    spread = np.sqrt(_marginal_variance(final))
    first = np.array([d[0] for d in draws_held])
    wide = np.std(first, axis=0)
    half = NORMAL_HALF_WIDTH * np.sqrt(wide**2 + spread**2)
    if final.followed is not None:
        half = np.full_like(wide, NORMAL_HALF_WIDTH * gaps[0].rmse_after)
    names = [p.name for p in hypothesis.parameters]
    units = [p.unit for p in hypothesis.parameters]
    count = hypothesis.base_count
    own = {n: Estimate.of(draws[:, i], units[i]) for i, n in enumerate(names) if i >= count}
    if final.cause_of_noise is not None:
        for name, (value, error, unit) in final.cause_of_noise.parameters.items():
            own[name] = Estimate.log_normal(value, error / value, unit)
    drawn_sigma = posterior.sigma
    if drawn_sigma is None:
        drawn_sigma = sigma + noise_error * rng.standard_normal(len(draws))
    known = np.column_stack([draws[:, :count], drawn_sigma])
    within = known if final is decision.explanation else None
    floor = repeated_floor(case.train)
    averaged = averaged_base(attribution, decision, within, case.model.noise_sigma, floor, calibration, rng)
    base_names, base_units = [*names[:count], NOISE_SIGMA], [*units[:count], case.model.units.output]
    base_estimates = {name: Estimate.of(averaged[:, i], base_units[i]) for i, name in enumerate(base_names)}
    where = locate(attribution, decision, inputs, sigma)
    confusable = confusable_pairs(decision.answer, scores)
    left_out = compare_left_out(best_of_sets(attribution))
    verdict = Verdict(
        decision.answer,
        decision.probability,
        confusable,
        where,
        gaps[0],
        gaps[1],
        own,
        base_estimates,
        next_experiment(decision.answer, confusable),
        time.perf_counter() - begin,
        notes_on(case, attribution, decision, left_out),
        white_choice(attribution),
    )
    return Diagnosis(
        case,
        attribution,
        decision,
        verdict,
        before_held[0],
        after_held[0],
        shown_held[0] - half,
        shown_held[0] + half,
        left_out,
    )


def _predicted_ends(
    commands: Sequence[FloatArray],
    lengths: Sequence[int],
    explanation: Explanation,
    values: FloatArray,
    drift: bool = True,
) -> list[FloatArray]:
    """The last samples, as many as `lengths` say, of the prediction for every command."""
    whole = predicted(explanation, values, commands, drift)
    return [y[len(y) - length :] for y, length in zip(whole, lengths, strict=True)]


def _only_measured(records: Sequence[Record], signals: Sequence[FloatArray]) -> list[FloatArray]:
    """Of a signal (samples,) a record the samples that were measured."""
    return [
        y if record.measured is None else y[record.measured]
        for record, y in zip(records, signals, strict=True)
    ]


def _mean(drawn: Sequence[Sequence[FloatArray]]) -> list[FloatArray]:
    """Mean (samples,) of the draws, a record each: of motion that is lost no single simulation is near."""
    return [np.mean(record, axis=0) for record in zip(*drawn, strict=True)]


def _differences(these: Sequence[FloatArray], those: Sequence[FloatArray]) -> list[FloatArray]:
    return [one - other for one, other in zip(these, those, strict=True)]


def _unchanged(before: Sequence[FloatArray], outputs: Sequence[FloatArray], sigma: float) -> Closure:
    error = np.concatenate([y - b for y, b in zip(outputs, before, strict=True)])
    rmse = float(np.sqrt(np.mean(error**2)))
    return Closure(rmse, rmse, sigma, 0.0, (0.0, 0.0))


def _marginal_variance(explanation: Explanation) -> float:
    """Variance of a measured sample about the prediction, output units squared."""
    residual = float(np.mean(np.concatenate(explanation.fit.free_residuals) ** 2))
    return max(residual, explanation.fit.whitener.sigma**2 if explanation.stochastic is None else residual)


def diagnose_case(
    folder: Path,
    out: Path,
    seed: int,
    *,
    jobs: int = 1,
    without: str = "",
    calibration: Calibration | None = None,
) -> Diagnosis:
    """Diagnose the case in `folder` and write verdict.json and holdout_prediction.csv to `out`.

    `without` names labels to strike from the catalogue, joined by commas. One thread, since where many cases
    are diagnosed a process works on each.
    """
    case = Case.read(folder)
    struck = frozenset(without.split(",")) - {""}
    rng = np.random.default_rng(seed)
    diagnosis = diagnose(case, rng, jobs=jobs, without=struck, calibration=calibration)
    write_results(diagnosis, out)
    return diagnosis


def write_results(diagnosis: Diagnosis, out: Path) -> None:
    """verdict.json and holdout_prediction.csv; where the answer is `other`, free_residual.csv too.

    All or none: see `staged`.
    """
    held = diagnosis.case.holdout[0]
    angles = {
        "before": diagnosis.before,
        "after": diagnosis.after,
        "lo": diagnosis.low,
        "hi": diagnosis.high,
    }
    columns = {"t": held.t} | {name: angle + held.origin for name, angle in angles.items()}
    with staged(out, instead_of=[FREE_RESIDUAL]) as place:
        write_csv(place / "holdout_prediction.csv", columns)
        if diagnosis.verdict.answer == (OTHER,):
            noise = diagnosis.decision.explanation.encoder_noise
            write_csv(place / FREE_RESIDUAL, free_residual(diagnosis.attribution.base.fit, noise))
        diagnosis.verdict.write(place / "verdict.json")
