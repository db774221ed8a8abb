"""What a known axis is worth after its records have been identified and sampled from nothing.

One replicate of a calibration from end to end: records of a known axis go through `identify` and `infer` as
a user's would, and the intervals are held against the true values. How narrow an unbiased interval could be
at best, and whether that one would hold with the same noise, is what `linearised_truth` says.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from linearised_truth import AtBest, linearised_at_truth
from scipy import stats
from true_axis import KnownAxis

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.four_steps import MAX_ORDER, identify
from bayes_hw.infer.inference import Sampled, StartCondition, infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

LEVELS = (0.5, 0.8, INTERVAL_PROBABILITY)
"""Probabilities of the intervals: central ones, and last the reported highest-density one."""

SAME_MODE = 0.15
"""A mode of the fit is one of the axis where the logarithms of their frequencies differ by less."""

NORMAL_REACH = 1.8807936081512509
"""Standard deviations from the middle to either end of a normal variable's 94 % interval."""


def recover(
    axis: KnownAxis,
    rng: np.random.Generator,
    *,
    max_order: int = MAX_ORDER,
    free: Sampled = "all",
    settings: SamplerSettings | None = None,
    found_by: Callable[[Sequence[Record]], HammersteinWiener] | None = None,
    start: StartCondition = "rest",
) -> dict[str, Any]:
    """One replicate, as plain data: `identify`, then `infer`, from the records of `axis` alone.

    `found_by` makes the model in place of `identify`; `start` says how the records begin.

    `inside` says for every true value whether the intervals of LEVELS hold it, and `z` how many posterior
    standard deviations the posterior mean lies above it; `width` is the 94 % interval over that of a normal
    variable at the Cramer-Rao bound. `at_best` says of the estimate linearised at the truth whether its
    intervals hold, and `z_at_best` how many of its standard deviations it lies above the true value. Names
    are those of the true axis; `lacking` are its modes that the fit has not. Besides: `order`,
    `delay_samples` of the fit, `converged`, `problems`, `failed_tests` of the residuals, `cpu_seconds` of
    identification and of sampling.
    """
    begin = time.process_time()
    if found_by is None:
        model = identify(
            axis.records, name="replicate", max_order=max_order, free_start=start == "free"
        ).model
    else:
        model = found_by(axis.records)
    middle = time.process_time()
    inference = infer(model, axis.records, rng, free=free, start=start, settings=settings)
    end = time.process_time()
    posterior = inference.posterior
    best = linearised_at_truth(axis)
    found: dict[str, Any] = {"inside": {}, "z": {}, "width": {}, "lacking": [], "estimate": {}}
    found["at_best"] = {name: inside_at_best(one) for name, one in best.items()}
    found["z_at_best"] = {name: one.error / one.deviation for name, one in best.items()}
    for name, value in axis.true_values().items():
        own = _own_name(posterior, axis.model, name)
        if own is None:
            if name.endswith("frequency_hz"):
                found["lacking"].append(name.partition(".")[0])
            continue
        draws = _draws(posterior, own)
        summary = (posterior.reported | posterior.derived)[own]
        low, high = summary.hdi94
        found["inside"][name] = [
            *(_in_central_interval(draws, value, level) for level in LEVELS[:-1]),
            bool(low <= value <= high),
        ]
        found["z"][name] = (summary.mean - value) / summary.sd
        found["estimate"][name] = [value, summary.mean, summary.sd]
        if name in best:
            found["width"][name] = (high - low) / (2 * NORMAL_REACH * best[name].deviation)
    return found | {
        "order": len(model.linear.poles),
        "delay_samples": model.linear.total_delay,
        "modes": len(model.dominant_modes),
        "noise_order": posterior.noise_order,
        "log_likelihood": float(np.max(posterior.log_probability)),
        "converged": posterior.converged,
        "problems": list(posterior.problems),
        "failed_tests": [test.name for test in inference.residuals.tests if not test.passed],
        "cpu_seconds": [middle - begin, end - middle],
    }


def inside_at_best(best: AtBest) -> list[bool]:
    """Whether the intervals of LEVELS about a normal estimate hold the truth."""
    return [bool(abs(best.error) <= stats.norm.ppf((1 + level) / 2) * best.deviation) for level in LEVELS]


def _own_name(posterior: Posterior, truth: HammersteinWiener, name: str) -> str | None:
    """The name in the posterior of what is `name` in the true axis; None where the fit lacks it."""
    mode, _, quantity = name.partition(".")
    if not mode.startswith("mode"):
        return name if name in posterior.reported or name in posterior.derived else None
    wanted = np.log(truth.dominant_modes[int(mode[4:]) - 1].frequency_hz)
    distances = {
        other.partition(".")[0]: abs(float(np.log(summary.mean)) - wanted)
        for other, summary in posterior.summaries.items()
        if other.startswith("mode") and other.endswith(".frequency_hz")
    }
    nearest = min(distances, key=lambda key: distances[key], default=None)
    return None if nearest is None or distances[nearest] > SAME_MODE else f"{nearest}.{quantity}"


def _draws(posterior: Posterior, name: str) -> FloatArray:
    if name in posterior.names:
        return np.ravel(posterior.chains(name))
    flat = posterior.values.reshape(-1, posterior.values.shape[-1])
    return posterior.axis.velocity_gain(flat[:, : len(posterior.axis.parameters)].T)


def _in_central_interval(draws: FloatArray, truth: float, probability: float) -> bool:
    low, high = np.quantile(draws, [(1 - probability) / 2, (1 + probability) / 2])
    return bool(low <= truth <= high)
