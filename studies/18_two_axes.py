"""Azimuth and elevation in one report: what does gravity do to the elevation's numbers if it is left out?

Azimuth is the twin of study 02. Elevation is an axis of the same kind with other limits, modes and dead zone,
whose drive gives way to gravity: a velocity that varies with the cosine of the elevation is added to its
command. Its records start at three elevations. Both axes are identified from their records alone and sampled,
elevation without gravity in the model and with it. Writes report.html, report.pdf, results.json.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from elevation import (
    ELEVATIONS_DEG,
    GRAVITY_DEG_PER_S,
    Gravity,
    corrected,
    elevation_model,
    elevation_records,
    estimate_gravity,
)
from pages.two_axes_report import AxisParameter, IdentifiedAxis, two_axes_report
from study import Study, start_study
from twin import twin_records

from bayes_hw.identify.four_steps import identify
from bayes_hw.infer.inference import Inference, infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.summary import highest_density_interval
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

MAX_STEPS = 400
DURATION_S = 120.0
QUICK_DURATION_S = 30.0
GRAVITY_NODES = ((-np.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (np.sqrt(3.0), 1 / 6))
"""Gauss-Hermite nodes, in standard deviations, and weights: the normal posterior of the gravity term."""

MIXED_DRAWS = 6000
IDENTIFICATIONS = 2
"""Identification and gravity are repeated in turn so many times."""


def main() -> None:
    study = start_study("18_two_axes", __doc__)
    duration = QUICK_DURATION_S if study.quick else DURATION_S
    data_rng, elevation_rng, *rngs = np.random.default_rng(study.seed).spawn(6)
    twin = twin_records(data_rng, duration_s=duration)
    truth = elevation_model(twin.truth)
    raw = elevation_records(truth, elevation_rng, duration)
    azimuth = sampled(study, "azimuth", twin.truth, twin.train, rngs[0])
    without = sampled(study, "elevation without gravity", truth, raw, rngs[1])
    model = without.posterior.mean_model()
    for _ in range(IDENTIFICATIONS):
        gravity = estimate_gravity(model, raw, ELEVATIONS_DEG)
        model = model_for(study, "elevation", truth, corrected(raw, ELEVATIONS_DEG, gravity.value))
    known_rng, *with_rngs = rngs[3].spawn(3)
    found = [
        described("azimuth", [azimuth], [1.0], twin.truth),
        described("elevation without gravity", [without], [1.0], truth),
        with_gravity(study, "elevation with gravity", model, raw, with_rngs[0], truth),
    ]
    known = infer(truth, raw, known_rng, settings=settings(study), jobs=study.jobs, progress=study.progress)
    control = [
        described("gravity left out", [known], [1.0], truth),
        with_gravity(study, "gravity in the model", truth, raw, with_rngs[1], truth),
    ]
    study.write_document(
        two_axes_report(found, control, GRAVITY_DEG_PER_S, study.origin([*twin.train, *raw]))
    )
    study.write_results(
        {
            "gravity_deg_per_s": GRAVITY_DEG_PER_S,
            "axes": [asdict(axis) for axis in found],
            "roots_known": [asdict(axis) for axis in control],
        }
    )
    for axis in (*found, *control):
        lying = [name for name, parameter in axis.parameters.items() if not parameter.covered]
        print(f"{axis.name:28} fit {axis.fit_percent:.1f} %, white {axis.white}, truth outside: {lying}")


def with_gravity(
    study: Study,
    name: str,
    model: HammersteinWiener,
    raw: Sequence[Record],
    rng: np.random.Generator,
    truth: HammersteinWiener,
) -> IdentifiedAxis:
    """The posterior with gravity estimated and its uncertainty mixed in."""
    gravity = estimate_gravity(model, raw, ELEVATIONS_DEG)
    nodes = GRAVITY_NODES[1:2] if study.quick else GRAVITY_NODES
    runs = [
        infer(
            model,
            corrected(raw, ELEVATIONS_DEG, gravity.value + node * gravity.sd),
            node_rng,
            settings=settings(study),
            jobs=study.jobs,
            progress=study.progress,
        )
        for (node, _), node_rng in zip(nodes, rng.spawn(len(nodes)), strict=True)
    ]
    return described(name, runs, [weight for _, weight in nodes], truth, gravity)


def settings(study: Study) -> SamplerSettings:
    """How long every posterior is sampled."""
    return SamplerSettings(walkers=64, max_steps=50) if study.quick else SamplerSettings(max_steps=MAX_STEPS)


def model_for(
    study: Study, name: str, truth: HammersteinWiener, records: Sequence[Record]
) -> HammersteinWiener:
    """The four-step estimate; in the quick form the true model stands in for it."""
    if study.quick:
        return truth
    with study.progress.stage(f"identification of {name}"):
        return identify(records, name=name).model


def sampled(
    study: Study, name: str, truth: HammersteinWiener, records: Sequence[Record], rng: np.random.Generator
) -> Inference:
    """Identified from the records alone, then sampled."""
    infer_rng = rng.spawn(2)[1]
    model = model_for(study, name, truth, records)
    return infer(
        model, records, infer_rng, settings=settings(study), jobs=study.jobs, progress=study.progress
    )


def described(
    name: str,
    runs: Sequence[Inference],
    weights: Sequence[float],
    truth: HammersteinWiener,
    gravity: Gravity | None = None,
) -> IdentifiedAxis:
    """The posterior, mixed over `runs` with `weights`, against the truth; fit and tests of the middle run."""
    middle = runs[len(runs) // 2]
    shares = np.array(weights) / sum(weights)
    rng = np.random.default_rng(0)
    draws = np.concatenate(
        [
            run.posterior.draws(round(share * MIXED_DRAWS), rng)
            for run, share in zip(runs, shares, strict=True)
        ]
    )
    posterior = middle.posterior
    parameters = {
        key: _parameter(draws[:, posterior.names.index(key)], value, posterior.summaries[key].unit)
        for key, value in _true_values(truth).items()
        if key in posterior.names
    }
    if gravity is not None:
        low, high = gravity.value - 1.881 * gravity.sd, gravity.value + 1.881 * gravity.sd
        parameters["gravity"] = AxisParameter(
            GRAVITY_DEG_PER_S, gravity.value, gravity.sd, (low, high), "deg/s"
        )
    return IdentifiedAxis(
        name,
        middle.residuals.fit_percent,
        middle.residuals.white,
        all(run.posterior.converged for run in runs),
        len(posterior.axis.model.linear.poles),
        parameters,
    )


def _parameter(draws: np.ndarray, truth: float, unit: str) -> AxisParameter:
    return AxisParameter(
        truth, float(np.mean(draws)), float(np.std(draws)), highest_density_interval(draws), unit
    )


def _true_values(model: HammersteinWiener) -> dict[str, float]:
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
