"""What do the paper's settings c1 = c2 = c3 = 1 and +-delta cost? Four twins of the Nanshan 26 m axis.

The gains are set free on the twin of study 02, where the paper's settings are true; on one whose dead zone
has unequal slopes and thresholds; on records that never reach a limit; and on records that start away from
zero, at an unknown state, and never come near the dead zone. Writes report.html, report.pdf, results.json.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from study import Study, start_study
from twin import NOISE_CORRELATION, TwinExperiment, coloured_noise, twin_records

from bayes_hw.identifiability.analysis import Identifiability, analyse_identifiability
from bayes_hw.identifiability.freed_gains import GAIN_NEGATIVE, HALF_WIDTH_NEGATIVE, FreedGains
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.inference import StartCondition
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record
from bayes_hw.report.identifiability.identifiability_report import identifiability_report

SLOPE_RATIO = 1.1
THRESHOLD_RATIO = 1.5
SMALL_AMPLITUDE = 0.25
AWAY_FROM_ZERO = 0.5
QUICK_DURATION_S = 60.0


def main() -> None:
    study = start_study("11_gain_identifiability", __doc__)
    data_rng, analysis_rng = np.random.default_rng(study.seed).spawn(2)
    twin = _twin(study, data_rng)
    quiet = _twin(study, data_rng, amplitude=SMALL_AMPLITUDE)
    cases: dict[str, tuple[Sequence[Record], StartCondition]] = {
        "Symmetric twin": (twin.train, "rest"),
        "Asymmetric twin": (asymmetric(twin, data_rng), "rest"),
        "Never at a limit": (quiet.train, "rest"),
        "Never near the dead zone": (displaced(twin, data_rng), "free"),
    }
    if study.quick:
        cases = {name: cases[name] for name in ("Symmetric twin",)}
    settings = SamplerSettings(walkers=64, max_steps=100) if study.quick else SamplerSettings()
    found = {
        name: analyse_identifiability(
            name,
            twin.truth,
            records[:1] if study.quick else records,
            rng,
            start=start,
            settings=settings,
            jobs=study.jobs,
            points=20 if study.quick else 100,
            progress=study.progress,
        )
        for (name, (records, start)), rng in zip(cases.items(), analysis_rng.spawn(len(cases)), strict=True)
    }
    first, *others = found
    report = identifiability_report(
        found[first], study.origin(cases[first][0]), {name: found[name] for name in others}
    )
    study.write_document(report)
    study.write_results(
        {
            "truth": {
                "Asymmetric twin": {"c3/c2": SLOPE_RATIO, "delta+/delta-": 1 / THRESHOLD_RATIO},
            },
            "cases": {name: _without_profiles(result) for name, result in found.items()},
        }
    )
    for name, result in found.items():
        weak = [v.name for v in result.verdicts if v.verdict == "prior-dominated"]
        tests = ", ".join(f"{test.name} = 1 {test.decision}" for test in result.assumptions)
        print(
            f"{name:26} flat directions {result.structure.expected}, invariants within"
            f" {result.agreement.largest:.1f} standard errors, prior-dominated {weak}, {tests}"
        )


def _twin(study: Study, rng: np.random.Generator, **changes: float) -> TwinExperiment:
    if study.quick:
        changes["duration_s"] = QUICK_DURATION_S
    return twin_records(rng, **changes)


def asymmetric(twin: TwinExperiment, rng: np.random.Generator) -> tuple[Record, ...]:
    """The twin's training records with c3 and the negative threshold larger than c2 and the positive one."""
    axis = FreedGains(twin.truth, (GAIN_NEGATIVE, HALF_WIDTH_NEGATIVE))
    values = axis.nominal
    values[axis.names.index(GAIN_NEGATIVE)] = SLOPE_RATIO
    values[axis.names.index(HALF_WIDTH_NEGATIVE)] *= THRESHOLD_RATIO
    outputs = simulated_outputs(axis, values[:, None], twin.train)
    return tuple(
        replace(record, y=output[0] + _noise(twin.truth, len(record), rng))
        for record, output in zip(twin.train, outputs, strict=True)
    )


def displaced(twin: TwinExperiment, rng: np.random.Generator) -> tuple[Record, ...]:
    """The twin's training commands on an axis that starts far from its dead zone."""
    return tuple(
        replace(
            record,
            y=twin.truth.simulate(record.u, AWAY_FROM_ZERO).y + _noise(twin.truth, len(record), rng),
        )
        for record in twin.train
    )


def _noise(model: HammersteinWiener, samples: int, rng: np.random.Generator) -> np.ndarray:
    return coloured_noise(rng, samples, model.noise_sigma, NOISE_CORRELATION)


def _without_profiles(result: Identifiability) -> dict[str, object]:
    """What results.json keeps; profiles and posteriors are in the files of the command."""
    content = result.to_dict()
    return {key: value for key, value in content.items() if key not in ("profiles", "posteriors")}


if __name__ == "__main__":
    main()
