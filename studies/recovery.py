"""What a known axis is worth after its records have been identified and sampled from nothing.

One replicate of a calibration from end to end: records of a known axis go through `identify` and `infer` as
a user's would, and the intervals are held against the true values. How narrow an unbiased interval could be
at best is the Cramer-Rao bound with the true structure known (Van Trees, Detection, Estimation, and
Modulation Theory, part I, section 2.4).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.four_steps import MAX_ORDER, identify
from bayes_hw.identify.noise import autoregression_from_partial, stationary_autoregression
from bayes_hw.identify.output_error import DIFFERENCE_STEP, simulated_outputs
from bayes_hw.infer.inference import Sampled, StartCondition, infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

LEVELS = (0.5, 0.8, INTERVAL_PROBABILITY)
"""Probabilities of the intervals: central ones, and last the reported highest-density one."""

SAME_MODE = 0.15
"""A mode of the fit is one of the axis where the logarithms of their frequencies differ by less."""

NORMAL_REACH = 1.8807936081512509
"""Standard deviations from the middle to either end of a normal variable's 94 % interval."""

LEAST_INFORMATION = 1e-10
"""Eigenvalues of the scaled information below this are set to it: no bound is finite where it is singular."""

WARM_UP = 500
"""Samples of noise with heavy tails that are thrown away before the record begins."""

STATIC = ("saturation.lower", "saturation.upper", "dead_zone.half_width", "velocity_gain", "noise.sigma")


@dataclass(frozen=True)
class TrueNoise:
    """Stationary autoregression of marginal standard deviation `sigma` (output units) and partial
    autocorrelations `partial`; innovations normal, or Student t with `degrees_of_freedom` above two."""

    sigma: float
    partial: tuple[float, ...] = ()
    degrees_of_freedom: float | None = None

    @property
    def autoregression(self) -> FloatArray:
        """phi_1 ... phi_p."""
        return autoregression_from_partial(np.array(self.partial)[:, None])[:, 0]

    @property
    def innovation_sigma(self) -> float:
        """Standard deviation of the innovations, output units."""
        return self.sigma * float(np.sqrt(np.prod(1 - np.square(self.partial))))

    def sequence(self, samples: int, rng: np.random.Generator) -> FloatArray:
        """Noise of shape (samples,)."""
        if self.degrees_of_freedom is None:
            return stationary_autoregression(samples, self.sigma, np.array(self.partial), rng)
        nu = self.degrees_of_freedom
        shocks = rng.standard_t(nu, WARM_UP + samples) * np.sqrt((nu - 2) / nu) * self.innovation_sigma
        polynomial = np.concatenate([[1.0], -self.autoregression])
        return np.asarray(signal.lfilter([1.0], polynomial, shocks), dtype=np.float64)[WARM_UP:]

    @property
    def information(self) -> float:
        """Fisher information about the location of an innovation, one over output units squared.

        (nu + 1) / ((nu + 3) s^2) for Student t of scale s (Lange, Little and Taylor,
        doi 10.1080/01621459.1989.10478852).
        """
        variance = self.innovation_sigma**2
        if self.degrees_of_freedom is None:
            return 1 / variance
        nu = self.degrees_of_freedom
        return (nu + 1) / (nu + 3) * nu / ((nu - 2) * variance)


@dataclass(frozen=True, eq=False)
class KnownAxis:
    """An axis whose true parameters are known, its noise, and records of it."""

    model: HammersteinWiener
    noise: TrueNoise
    records: tuple[Record, ...]

    def true_values(self) -> dict[str, float]:
        """Limits, half width, steady velocity a command, noise and modes by the names of posterior.json."""
        model = self.model
        static = (
            model.saturation.lower,
            model.saturation.upper,
            model.dead_zone.half_width,
            model.linear.velocity_gain(model.sample_rate_hz),
            self.noise.sigma,
        )
        found = dict(zip(STATIC, static, strict=True))
        for number, mode in enumerate(model.dominant_modes, start=1):
            found[f"mode{number}.frequency_hz"] = mode.frequency_hz
            found[f"mode{number}.damping_ratio"] = mode.damping_ratio
        return found


def least_deviations(axis: KnownAxis) -> dict[str, float]:
    """Square roots of the Cramer-Rao bound on every true value but the noise's, the structure of the true
    axis known and all of it free; by name, in the units of the values."""
    parameters = AxisParameters(axis.model, "all")
    names = parameters.names
    centre = as_coordinates(parameters.parameters, parameters.nominal)[:, None]
    steps = DIFFERENCE_STEP * np.eye(len(centre))
    trials = as_values(parameters.parameters, np.concatenate([centre + steps, centre - steps], axis=1))
    polynomial = np.concatenate([[1.0], -axis.noise.autoregression])
    information = np.zeros((len(names), len(names)))
    for output in simulated_outputs(parameters, trials, axis.records):
        slopes = (output[: len(names)] - output[len(names) :]) / (2 * DIFFERENCE_STEP)
        rows = signal.lfilter(polynomial, [1.0], slopes, axis=1)
        information += axis.noise.information * (rows @ rows.T)
    deviations = deviations_of(information)
    wanted = axis.true_values()
    return {
        name: abs(wanted[name]) * float(deviation)
        for name, deviation in zip(names, deviations, strict=True)
        if name in wanted
    }


def deviations_of(information: FloatArray) -> FloatArray:
    """Square roots (n,) of the diagonal of the inverse of an information matrix (n, n), infinite where it
    has none about a parameter."""
    size = np.sqrt(np.diag(information))
    known = size > 0
    result = np.full(len(size), np.inf)
    scaled = information[np.ix_(known, known)] / np.outer(size[known], size[known])
    values, vectors = np.linalg.eigh(scaled)
    spread = np.square(vectors) @ (1 / np.maximum(values, LEAST_INFORMATION))
    result[known] = np.sqrt(spread) / size[known]
    return result


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
    variable at the Cramer-Rao bound. Names are those of the true axis; `lacking` are its modes that the fit
    has not. Besides: `order`, `delay_samples` of the fit, `converged`, `problems`, `failed_tests` of the
    residuals, `cpu_seconds` of identification and of sampling.
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
    bounds = least_deviations(axis)
    found: dict[str, Any] = {"inside": {}, "z": {}, "width": {}, "lacking": [], "estimate": {}}
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
        if np.isfinite(bounds.get(name, np.inf)):
            found["width"][name] = (high - low) / (2 * NORMAL_REACH * bounds[name])
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
