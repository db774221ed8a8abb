"""Are the intervals right? Simulation-based calibration of the whole inference, from the priors to the ranks.

Axes are drawn from the priors, records simulated with them, and every posterior is sampled as that of a
measured record; then the ranks of the true values must be uniform and intervals of probability p hold the
truth in a share p. Two likelihoods made wrong on purpose must fail, and an AR order that is too low must
narrow the intervals and fail the residual test. Writes report.html, report.pdf, results.json; finished
replicates stay in OUT/replicates until the results are written, so that a run that was stopped goes on.
"""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import replace

import numpy as np
from calibration_summary import CalibrationStudy, summarize_calibration
from pages.calibration_report import calibration_report
from study import Study, start_study

from bayes_hw import __version__
from bayes_hw.arrays import FloatArray
from bayes_hw.executor import ResultFolder
from bayes_hw.infer.calibration import CalibrationCase, calibrate_once, calibration_tasks
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode

SAMPLE_RATE_HZ = 20.0
SAMPLES = 600
HOLD_SAMPLES = 8
PRIOR_WIDTH = 0.25
SETTINGS = SamplerSettings(ensembles=2, walkers=32, max_steps=400, target_ess=400.0)
REPLICATES = 500
WRONG_REPLICATES = 40
ORDER_REPLICATES = 40
SECOND_ORDER_NOISE = (0.6, 0.5)
ORDERS = (0, 1, 2)


def main() -> None:
    study = start_study("05_calibration", __doc__)
    share = 20 if study.quick else 1
    case = CalibrationCase(axis(), command(), prior_width=PRIOR_WIDTH, settings=SETTINGS)
    second_order = replace(case, partial=SECOND_ORDER_NOISE, fixed_partial=True)
    cases = {
        "right": (case, REPLICATES),
        "sigma_20_percent": (replace(case, sigma_factor=1.2), WRONG_REPLICATES),
        "correlation_ignored": (replace(case, assumed_order=0), WRONG_REPLICATES),
        **{
            f"order_{order}": (replace(second_order, assumed_order=order), ORDER_REPLICATES)
            for order in ORDERS
        },
    }
    executor = study.executor()
    band_rng = np.random.default_rng(study.seed)
    summaries = {}
    for number, (name, (one, count)) in enumerate(cases.items()):
        replicates = executor.map(
            calibrate_once,
            calibration_tasks(one, max(4, count // share), study.seed + 1000 * number),
            progress=study.progress,
            label=name,
            kept=ResultFolder(study.out / "replicates" / name, fingerprint(study, one)),
        )
        summaries[name] = summarize_calibration(replicates, band_rng)
    result = CalibrationStudy(
        case=case,
        right=summaries["right"],
        wrong={
            "sigma taken 20 % too large": summaries["sigma_20_percent"],
            "correlation of the noise ignored": summaries["correlation_ignored"],
        },
        orders={order: summaries[f"order_{order}"] for order in ORDERS},
        order_noise=SECOND_ORDER_NOISE,
    )
    study.write_document(calibration_report(result, study.origin()))
    study.write_results({name: summary.to_dict() for name, summary in summaries.items()})
    shutil.rmtree(study.out / "replicates")
    for name, summary in summaries.items():
        print(
            f"{name:20s} p = {summary.p_value:.4f} (worst: {summary.worst}), {summary.replicates} replicates"
        )


def axis() -> HammersteinWiener:
    """An integrator and two modes, 1.6 Hz and 4 Hz, between a saturation and a dead zone."""
    modes = (Mode(1.6, 0.1), Mode(4.0, 0.08))
    poles = [mode.pole(SAMPLE_RATE_HZ) for mode in modes]
    linear = LinearBlock(
        zeros=np.array([0.3, 0.75 + 0.5j, 0.75 - 0.5j]),
        poles=np.array([1.0, *poles, *np.conj(poles)]),
        gain=0.02,
        delay_samples=1,
    )
    return HammersteinWiener(
        name="calibration axis",
        sample_rate_hz=SAMPLE_RATE_HZ,
        saturation=Saturation(-0.8, 1.0),
        linear=linear,
        dead_zone=DeadZone(0.02),
        dominant_modes=modes,
        noise_sigma=0.01,
    )


def command() -> FloatArray:
    """Steps of random height, each held for 0.4 s: they reach both limits and cross the dead zone."""
    held = np.random.default_rng(3).normal(0.0, 0.9, size=SAMPLES // HOLD_SAMPLES)
    return np.repeat(held, HOLD_SAMPLES)


def fingerprint(study: Study, case: CalibrationCase) -> str:
    """A digest of what decides a replicate."""
    return hashlib.sha256("\x1f".join((__version__, str(study.seed), repr(case))).encode()).hexdigest()


if __name__ == "__main__":
    main()
