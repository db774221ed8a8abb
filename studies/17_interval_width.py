"""How do the 94 % intervals shrink with the length, the amplitude and the kind of the sweep?

Experiments on the twin of the Nanshan 26 m axis, all with the same noise: sweeps of 30 to 960 s, of 0.05 to 1
deg/s, and other commands of one length and amplitude; one starts far from the dead zone. Each is sampled, and
every parameter gets the verdict of `bayes-hw identifiability`. Writes report.html, report.pdf, results.json.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np
from pages.interval_width_report import Experiment, ParameterWidth, interval_width_report
from study import Study, start_study
from twin import NOISE_CORRELATION, coloured_noise, twin_records

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.prior_sensitivity import power_scaling
from bayes_hw.identifiability.profile import profile_likelihoods
from bayes_hw.identifiability.verdict import verdict_on
from bayes_hw.infer.inference import Inference, StartCondition, infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.excitation import (
    amplitude_modulated_sweep,
    balancing_offset,
    phase_modulated_sweep,
    random_phase_multisine,
    sine_sweep,
    staircase,
)
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

RATE_HZ = 20.0
STOP_HZ = 5.0
LENGTH_S = 120.0
AMPLITUDE = 0.5
LENGTHS_S = (30.0, 60.0, 120.0, 240.0, 480.0, 960.0)
AMPLITUDES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)
OFFSET_SHARES = (0.4, 1.6)
START_PHASE_RAD = -np.pi / 4
AWAY_DEG = 0.5
MAX_STEPS = 400

Command = Callable[[np.random.Generator, float, float], FloatArray]


def plain(_rng: np.random.Generator, length_s: float, amplitude: float) -> FloatArray:
    """The paper's sweep."""
    return sine_sweep(RATE_HZ, length_s, amplitude, 0.0, STOP_HZ, start_phase_rad=START_PHASE_RAD)


def amplitude_modulated(_rng: np.random.Generator, length_s: float, amplitude: float) -> FloatArray:
    """The paper's first proposal."""
    return amplitude_modulated_sweep(
        RATE_HZ, length_s, amplitude, modulation_hz=0.1, start_phase_rad=START_PHASE_RAD
    )


def phase_modulated(_rng: np.random.Generator, length_s: float, amplitude: float) -> FloatArray:
    """The paper's second proposal."""
    return phase_modulated_sweep(
        RATE_HZ, length_s, amplitude, modulation_hz=0.05, deviation_rad=8.0, start_phase_rad=START_PHASE_RAD
    )


def multisine(rng: np.random.Generator, length_s: float, amplitude: float) -> FloatArray:
    """Equal sines up to the sweep's last frequency, of the sweep's rms."""
    return random_phase_multisine(rng, RATE_HZ, length_s, amplitude / np.sqrt(2), 0.05, STOP_HZ)


def stairs(_rng: np.random.Generator, length_s: float, amplitude: float) -> FloatArray:
    """Steps of a second each."""
    repeats = max(1, round(length_s / 6))
    return staircase(RATE_HZ, 1.0, (amplitude, 0.5 * amplitude, 0.2 * amplitude), repeats)


KINDS: dict[str, Command] = {
    "sweep": plain,
    "amplitude-modulated": amplitude_modulated,
    "phase-modulated": phase_modulated,
    "multisine": multisine,
    "staircase": stairs,
}


def main() -> None:
    study = start_study("17_interval_width", __doc__)
    truth = twin_records(np.random.default_rng(study.seed)).truth
    lengths, amplitudes, kinds = LENGTHS_S, AMPLITUDES, KINDS
    if study.quick:
        lengths, amplitudes, kinds = (20.0, 40.0), (AMPLITUDE,), {}
    plan = [
        *(("length", f"{length:g} s", length, plain, length, AMPLITUDE, 0.0) for length in lengths),
        *(("amplitude", f"{a:g} deg/s", a, plain, min(lengths[-1], LENGTH_S), a, 0.0) for a in amplitudes),
        *(("kind", name, 0.0, command, LENGTH_S, AMPLITUDE, 0.0) for name, command in kinds.items()),
    ]
    if not study.quick:
        plan.append(("kind", f"sweep {AWAY_DEG:g} deg away", 0.0, plain, LENGTH_S, AMPLITUDE, AWAY_DEG))
    found = []
    with study.progress.task("experiments", len(plan)) as task:
        for number, (series, label, setting, command, length, amplitude, away) in enumerate(plan):
            found.append(experiment(study, truth, series, label, setting, command, length, amplitude, away))
            task.reach(number + 1, label)
    report = interval_width_report(
        found, (truth.saturation.lower, truth.saturation.upper), study.origin(), length_s=LENGTH_S
    )
    study.write_document(report)
    study.write_results({"experiments": [asdict(each) for each in found]})
    for each in found:
        weak = [name for name, width in each.widths.items() if width.verdict == "prior-dominated"]
        print(f"{each.series:10} {each.label:22} prior-dominated {weak}, converged {each.converged}")


def experiment(
    study: Study,
    truth: HammersteinWiener,
    series: str,
    label: str,
    setting: float,
    command: Command,
    length_s: float,
    amplitude: float,
    away_deg: float,
) -> Experiment:
    """Two records on either side of zero, their posterior and the verdicts."""
    settings = (
        SamplerSettings(walkers=32, max_steps=75) if study.quick else SamplerSettings(max_steps=MAX_STEPS)
    )
    rng, noise_rng, infer_rng = np.random.default_rng(study.seed).spawn(3)
    u = command(rng, length_s, amplitude)
    balance = balancing_offset(u, truth.saturation)
    records = [
        _record(truth, f"record_{i}", u + share * balance, away_deg, noise_rng)
        for i, share in enumerate(OFFSET_SHARES, start=1)
    ]
    start: StartCondition = "free" if away_deg else "rest"
    run = infer(truth, records, infer_rng, start=start, settings=settings, jobs=study.jobs)
    verdicts = _verdicts(run, records)
    commands = np.concatenate([record.u for record in records])
    intervals = {name: summary.hdi94 for name, summary in run.posterior.summaries.items()}
    axis = run.posterior.axis
    return Experiment(
        series,
        label,
        setting,
        (float(commands.min()), float(commands.max())),
        float(np.mean([truth.simulate(record.u, away_deg).y == 0 for record in records])),
        run.posterior.converged,
        {
            name: ParameterWidth((intervals[name][1] - intervals[name][0]) / 2, float(value), *verdicts[name])
            for name, value in zip(axis.names, axis.nominal, strict=True)
            if not name.startswith("start")
        },
    )


def _record(
    truth: HammersteinWiener, name: str, u: FloatArray, away_deg: float, rng: np.random.Generator
) -> Record:
    noise = coloured_noise(rng, len(u), truth.noise_sigma, NOISE_CORRELATION)
    y = truth.simulate(u, away_deg).y + noise
    return Record(name, np.arange(len(u)) / RATE_HZ, u, y, RATE_HZ, truth.units, source="simulated")


def _verdicts(run: Inference, records: Sequence[Record]) -> dict[str, tuple[str, str]]:
    posterior, noise = run.posterior, run.start.noise
    axis = posterior.axis
    estimate = posterior.point_estimate[: len(axis.parameters)]
    found = profile_likelihoods(axis, estimate, records, noise.autoregression, noise.innovation_sigma)
    profiles = {profile.name: profile for profile in found}
    scaling = power_scaling(posterior, LogPosterior(axis, posterior.noise_parameters, records))
    verdicts = [
        verdict_on(name, posterior.contraction[name], profile, scaling.get(name))
        for name, profile in profiles.items()
    ]
    return {each.name: (each.verdict, each.reason) for each in verdicts}


if __name__ == "__main__":
    main()
