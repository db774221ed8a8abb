"""Do the intervals hold when the model comes from the records alone?

Axes are drawn wide (order 3 to 12, up to three light modes, delays up to a second, 10 to 500 Hz, white,
autoregressive and heavy-tailed noise, sweeps, slews and operation records, limits met hardly or often, and
members of the rounding box of the printed model). Each is simulated, identified and sampled from its records
alone, and every interval is held against the truth; its width against the Cramer-Rao bound. Axes of a
simulator of their own at 20 Hz follow, and axes drawn wide whose records were cut while the axis moved (none
of the rounding box: after the cut its records never come near the dead zone), and the check is made to fail:
with the structure chosen through a linear model of order eight at most, everything else as ever. Last, ranks
of the sampler alone with the structure known. Beside every interval stands what the same noise does to the
estimate linearised at the truth. Writes report.html, report.pdf, results.json; finished replicates stay in
OUT/replicates until all are made, so that a run that was stopped, or one of fewer, goes on.
"""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import replace
from typing import Any

import numpy as np
from calibration_summary import CalibrationStudy, summarize_calibration
from pages.end_to_end_report import EndToEndStudy, end_to_end_report
from prior_calibration import CalibrationCase, calibrate_once, calibration_tasks
from recovery_summary import RecoverySummary, summarize_recovery
from study import Study, start_study
from wide_axes import recover_axis

from bayes_hw import __version__
from bayes_hw.arrays import FloatArray
from bayes_hw.executor import ResultFolder
from bayes_hw.identify.four_steps import MAX_ORDER
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode

COUNTS = {"axes": 200, "effect-free": 30, "in-motion": 30, "fault": 12, "ranks": 200}
"""Axes drawn wide, effect-free ones, drawn ones cut while they move, members of the rounding box for the
fault, replicates of the ranks."""

QUICK_AXES, QUICK_RANKS = 1, 4
WRONG_SHARE = 5
"""Replicates of the ranks for one of every likelihood made wrong and of every order of the noise."""

MAX_STEPS = 1500
"""Of the sampler; by default it takes up to 5000."""

SETS: dict[str, dict[str, Any]] = {
    "twin": {"source": "twin", "max_order": MAX_ORDER, "free": "all"},
    "twin_capped": {"source": "twin", "max_order": MAX_ORDER, "free": "all", "linear_proxy": True},
    "wide": {"source": "wide", "max_order": MAX_ORDER, "free": "all"},
    "effect_free": {"source": "effect-free", "max_order": MAX_ORDER, "free": "all"},
    "in_motion": {"source": "drawn", "max_order": MAX_ORDER, "free": "all", "in_motion": True},
}

COUNT_OF = {"wide": "axes", "effect_free": "effect-free", "in_motion": "in-motion"}
"""Which count is that of a set; "fault" for the others."""

SAMPLE_RATE_HZ = 20.0
SAMPLES = 600
HOLD_SAMPLES = 8
PRIOR_WIDTH = 0.25
SETTINGS = SamplerSettings(ensembles=2, walkers=32, max_steps=400, target_ess=400.0)
SECOND_ORDER_NOISE = (0.6, 0.5)
NOISE_ORDERS = (0, 1, 2)


def main() -> None:
    study = start_study("05_calibration", __doc__, counts=COUNTS)
    recovered = {name: recovered_set(study, name) for name in SETS}
    rng = np.random.default_rng(study.seed)
    summaries = {name: summarize_recovery(found, rng) for name, found in recovered.items()}
    ranks = rank_study(study, rng)
    result = EndToEndStudy(
        wide=summaries["wide"],
        effect_free=summaries["effect_free"],
        in_motion=summaries["in_motion"],
        twin=summaries["twin"],
        capped=summaries["twin_capped"],
        axes=tuple(recovered["wide"]),
        members=tuple(zip(recovered["twin"], recovered["twin_capped"], strict=True)),
        most_steps=MAX_STEPS,
        ranks=ranks,
    )
    study.write_document(end_to_end_report(result, study.origin()))
    study.write_results(
        {name: summary.to_dict() for name, summary in summaries.items()}
        | {
            "axes": recovered["wide"],
            "twins": {name: recovered[name] for name in ("twin", "twin_capped")},
            "others": {name: recovered[name] for name in ("effect_free", "in_motion")},
            "ranks": {
                "right": ranks.right.to_dict(),
                **{name: summary.to_dict() for name, summary in ranks.wrong.items()},
            },
        }
    )
    if study.quick or study.counts == COUNTS:
        shutil.rmtree(study.out / "replicates")
    for name, summary in summaries.items():
        print(line_of(name, summary))


def recovered_set(study: Study, name: str) -> list[dict[str, Any]]:
    """The replicates of one of SETS; those kept from a run that was stopped are not made again."""
    count = study.counts[COUNT_OF.get(name, "fault")]
    options = SETS[name] | {"seed": 1000 + study.seed, "max_steps": MAX_STEPS}
    if study.quick:
        count, options = QUICK_AXES, options | {"max_steps": 100}
    digest = hashlib.sha256(f"{__version__} {sorted(options.items())}".encode()).hexdigest()
    found: list[dict[str, Any]] = study.executor().map(
        recover_axis,
        [options | {"index": index} for index in range(count)],
        progress=study.progress,
        label=name,
        kept=ResultFolder(study.out / "replicates" / name, digest),
    )
    return found


def line_of(name: str, summary: RecoverySummary) -> str:
    """One set in a line."""
    held = summary.all_parameters
    return (
        f"{name:12s} {held.inside} of {held.replicates} 94 % intervals hold ({100 * held.achieved:.1f} %), "
        f"p = {summary.p_value:.3g}, converged {summary.converged} of {summary.axes}, median width "
        f"{summary.median_width:.2f} of the bound, {summary.lacking} of {summary.modes} modes lacking"
    )


def rank_study(study: Study, rng: np.random.Generator) -> CalibrationStudy:
    """Ranks among the draws of the sampler alone, with the true structure and axes from its priors."""
    most = QUICK_RANKS if study.quick else study.counts["ranks"]
    fewer = max(QUICK_RANKS, most // WRONG_SHARE)
    case = CalibrationCase(axis(), command(), prior_width=PRIOR_WIDTH, settings=SETTINGS)
    second_order = replace(case, partial=SECOND_ORDER_NOISE, fixed_partial=True)
    cases = {
        "right": (case, most),
        "sigma_20_percent": (replace(case, sigma_factor=1.2), fewer),
        "correlation_ignored": (replace(case, assumed_order=0), fewer),
        **{f"order_{order}": (replace(second_order, assumed_order=order), fewer) for order in NOISE_ORDERS},
    }
    executor = study.executor()
    summaries = {}
    for number, (name, (one, count)) in enumerate(cases.items()):
        replicates = executor.map(
            calibrate_once,
            calibration_tasks(one, count, study.seed + 1000 * number),
            progress=study.progress,
            label=name,
            kept=ResultFolder(study.out / "replicates" / name, fingerprint(study, one)),
        )
        summaries[name] = summarize_calibration(replicates, rng)
    return CalibrationStudy(
        case=case,
        right=summaries["right"],
        wrong={
            "sigma taken 20 % too large": summaries["sigma_20_percent"],
            "correlation of the noise ignored": summaries["correlation_ignored"],
        },
        orders={order: summaries[f"order_{order}"] for order in NOISE_ORDERS},
        order_noise=SECOND_ORDER_NOISE,
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
