"""A diagnosis from records alone: structure of G, effect and noise inferred together."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import welch

from bayes_hw.arrays import FloatArray
from bayes_hw.csv_output import write_csv
from bayes_hw.errors import InputError
from bayes_hw.files import staged
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.locate import Location
from bayes_hw.gap.answer.shrink import NORMAL_HALF_WIDTH, Closure
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate, Verdict, highest_density_interval
from bayes_hw.gap.case.case import check_records
from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS
from bayes_hw.gap.joint.advice import advice_on, experiment_for
from bayes_hw.gap.joint.corrected_model import corrected_model
from bayes_hw.gap.joint.joint_decision import JointDecision, decide_jointly
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.joint_moves import widened
from bayes_hw.gap.joint.joint_posterior import INFLATION, JointPosterior, dominant_sections, laplace
from bayes_hw.gap.joint.joint_response import JointValues
from bayes_hw.gap.joint.joint_search import JointAnswer, search
from bayes_hw.gap.joint.reading_faults import MASK
from bayes_hw.gap.joint.readings import innovation_sigma
from bayes_hw.gap.joint.remainder import samples_of_variance
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

PREDICTED_DRAWS, FEWEST_STABLE = 40, 5
BOOTSTRAPS = 300
SEGMENTS = 12
MOST_SAMPLES = 40_000
"""Of all records together: from longer ones each record's beginning is used, in proportion."""

OF_ROUNDED = 3.0
"""Factor on standard deviations where readings are rounded, held or late, so that errors are not independent,
or where something without a name remains."""

RANDOM = ("wind", "timing_jitter", "outliers", "encoder_quantization")
"""Labels whose effect no simulation follows."""


@dataclass(frozen=True, eq=False)
class JointDiagnosis:
    """What was found from records alone; predictions (samples,) are of the first record held out."""

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


def diagnose_records(
    records: Sequence[Record],
    holdout: Sequence[Record],
    rng: np.random.Generator,
    *,
    name: str = "records",
    notes: Sequence[str] = (),
    progress: Progress | None = None,
) -> JointDiagnosis:
    """Diagnose `records` without any model; the outputs of `holdout` only score the finished prediction.

    Raises InputError where there is no record, one at another rate or one too short.
    """
    begin = time.perf_counter()
    progress = progress or Progress(quiet=True)
    if not records:
        raise InputError(f"{name}: no record to train on; give at least one")
    check_records(name, records[0].sample_rate_hz, records, holdout)
    whole = sum(len(record) for record in records)
    if whole > MOST_SAMPLES:
        records = [record.split(MOST_SAMPLES / whole)[0] for record in records]
        notes = (
            *notes,
            f"only the beginnings of the records were used, {MOST_SAMPLES} of {whole} samples",
        )
    with one_blas_thread(), np.errstate(all="ignore"):
        found = search(records, progress.say)
        decision = decide_jointly(found)
        unnamed = decision.answer == (OTHER,) and OTHER not in found.fit.labels
        fit = found.base if unnamed else found.fit
        poorly = set(decision.answer) & {"encoder_quantization", "timing_jitter", OTHER}
        sections = dominant_sections(fit)
        posterior = laplace(
            widened(fit), records[0].units, rng, OF_ROUNDED if poorly else INFLATION, sections
        )
        return _finished(
            name, tuple(records), tuple(holdout), found, decision, posterior, tuple(notes), rng, begin
        )


def encoder_sigma(found: JointAnswer, decision: JointDecision, fit: JointFit) -> float:
    """Standard deviation of the encoder's noise, output units, as far as the fit tells."""
    answer = set(decision.answer)
    sigma = fit.point.rms
    if (
        "wind" in answer
        or (OTHER in answer and OTHER not in fit.labels)
        or (answer == {"sensor_drift"} and not fit.labels)
    ):
        sigma = innovation_sigma(fit)
    if "encoder_quantization" in answer and found.readings.step is not None:
        sigma = max(
            float(np.sqrt(max(sigma**2 - found.readings.step**2 / 12, 0.0))), 0.15 * found.readings.step
        )
    return sigma


def noise_doubt(decision: JointDecision) -> float:
    """How far `encoder_sigma` may be off, a share of it: rounding hides noise, unseen motion mimics it."""
    answer = set(decision.answer)
    if "encoder_quantization" in answer:
        return 0.4
    return 0.15 if answer & {"wind", "timing_jitter", OTHER} else 0.02


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
) -> JointDiagnosis:
    fit, base, units = posterior.fit, found.base, train[0].units
    sigma = encoder_sigma(found, decision, fit)
    samples = samples_of_variance(fit.point.residuals)
    noise_error = sigma * (1.5 / np.sqrt(2 * samples) + noise_doubt(decision))
    some = [
        fit.response.values(posterior.coordinates[i])
        for i in rng.choice(len(posterior.coordinates), PREDICTED_DRAWS, replace=False)
    ]
    gaps = []
    for records in (train, holdout):
        y = [r.y for r in records]
        before, after = _predictions(base, base.values, records), _predictions(fit, fit.values, records)
        gaps.append(_closure(y, before, after, sigma, noise_error, rng))
    first = base.response.simulate(base.values, holdout[0].u).y
    last = fit.response.simulate(fit.values, holdout[0].u).y
    drawn = np.array([fit.response.simulate(values, holdout[0].u).y for values in some])
    # No axis leaves where it was by its whole travel: such draws are of a motion that is not stable.
    stable = np.abs(drawn - last).max(axis=1) < fit.response.scale.travel
    spread = _middle_spread(drawn[stable]) if stable.sum() >= FEWEST_STABLE else np.zeros_like(last)
    half = NORMAL_HALF_WIDTH * np.sqrt(spread**2 + _spread(fit) ** 2)
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
        (*notes, *_notes(found, decision), *advice_on(decision.answer, posterior, found)),
    )
    corrected = corrected_model(name, train, posterior, sigma)
    return JointDiagnosis(
        name, train, holdout, found, decision, posterior, verdict, first, last, last - half, last + half,
        corrected,
    )  # fmt: skip


def _predictions(fit: JointFit, values: JointValues, records: Sequence[Record]) -> list[FloatArray]:
    return [fit.response.simulate(values, record.u).y for record in records]


def _middle_spread(drawn: FloatArray) -> FloatArray:
    """Standard deviation (samples,) of draws (draws, samples) by their middle two thirds: a normal in
    coordinates has a few draws whose response is far from any that the records allow."""
    low, high = np.quantile(drawn, [0.16, 0.84], axis=0)
    return np.asarray((high - low) / 2, dtype=np.float64)


def _spread(fit: JointFit) -> float:
    """Standard deviation of a sample about its prediction, glitches left out, output units."""
    weights = fit.response.weights
    if weights is None:
        return fit.point.rms
    errors = [e * w for e, w in zip(fit.point.residuals, weights, strict=True)]
    kept = np.concatenate([e[w < MASK / 2] for e, w in zip(errors, weights, strict=True)])
    return float(np.sqrt(np.mean(kept**2)))


def _closure(
    measured: Sequence[FloatArray],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    sigma: float,
    noise_error: float,
    rng: np.random.Generator,
) -> Closure:
    """Closed fraction 1 - (after^2 - sigma^2) / (before^2 - sigma^2), the noise and the blocks of the records
    drawn anew for its interval."""
    e0 = np.concatenate([y - p for y, p in zip(measured, before, strict=True)])
    e1 = np.concatenate([y - p for y, p in zip(measured, after, strict=True)])
    rmse0, rmse1 = float(np.sqrt(np.mean(e0**2))), float(np.sqrt(np.mean(e1**2)))
    if np.array_equal(e0, e1):
        return Closure(rmse0, rmse1, sigma, 0.0, (0.0, 0.0))

    def closed(a: float, b: float, s: float) -> float:
        reducible = max(a - s**2, 0.01 * a)
        return float(np.clip(1 - max(b - s**2, 0.0) / reducible, -1.0, 1.0))

    parts0 = np.array([np.mean(p**2) for p in np.array_split(e0, 40)])
    parts1 = np.array([np.mean(p**2) for p in np.array_split(e1, 40)])
    draws = []
    for _ in range(BOOTSTRAPS):
        pick = rng.integers(0, 40, 40)
        draws.append(
            closed(parts0[pick].mean(), parts1[pick].mean(), sigma + noise_error * rng.standard_normal())
        )
    low, high = highest_density_interval(np.array(draws), 0.94)
    middle = closed(rmse0**2, rmse1**2, sigma)
    return Closure(rmse0, rmse1, sigma, middle, (min(low, middle), max(high, middle)))


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
    base = found.base
    residuals = [r.y - base.response.simulate(base.values, r.u).y for r in train]
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
    runs = [base.response.simulate(values, record.u) for record in train]
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


def _notes(found: JointAnswer, decision: JointDecision) -> list[str]:
    fit = found.fit
    said = [
        "no model was given: the structure of G, effects and noise were inferred together from the records, "
        f"G with {fit.structure.order} poles and {fit.structure.delay_samples} samples of delay",
        "a longer delay or a further mode is part of such a G and cannot be a gap",
    ]
    said += [
        f"without {label} the records are {found.nats[label]:.0f} nats less likely, G regrown"
        for label in fit.labels
        if label in found.nats and label in decision.answer
    ]
    return said + [
        f"{rival} explains these records about as well as {named}" for named, rival in decision.confusable
    ]


def write_results(diagnosis: JointDiagnosis, out: Path) -> None:
    """verdict.json, holdout_prediction.csv (angles of the encoder), corrected.json: all or none."""
    first = diagnosis.holdout[0]
    angles = {
        "before": diagnosis.before,
        "after": diagnosis.after,
        "lo": diagnosis.low,
        "hi": diagnosis.high,
        "y": first.y_or_nan,
    }
    columns = {"t": first.t} | {name: angle + first.origin for name, angle in angles.items()}
    with staged(out, instead_of=["free_residual.csv"]) as place:
        write_csv(place / "holdout_prediction.csv", columns)
        diagnosis.verdict.write(place / "verdict.json")
        text = json.dumps(diagnosis.corrected, indent=1, allow_nan=False) + "\n"
        (place / "corrected.json").write_text(text, encoding="utf-8")


def summary(diagnosis: JointDiagnosis) -> str:
    """One or two sentences: what the axis lacks and how sure that is."""
    verdict = diagnosis.verdict
    gap = verdict.gap_holdout
    if not verdict.answer:
        return (
            "No structural gap: a cascade inferred from the records and its noise explain them "
            f"({100 * verdict.probability['none']:.3g} % sure)."
        )
    if verdict.answer == (OTHER,):
        sure = 100 * verdict.probability[OTHER]
        return f"Something is missing that no entry of the catalogue explains ({sure:.3g} % sure)."
    parts = [f"{label} ({100 * verdict.probability[label]:.3g} % sure)" for label in verdict.answer]
    said = f"From the records alone: {' and '.join(parts)}. "
    if verdict.answer[0] in RANDOM and not diagnosis.found.fit.labels:
        return said + "It is random, so that no simulation follows it: the band holds it."
    return said + f"With it {100 * max(gap.closed, 0):.3g} % of the reducible error held out is gone."
