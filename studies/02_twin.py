"""The Nanshan 26 m twin from record to posterior: how good is the model, how sure are its numbers?

The paper's experiment is simulated on the stable representative of its printed model (study 01);
identification and sampling start from the records alone. The paper's own fits on validation records were
94.6 % for the Hammerstein-Wiener model and 86.2 % for a linear one. With --seeds N the whole is repeated
with N other seeds of the noise, and the first page says how often the intervals held; finished ones stay in
OUT/replicates, so that a run that was stopped goes on. Writes report.html, report.pdf, results.json, and the
files of identify, sample and predict.
"""

from __future__ import annotations

import shutil
from typing import Any

import numpy as np
from pages.repeats_section import Repeats, with_repeats
from study import Study, headline, start_study
from twin import twin_records
from twin_seeds import recover_seed, repeats_of

from bayes_hw import __version__
from bayes_hw.analysis import analyse
from bayes_hw.executor import ResultFolder
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

FIRST_SEED = 90210
"""Of the noise of the repeats."""

PAPER_FIT_PERCENT = {"hammerstein_wiener": 94.6, "linear": 86.2}


def main() -> None:
    study = start_study("02_twin", __doc__, counts={"seeds": 1})
    data_rng, analysis_rng = np.random.default_rng(study.seed).spawn(2)
    twin = twin_records(data_rng)
    settings = SamplerSettings(max_steps=200 if study.quick else 3000)
    analysis = analyse(
        "Nanshan 26 m twin, azimuth",
        twin.train[:1] if study.quick else twin.train,
        twin.validation,
        analysis_rng,
        settings=settings,
        jobs=study.jobs,
        progress=study.progress,
        truth=true_values(twin.truth),
    )
    repeats = repeated(study, settings.max_steps)
    study.write_report(analysis, lambda report: with_repeats(report, repeats) if repeats else report)
    study.write_results(
        {
            "paper_fit_percent": PAPER_FIT_PERCENT,
            "truth": true_values(twin.truth),
            **headline(analysis),
            "repeats": None if repeats is None else plain(repeats),
        }
    )
    shutil.rmtree(study.out / "replicates", ignore_errors=True)
    if repeats is not None:
        held = repeats.all_parameters
        print(f"{held.inside} of {held.replicates} intervals held over {repeats.repeats} seeds")
    for fit in analysis.fits:
        print(f"{fit.record}: Hammerstein-Wiener {fit.hammerstein_wiener:.1f} %, linear {fit.linear:.1f} %")


def repeated(study: Study, max_steps: int) -> Repeats | None:
    """The repeats with other seeds, None where one is wanted."""
    seeds = study.counts["seeds"]
    if seeds < 2:
        return None
    results = study.executor().map(
        recover_seed,
        [{"seed": FIRST_SEED + number, "max_steps": max_steps} for number in range(seeds)],
        progress=study.progress,
        label="seeds",
        kept=ResultFolder(study.out / "replicates", f"{__version__} {max_steps}"),
    )
    return repeats_of(results)


def plain(repeats: Repeats) -> dict[str, Any]:
    """The repeats for results.json."""
    return {
        "repeats": repeats.repeats,
        "converged": repeats.converged,
        "held": {
            name: {"hits": one.inside, "trials": one.replicates, "interval95": list(one.interval)}
            for name, one in {**repeats.held, "all": repeats.all_parameters}.items()
        },
        "median_width": dict(repeats.median_width),
    }


def true_values(model: HammersteinWiener) -> dict[str, float]:
    """The twin's parameters under the names of posterior.json; its gain depends on the order chosen."""
    values = {
        "saturation.lower": model.saturation.lower,
        "saturation.upper": model.saturation.upper,
        "dead_zone.half_width": model.dead_zone.half_width,
        "noise.sigma": model.noise_sigma,
    }
    for number, mode in enumerate(model.dominant_modes, start=1):
        values[f"mode{number}.frequency_hz"] = mode.frequency_hz
        values[f"mode{number}.damping_ratio"] = mode.damping_ratio
    return values


if __name__ == "__main__":
    main()
