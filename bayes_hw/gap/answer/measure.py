"""How far an answer closes the gap, and what its parameters are: the part of a diagnosis that is numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.base_average import averaged_base, noise_beside
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.shrink import (
    DRAWS_SIMULATED,
    Closure,
    closure,
    measured_closure,
    predicted,
    without_glitches,
)
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.repeats import repeated_floor
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH, posterior_draws
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.noise.random_cause import Tracking
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.record import Record

RIVAL_FITS = 3
"""Of a chaotic response, whose distance from the best tells how well its parameters are known."""


@dataclass(frozen=True, eq=False)
class Predictions:
    """Records as predicted, each (samples,), output units: by the base model alone, the angle of the axis
    with the answer, what the encoder shows of it, and angles at posterior draws."""

    before: list[FloatArray]
    after: list[FloatArray]
    shown: list[FloatArray]
    drawn: list[list[FloatArray]]


@dataclass(frozen=True, eq=False)
class Measured:
    """How far the gap shrinks on the records trained on and held out; parameters of the effects and of the
    base model; the encoder's noise `sigma` (output units); the records held out as predicted, with half the
    width (samples,) of the 94 % band of the first; posterior draws (draws, parameters) of the coordinates of
    the hypothesis that they are predicted by, `final`."""

    gap_train: Closure
    gap_holdout: Closure
    parameters: dict[str, Estimate]
    base: dict[str, Estimate]
    sigma: float
    held: Predictions
    half_width: FloatArray
    final: Explanation
    draws: FloatArray


def measure(
    case: Case | SimulatorCase,
    attribution: Attribution,
    decision: Decision,
    calibration: Calibration,
    rng: np.random.Generator,
    each: Each,
) -> Measured:
    """What the answer of `decision` is worth; outputs of the records held out are used to score it only."""
    final = attribution.base if decision.answer == (OTHER,) else decision.explanation
    same = [e for e in attribution.explanations if e.name == final.name and e is not final]
    rivals = [e.fit.coordinates for e in same[:RIVAL_FITS]]
    posterior = posterior_draws(final, rng, rivals, each)
    draws = posterior.values
    sigma = final.encoder_sigma
    if decision.answer == (OTHER,):
        floor = repeated_floor(case.train)
        sigma, _ = noise_beside(decision.explanation, case.model.noise_sigma, floor, calibration)
    error = _error_of_noise(final, sigma)
    some = draws[rng.choice(len(draws), min(DRAWS_SIMULATED, len(draws)), replace=False)]
    if final.cannot_be_predicted:
        error = float(np.hypot(error, calibration.chaos_in_noise * sigma))
    gaps = []
    for commands, records in (
        (case.inputs, case.train),
        (case.held_out_inputs, case.holdout),
    ):
        held = _predictions(attribution.base, final, commands, records, some)
        gaps.append(_closure(attribution.base, final, commands, records, held, some, sigma, error, rng))
    spread = np.sqrt(_marginal_variance(final))
    wide = np.std(np.array([drawn[0] for drawn in held.drawn]), axis=0)
    half = NORMAL_HALF_WIDTH * np.sqrt(wide**2 + spread**2)
    if final.followed is not None:
        half = np.full_like(wide, NORMAL_HALF_WIDTH * gaps[0].rmse_after)
    drawn_sigma = posterior.sigma
    if drawn_sigma is None:
        drawn_sigma = sigma + error * rng.standard_normal(len(draws))
    base = _base_estimates(case, attribution, decision, final, draws, drawn_sigma, calibration, rng)
    estimates = _estimates(final, draws)
    return Measured(gaps[0], gaps[1], estimates, base, sigma, held, half, final, posterior.coordinates)


def _error_of_noise(final: Explanation, sigma: float) -> float:
    """Standard error of the encoder's noise, output units, from a finite number of correlated samples."""
    correlation = final.noise_correlation
    samples = final.fit.readings
    return float(sigma * np.sqrt((1 + correlation**2) / (1 - correlation**2) / (2 * samples)))


def _predictions(
    base: Explanation,
    final: Explanation,
    commands: Sequence[FloatArray],
    records: Sequence[Record],
    some: FloatArray,
) -> Predictions:
    before = _at(base, base.fit.values, commands, records)
    if final is base:
        after = shown = before
    else:
        after = _at(final, final.fit.values, commands, records, drift=False)
        shown = _at(final, final.fit.values, commands, records)
    drawn = [_at(final, values, commands, records, drift=False) for values in some]
    if final.followed is not None:
        after, shown = _mean(drawn), _mean([_at(final, values, commands, records) for values in some])
    return Predictions(before, after, shown, drawn)


def _closure(
    base: Explanation,
    final: Explanation,
    commands: Sequence[FloatArray],
    records: Sequence[Record],
    found: Predictions,
    some: FloatArray,
    sigma: float,
    error: float,
    rng: np.random.Generator,
) -> Closure:
    """How far `final` closes the gap of `base`, as far as records tell beside what is named."""
    outputs = _only_measured(records, [record.y for record in records])
    before, after, shown = (_only_measured(records, x) for x in (found.before, found.after, found.shown))
    if final is base:
        return _unchanged(before, outputs, sigma)
    drawn = [_only_measured(records, each) for each in found.drawn]
    readings = without_glitches(final, outputs, shown)
    correlation = final.noise_correlation
    if final.tracking is Tracking.MEAN_SQUARES:
        drift = _differences(shown, after)
        drifts = []
        if any(np.any(record) for record in drift):
            moved = (_only_measured(records, _at(final, values, commands, records)) for values in some)
            drifts = [
                _differences(_differences(one, angle), drift) for one, angle in zip(moved, drawn, strict=True)
            ]
        steady = _differences(readings, drift)
        closed = measured_closure(before, after, steady, sigma, error, correlation, rng, drifts)
    else:
        hidden = final.tracking is Tracking.HIDDEN
        closed = closure(before, after, drawn, readings, shown, sigma, correlation, rng, hidden)
    return closed.with_errors_of(outputs, before, shown, sigma)


def _estimates(final: Explanation, draws: FloatArray) -> dict[str, Estimate]:
    """Of the effects' own parameters, from draws (draws, parameters), and of the random causes."""
    hypothesis = final.fit.hypothesis
    own = {
        parameter.name: Estimate.of(draws[:, i], parameter.unit)
        for i, parameter in enumerate(hypothesis.parameters)
        if i >= hypothesis.base_count
    }
    if final.cause_of_noise is not None:
        for name, (value, error, unit) in final.cause_of_noise.parameters.items():
            own[name] = Estimate.log_normal(value, error / value, unit)
    return own


def _base_estimates(
    case: Case | SimulatorCase,
    attribution: Attribution,
    decision: Decision,
    final: Explanation,
    draws: FloatArray,
    drawn_sigma: FloatArray,
    calibration: Calibration,
    rng: np.random.Generator,
) -> dict[str, Estimate]:
    """Of the base parameters and the encoder's noise, averaged over explanations by their probability."""
    hypothesis = final.fit.hypothesis
    count = hypothesis.base_count
    known = np.column_stack([draws[:, :count], drawn_sigma])
    within = known if final is decision.explanation else None
    floor = repeated_floor(case.train)
    averaged = averaged_base(attribution, decision, within, case.model.noise_sigma, floor, calibration, rng)
    named = [(p.name, p.unit) for p in hypothesis.parameters[:count]]
    named.append((NOISE_SIGMA, case.model.units.output))
    return {name: Estimate.of(averaged[:, i], unit) for i, (name, unit) in enumerate(named)}


def _at(
    explanation: Explanation,
    values: FloatArray,
    commands: Sequence[FloatArray],
    records: Sequence[Record],
    drift: bool = True,
) -> list[FloatArray]:
    """The prediction of `records`: the last samples of that for `commands`, which may begin earlier."""
    whole = predicted(explanation, values, commands, drift)
    return [y[len(y) - len(record.y) :] for y, record in zip(whole, records, strict=True)]


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
