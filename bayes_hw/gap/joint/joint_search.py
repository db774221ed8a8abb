"""The search for structure and effects together: grow, prune, advance the delay, verify."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint import joint_kernel as K  # noqa: N812
from bayes_hw.gap.joint.effect_form import FORMS, Form, JointScale
from bayes_hw.gap.joint.effect_screen import best_starts, screened
from bayes_hw.gap.joint.joint_fit import FULL_STEPS, JointFit, highest
from bayes_hw.identify.cascade import Structure
from bayes_hw.gap.joint.noise_causes import NoiseSpectrum, noise_spectrum, speed_noise, speeds
from bayes_hw.gap.joint.reading_faults import MASK, REPEAT_SHARE, glitches, repeats, rounding_step
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.identify.identified_model import dominant_modes
from bayes_hw.identify.growth.score_test import best_candidates
from bayes_hw.identify.growth.delay import at_delay, coarse_delay, safe_delay, too_long, with_longer_delay
from bayes_hw.identify.growth.search import Grown, grow, likeliest, smallest_cascade
from bayes_hw.identify.experiment import white_noise_level
from bayes_hw.record import Record

STARTS_OF_A_LABEL = 3
FIRST_STEPS, KEPT_LABELS, SECOND_STEPS, KEPT_AFTER, FULL = 4, 5, 8, 2, FULL_STEPS
LARGEST_ORDER = 14
VERIFIED_NATS = 25.0
REGROWTHS = 4
MOST_EFFECTS = 3
ROUNDED = 1.6
"""Step over the innovations' standard deviation from which rounding is named."""

SMALLEST_COMMAND, SMALL_ORDER, NOISE_LEVELS = 1e-3, 4, (1.0, 4.0)


@dataclass(frozen=True, eq=False)
class JointAnswer:
    """What the search found: `fit` with its effects, `base` the best without any, the verified nats of every
    label, the best score reached by every label alone, and a log of the moves."""

    fit: JointFit
    base: JointFit
    nats: Mapping[str, float]
    rivals: Mapping[str, float]
    readings: Readings
    remainder: Remainder


def natural_scale(
    records: Sequence[Record], limits: tuple[float, float], gain: float, sigma: float
) -> JointScale:
    """Sizes of the records."""
    largest = max(float(np.abs(record.u).max()) for record in records)
    return JointScale(
        speed=min(abs(limits[0]), abs(limits[1]), largest),
        gain=abs(gain),
        travel=max(float(np.ptp(record.y)) for record in records),
        sigma=sigma,
        samples=max(len(record) for record in records),
        rate_hz=records[0].sample_rate_hz,
    )


def grown_base(records: Sequence[Record], noise_level: float) -> JointFit:
    """The best cascade without effects; of several starts the best at a small order is grown on."""
    commands = np.concatenate([record.u for record in records])
    largest = float(np.abs(commands).max())
    structure = Structure(
        0, True, 0, 0,
        lower=bool(commands.min() < -SMALLEST_COMMAND * largest),
        upper=bool(commands.max() > SMALLEST_COMMAND * largest),
        dead_zone=True,
    )  # fmt: skip
    small = [_largest(grow(smallest_cascade(records, structure, level * noise_level), SMALL_ORDER)) for level in NOISE_LEVELS]
    at = coarse_delay(likeliest(small))
    pool = {at.structure.order: at}
    while True:
        pool = grow(at, LARGEST_ORDER)
        best = min(pool.values(), key=lambda g: g.criterion)
        if not too_long(best):
            break
        at = at_delay(at, safe_delay(best)).descended()
    best = with_longer_delay(best)
    values = best.values
    sigma = best.point.rms
    white = float(np.sqrt(best.point.whitener.sum_of_squares(best.point.residuals) / best.point.samples))
    scale = natural_scale(records, (values.lower, values.upper), values.integrator_residue, min(sigma, white))
    return JointFit.of_grown(best, scale).descended()


def _largest(pool: Mapping[int, Grown]) -> Grown:
    return pool[max(pool)]


def delayed(fit: JointFit) -> JointFit:
    """The delay advanced while the likelihood gains, or does not lose while an order is saved."""
    while True:
        later = fit.later().descended()
        if later.score < fit.score - 0.5:
            return fit
        fit = later


def pruned(fit: JointFit) -> JointFit:
    """Effects, sections and poles taken out while the score improves."""
    while True:
        trials: list[JointFit] = []
        if len(fit.labels) > 1:
            trials += [fit.without_effect(i) for i in range(len(fit.labels))]
        trials += [fit.without_section(i) for i in range(fit.structure.sections)]
        trials += [fit.without_pole(i) for i in range(fit.structure.real_poles)]
        if not trials:
            return fit
        trials = sorted((t.descended(4) for t in trials), key=lambda t: -t.score)[:2]
        best = highest([t.descended() for t in trials])
        if best.score <= fit.score:
            return fit
        fit = best


def larger_cascades(fit: JointFit, count: int = 3) -> list[JointFit]:
    """Fits with one more pole or section, the most promising."""
    real, pairs = best_candidates(fit.response, fit.point, count)  # type: ignore[arg-type]
    found = [fit.with_pole(c.a1) for c in real[:1]]
    return found + [fit.with_section(c.a1, c.a2) for c in pairs if c.a2 is not None]


def regrown(fit: JointFit, steps: int = REGROWTHS) -> JointFit:
    """G grown on as far as the score improves, `steps` poles or sections at most."""
    best = fit = fit.descended()
    failures = 0
    for _ in range(steps):
        trials = sorted((t.descended(6) for t in larger_cascades(fit)), key=lambda t: -t.score)[:2]
        fit = highest([t.descended() for t in trials])
        if fit.score > best.score:
            best, failures = fit, 0
        else:
            failures += 1
            if failures == 2:
                break
    return best


def effect_candidates(fit: JointFit, forms: Sequence[Form], say: Callable[[str], None]) -> list[JointFit]:
    """The best explanations with one more label, descended."""
    present = set(fit.labels)
    starts = screened(fit, [f for f in forms if f.label not in present])
    trials: dict[str, list[JointFit]] = {}
    for label in dict.fromkeys(s.form.label for s in starts):
        own = best_starts([s for s in starts if s.form.label == label], STARTS_OF_A_LABEL)
        trials[label] = [fit.with_effect(s.form, s.values).descended(FIRST_STEPS) for s in own]
    ranked = sorted((t for own in trials.values() for t in own), key=lambda t: -t.score)
    kept: list[JointFit] = []
    for t in ranked:
        if sum(k.labels[-1] == t.labels[-1] for k in kept) < 2 and len({k.labels[-1] for k in kept} | {t.labels[-1]}) <= KEPT_LABELS:
            kept.append(t)
    further = sorted((t.descended(SECOND_STEPS) for t in kept), key=lambda t: -t.score)
    found: dict[str, JointFit] = {}
    for t in further:
        found.setdefault(t.labels[-1], t)
    final = [t.descended() for t in list(found.values())[: KEPT_AFTER + 1]]
    final += list(found.values())[KEPT_AFTER + 1 :]
    say("  screen " + ", ".join(f"{t.names[-1]} {t.score - fit.score:.0f}" for t in sorted(final, key=lambda t: -t.score)))
    return final


def port_candidates(fit: JointFit) -> list[JointFit]:
    """Signal ports of the torques present, and other forms of their law."""
    found = []
    for i, effect in enumerate(fit.values.effects):
        if effect.ports is None:
            continue
        if not effect.ports.signal and fit.structure.sections + fit.structure.real_poles > 0:
            found.append(fit.with_signal(i))
        for form in FORMS:
            if form.label == effect.form.label == "friction" and form is not effect.form and form.base == effect.form.base:
                found += [fit.with_form(i, form, start) for start in form.starts(fit.response.scale)[:1]]
    return found


@dataclass(frozen=True, eq=False)
class Readings:
    """What the readings' own faults ask of the fit: weights of every record and the nats of each label."""

    weights: tuple[FloatArray, ...]
    nats: dict[str, float]
    step: float | None
    parameters: dict[str, float]


def read_faults(fit: JointFit) -> Readings:
    """Rounding, repeats, glitches and errors of timing, from the residuals of a fit."""
    records = fit.response.records
    values = fit.values
    residuals = [record.y - fit.response.simulate(values, record.u).y for record in records]
    innovation = innovation_sigma(fit)
    weights = [np.ones(len(record)) for record in records]
    nats: dict[str, float] = {}
    parameters: dict[str, float] = {}
    step = rounding_step(records)
    if step is not None and step > ROUNDED * innovation:
        share = min(step**2 / 12 / innovation**2, 1.0)
        nats["encoder_quantization"] = 1000.0 * share
        parameters["encoder_quantization.step"] = step
        return Readings(tuple(weights), nats, step, parameters)
    moves = speeds(fit)
    masks = [repeats(record.y, d, innovation) for record, d in zip(records, moves, strict=True)]
    share = float(np.mean(np.concatenate(masks)))
    if share > REPEAT_SHARE:
        nats["timing_jitter"] = 1000.0
        parameters["timing_jitter.share_repeated"] = share
        weights = [np.where(m, MASK, w) for m, w in zip(masks, weights, strict=True)]
    found = glitches([e / w for e, w in zip(residuals, weights, strict=True)])
    if found.present:
        nats["outliers"] = found.nats
        total = sum(len(record) for record in records)
        parameters["outliers.rate"] = found.count / total
        sizes = np.concatenate([e[m] for e, m in zip(residuals, found.masks, strict=True)])
        parameters["outliers.size"] = float(np.sqrt(np.mean(sizes**2)))
        weights = [np.where(m, MASK, w) for m, w in zip(found.masks, weights, strict=True)]
    else:
        noise = speed_noise(fit, [np.where(w > 1, 0.0, e) for e, w in zip(residuals, weights, strict=True)])
        if noise.present:
            nats.setdefault("timing_jitter", noise.nats)
            parameters["timing_jitter.sd"] = noise.jitter / records[0].sample_rate_hz
            level = max(innovation**2 - noise.jitter**2 * float(np.mean(np.concatenate(moves) ** 2)), 0.05 * innovation**2)
            weights = [
                w * np.sqrt(1 + noise.jitter**2 * d**2 / level) for w, d in zip(weights, moves, strict=True)
            ]
    return Readings(tuple(weights), nats, step, parameters)


def innovation_sigma(fit: JointFit) -> float:
    """Standard deviation of the innovations, output units where the weights are one."""
    return float(np.sqrt(fit.point.whitener.sum_of_squares(fit.point.residuals) / fit.point.samples))


def weighted(fit: JointFit, weights: tuple[FloatArray, ...]) -> JointFit:
    """The same explanation under other weights, descended and its G grown on."""
    response = replace(fit.response, weights=weights)
    return regrown(pruned(JointFit(response, evaluate(response, fit.point.coordinates)).descended()), 3)


def search(records: Sequence[Record], say: Callable[[str], None] = lambda text: None) -> JointAnswer:
    """Grow, prune, verify."""
    begin = time.process_time()

    def tell(text: str) -> None:
        say(f"[{time.process_time() - begin:5.1f} s] {text}")

    base = grown_base(records, white_noise_level([record.y for record in records]))
    tell(f"base {base.structure.order} poles, delay {base.structure.delay_samples}, AR {base.point.whitener.order} score {base.score:.1f}")
    readings = read_faults(base)
    if any(np.any(w != 1) for w in readings.weights):
        tell(f"readings: {readings.nats} {readings.parameters}")
        base = weighted(base, readings.weights)
        again = read_faults(replace(base, response=replace(base.response, weights=None)))
        if "outliers" in readings.nats and again.nats.get("outliers", 0) > 0:
            readings = again
            base = weighted(base, readings.weights)
        tell(f"base {base.structure.order} poles, AR {base.point.whitener.order} rms {base.point.rms:.5f}")
    rivals: dict[str, float] = {}
    fit = base
    for step in range(8):
        trials: list[JointFit] = []
        if len(fit.labels) < MOST_EFFECTS:
            trials += effect_candidates(fit, FORMS, tell)
            if step == 0:
                rivals = {t.labels[-1]: t.score - base.score for t in trials}
        structural = port_candidates(fit) + (larger_cascades(fit) if step else [])
        structural = sorted((t.descended(FIRST_STEPS) for t in structural), key=lambda t: -t.score)[:3]
        trials += [t.descended() for t in structural]
        best = highest(trials)
        if best.score <= fit.score:
            break
        gained = best.score - fit.score
        fit = best
        tell(f"{' + '.join(fit.names)}: {gained:.0f} gained, {fit.structure.order} poles, AR {fit.point.whitener.order}, rms {fit.point.rms:.5f}")
        if fit.labels and not readings.nats:
            later = read_faults(fit)
            if later.nats:
                readings = later
                base, fit = weighted(base, later.weights), weighted(fit, later.weights)
                tell(f"readings: {readings.nats} {readings.parameters}")
    if fit.labels:
        fit = pruned(fit)
        tell(f"pruned: {' + '.join(fit.names)}, {fit.structure.order} poles, delay {fit.structure.delay_samples} score {fit.score - base.score:.1f}")
        fit = delayed(fit)
        fit = pruned(fit)
        tell(f"delayed: {' + '.join(fit.names)}, {fit.structure.order} poles, delay {fit.structure.delay_samples} score {fit.score - base.score:.1f}")
    nats: dict[str, float] = {}
    while fit.labels:
        nats = {}
        alternatives = []
        for i, label in enumerate(fit.labels):
            without = regrown(fit.without_effect(i))
            if len(fit.labels) == 1:
                without = highest([without, base])
            nats[label] = fit.score - without.score
            alternatives.append(without)
        tell("verified " + ", ".join(f"{k} {v:.0f}" for k, v in nats.items()))
        weakest = int(np.argmin([nats[label] for label in fit.labels]))
        if nats[fit.labels[weakest]] >= VERIFIED_NATS:
            break
        fit = alternatives[weakest]
        nats = {}
    remainder = remainder_of(fit, readings)
    tell(f"left: {remainder}")
    return JointAnswer(fit, base, nats, rivals, readings, remainder)


@dataclass(frozen=True)
class Remainder:
    """What the final fit leaves: order of its noise, root mean square over innovations, kurtosis of the
    innovations, and the spectra's log-likelihoods."""

    order: int
    ratio: float
    kurtosis: float
    spectrum: NoiseSpectrum


def remainder_of(fit: JointFit, readings: Readings) -> Remainder:
    """Of a fit's weighted residuals."""
    residuals = fit.point.residuals
    whitener = fit.point.whitener
    a = np.concatenate([whitener.apply(e[None, :])[0] for e in residuals])
    modes = [
        (m.frequency_hz, m.damping_ratio)
        for m in dominant_modes(
            fit.structure, fit.values.cascade, fit.response.scale.rate_hz, fit.response.scale.samples / fit.response.scale.rate_hz
        )
    ]
    return Remainder(
        whitener.order,
        float(fit.point.rms / np.sqrt(np.mean(a**2))),
        float(np.mean(a**4) / np.mean(a**2) ** 2 - 3),
        noise_spectrum(fit, residuals, modes),
    )
