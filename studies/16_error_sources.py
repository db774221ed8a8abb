"""Which error source of the paper's section 3.3 widens the intervals, and which makes them lie?

The twin of the Nanshan 26 m axis is recorded with a tenth of study 02's noise, and then with one error source
at a time: the noise itself, quantization, sampling, a model of too low an order, a structure that the model
lacks. All sources see the same draws of the noise. Writes report.html, report.pdf, results.json.
"""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
from error_sources import REFERENCE, SOURCES, Source
from pages.error_sources_report import ErrorSource, ParameterError, error_sources_report
from study import Study, start_study
from twin import NOISE_CORRELATION, coloured_noise, twin_records

from bayes_hw.infer.inference import Inference, infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

REPLICATES = 3
QUICK_DURATION_S = 60.0
DURATION_S = 120.0
MAX_STEPS = 300


def main() -> None:
    study = start_study("16_error_sources", __doc__)
    twin = twin_records(
        np.random.default_rng(study.seed), duration_s=QUICK_DURATION_S if study.quick else DURATION_S
    )
    commands = twin.train[:1] if study.quick else twin.train
    sources = [REFERENCE, SOURCES[5]] if study.quick else [REFERENCE, *SOURCES]
    found = []
    with study.progress.task("error sources", len(sources)) as task:
        for number, source in enumerate(sources):
            found.append(examined(study, source, twin.truth, commands))
            task.reach(number + 1, source.name)
    study.write_document(error_sources_report(found, study.origin(commands)))
    study.write_results({"sources": [asdict(source) for source in found]})
    for source in found:
        lying = [name for name, error in source.parameters.items() if error.lies]
        print(f"{source.name:24} residuals white {source.white} of {source.replicates}, lies: {lying}")


def examined(
    study: Study, source: Source, truth: HammersteinWiener, commands: tuple[Record, ...]
) -> ErrorSource:
    """The posterior of every replicate of one source, against the truth."""
    settings = (
        SamplerSettings(walkers=64, max_steps=50) if study.quick else SamplerSettings(max_steps=MAX_STEPS)
    )
    runs = []
    for replicate in range(1 if study.quick else REPLICATES):
        noise_rng, reading_rng, infer_rng = np.random.default_rng([study.seed, replicate]).spawn(3)
        records = [_recorded(source, truth, record, noise_rng, reading_rng) for record in commands]
        model = source.fitted(truth, records)
        runs.append(infer(model, records, infer_rng, settings=settings, jobs=study.jobs))
    return ErrorSource(
        source.name,
        source.family,
        source.strength,
        len(runs),
        sum(run.residuals.white for run in runs),
        sum(run.posterior.converged for run in runs),
        {
            name: _error(name, value, runs)
            for name, value in true_values(truth).items()
            if name in runs[0].posterior.names
        },
    )


def _recorded(
    source: Source,
    truth: HammersteinWiener,
    record: Record,
    noise_rng: np.random.Generator,
    reading_rng: np.random.Generator,
) -> Record:
    noise = coloured_noise(noise_rng, len(record), source.noise_share * truth.noise_sigma, NOISE_CORRELATION)
    return replace(
        record, y=source.reading(source.truth(truth, record.u) + noise, record.sample_rate_hz, reading_rng)
    )


def _error(name: str, truth: float, runs: list[Inference]) -> ParameterError:
    summaries = [run.posterior.summaries[name] for run in runs]
    return ParameterError(
        truth=truth,
        bias=float(np.mean([summary.mean for summary in summaries]) - truth),
        half_width=float(np.mean([(summary.hdi94[1] - summary.hdi94[0]) / 2 for summary in summaries])),
        misses=sum(not summary.hdi94[0] <= truth <= summary.hdi94[1] for summary in summaries),
        unit=summaries[0].unit,
    )


def true_values(model: HammersteinWiener) -> dict[str, float]:
    """The limits, the dead zone and the modes under the names of posterior.json."""
    values = {
        "saturation.lower": model.saturation.lower,
        "saturation.upper": model.saturation.upper,
        "dead_zone.half_width": model.dead_zone.half_width,
    }
    for number, mode in enumerate(model.dominant_modes, start=1):
        values[f"mode{number}.frequency_hz"] = mode.frequency_hz
        values[f"mode{number}.damping_ratio"] = mode.damping_ratio
    return values


if __name__ == "__main__":
    main()
