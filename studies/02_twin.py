"""The Nanshan 26 m twin from record to posterior: how good is the model, how sure are its numbers?

The paper's experiment is simulated on the stable representative of its printed model (study 01);
identification and sampling start from the records alone. The paper's own fits on validation records were
94.6 % for the Hammerstein-Wiener model and 86.2 % for a linear one. Writes report.html, report.pdf,
results.json, and the files of identify, sample and predict.
"""

from __future__ import annotations

import numpy as np
from study import headline, start_study

from bayes_hw.analysis import analyse
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.twin import twin_records

PAPER_FIT_PERCENT = {"hammerstein_wiener": 94.6, "linear": 86.2}


def main() -> None:
    study = start_study("02_twin", __doc__)
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
    study.write_report(analysis)
    study.write_results(
        {"paper_fit_percent": PAPER_FIT_PERCENT, "truth": true_values(twin.truth), **headline(analysis)}
    )
    for fit in analysis.fits:
        print(f"{fit.record}: Hammerstein-Wiener {fit.hammerstein_wiener:.1f} %, linear {fit.linear:.1f} %")


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
