"""Predictive bands of a record under the posterior, and how well they cover it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import autocorrelation_time
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.start_state import with_start_state
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.sample_rate import check_rates
from bayes_hw.model.streaming import simulated_blocks
from bayes_hw.posing import begins_unmeasured
from bayes_hw.record import Record

DRAWS = 300
NEWTON_STEPS = 6
BANDS = ("mean", "lower_parameters", "upper_parameters", "lower", "upper", "predicted_probability")


@dataclass(frozen=True, eq=False)
class Prediction:
    """94 % equal-tailed bands of y for one record, arrays (samples,), output units.

    `mean` is the posterior mean of the simulated output; `lower_parameters`, `upper_parameters` bound it
    under parameter uncertainty alone; `lower`, `upper` bound the measured y, noise included.
    `predicted_probability` is the predictive distribution function at the measured y, uniform between 0 and 1
    where the predictions are calibrated, NaN where nothing was measured.
    """

    record: Record
    mean: FloatArray
    lower_parameters: FloatArray
    upper_parameters: FloatArray
    lower: FloatArray
    upper: FloatArray
    predicted_probability: FloatArray

    @property
    def fit_percent(self) -> float:
        """100 (1 - ||y - mean|| / ||y - mean of y||) (eq. 14)."""
        known = self.record.measured_samples
        y, mean = self.record.y[known], self.mean[known]
        return 100 * (1 - float(np.linalg.norm(y - mean) / np.linalg.norm(y - y.mean())))

    def columns(self) -> dict[str, FloatArray]:
        """Record, mean and bands, as angles of the encoder, under the column names of `bayes-hw predict`; no
        y where none was measured."""
        angles = {
            **({"y": self.record.y_or_nan} if self.record.has_output else {}),
            "mean": self.mean,
            "lo": self.lower,
            "hi": self.upper,
            "lo_parameters": self.lower_parameters,
            "hi_parameters": self.upper_parameters,
        }
        measured = {name: angle + self.record.origin for name, angle in angles.items()}
        return {"t": self.record.t, "u": self.record.u} | measured

    def hardest_stretch(self, share: float) -> tuple[float, float]:
        """Start and end time (s) of the part, `share` of the record long, with the largest squared error."""
        length = max(2, round(share * len(self.record)))
        running = np.cumsum(np.concatenate([[0.0], np.nan_to_num(self.record.y_or_nan - self.mean) ** 2]))
        first = int(np.argmax(running[length:] - running[:-length]))
        return float(self.record.t[first]), float(self.record.t[first + length - 1])


@dataclass(frozen=True)
class Coverage:
    """Share of samples inside the bands of a nominal probability, with its 95 % interval.

    The interval is binomial (Wilson), with the number of effectively independent samples.
    """

    nominal: float
    achieved: float
    interval: tuple[float, float]
    effective_samples: float

    @property
    def agrees(self) -> bool:
        """Whether the nominal probability lies in the interval."""
        return self.interval[0] <= self.nominal <= self.interval[1]


def coverage_sentence(record: Record, mean: FloatArray, inside: FloatArray) -> str:
    """How far a prediction (samples,) is from a record, and how much of it the bands hold; `inside` (measured
    samples,) is one where they do."""
    known = record.measured_samples
    error, centred = (record.y - mean)[known], record.y[known] - record.y[known].mean()
    fit = 100 * (1 - float(np.linalg.norm(error) / np.linalg.norm(centred)))
    held = coverage(inside)
    low, high = held.interval
    rms = float(np.sqrt(np.mean(error**2)))
    return (
        f"rms error {rms:.3g} {record.units.output}, fit {fit:.1f} %; 94 % bands hold "
        f"{100 * held.achieved:.1f} % of the samples (95 % interval {100 * low:.1f} to {100 * high:.1f} %)"
    )


def predict(posterior: Posterior, record: Record, rng: np.random.Generator) -> Prediction:
    """Bands of y for `record` under the posterior.

    The record starts at rest, or, where the posterior was sampled with free initial conditions, in the state
    that least squares finds for each draw from its first quarter; a command alone starts at rest. What is not
    known of the level that its angles count from widens the band beside the noise; where nothing was measured
    when it began, the level is that of its readings, for each draw.

    Raises InputError when the sample rates differ.
    """
    check_rates(posterior.axis.model, [record])
    draws = posterior.draws(DRAWS, rng)
    n_axis = len(posterior.axis.parameters)
    levels, level_sd = _levels(posterior.axis, draws[:, :n_axis], record)
    sigma = np.hypot(draws[:, n_axis], level_sd)
    tail = (1 - INTERVAL_PROBABILITY) / 2
    bands = {name: np.empty(len(record)) for name in BANDS}
    measured = record.y_or_nan
    for begin, simulated in _simulated(posterior.axis, draws[:, :n_axis], record):
        outputs = simulated + levels[:, None]
        part = slice(begin, begin + outputs.shape[1])
        bands["mean"][part] = outputs.mean(axis=0)
        low, high = np.quantile(outputs, [tail, 1 - tail], axis=0)
        bands["lower_parameters"][part], bands["upper_parameters"][part] = low, high
        bands["lower"][part], bands["upper"][part] = noisy_quantiles(outputs, sigma, INTERVAL_PROBABILITY)
        standard = (measured[part] - outputs) / sigma[:, None]
        bands["predicted_probability"][part] = special.ndtr(standard).mean(axis=0)
    return Prediction(record, **bands)


def _levels(axis: AxisParameters, draws: FloatArray, record: Record) -> tuple[FloatArray, float]:
    """The level (draws,) of a record beside each draw, and its standard deviation."""
    if not begins_unmeasured(record):
        return np.zeros(len(draws)), record.level_sd
    measured, left = record.measured_samples, np.zeros(len(draws))
    for begin, outputs in _simulated(axis, draws, record):
        part = slice(begin, begin + outputs.shape[1])
        left += np.where(measured[part], record.y[part] - outputs, 0.0).sum(axis=1)
    return left / np.count_nonzero(measured), 0.0


def noisy_quantiles(
    outputs: FloatArray, sigma: FloatArray, probability: float
) -> tuple[FloatArray, FloatArray]:
    """Equal-tailed bounds (samples,) of the mixture of N(outputs, sigma^2) over `outputs` (draws, samples).

    Newton's method on the probit of the mixture's distribution function, which is nearly linear.
    """
    centre = outputs.mean(axis=0)
    spread = np.sqrt(outputs.var(axis=0) + np.mean(sigma**2))
    bounds = []
    for probit in special.ndtri([(1 - probability) / 2, (1 + probability) / 2]):
        x = centre + probit * spread
        for _ in range(NEWTON_STEPS):
            standard = (x - outputs) / sigma[:, None]
            share = np.clip(special.ndtr(standard).mean(axis=0), 1e-12, 1 - 1e-12)
            density = (np.exp(-0.5 * standard**2) / sigma[:, None]).mean(axis=0)
            reached = special.ndtri(share)
            slope = density / np.exp(-0.5 * reached**2)
            x = x - np.clip((reached - probit) / np.maximum(slope, 1e-300), -spread, spread)
        bounds.append(x)
    return bounds[0], bounds[1]


def coverage(inside: FloatArray, nominal: float = INTERVAL_PROBABILITY) -> Coverage:
    """Coverage from an array (samples,) of ones where y lies inside the band and zeros elsewhere."""
    achieved = float(np.mean(inside))
    tau = autocorrelation_time(inside[:, None]) if np.ptp(inside) > 0 else 1.0
    effective = len(inside) / max(tau, 1.0)
    z = 1.96
    centre = (achieved + z**2 / (2 * effective)) / (1 + z**2 / effective)
    half = (
        z
        * np.sqrt(achieved * (1 - achieved) / effective + z**2 / (4 * effective**2))
        / (1 + z**2 / effective)
    )
    return Coverage(nominal, achieved, (float(centre - half), float(centre + half)), effective)


def band_coverage(prediction: Prediction, nominal: float = INTERVAL_PROBABILITY) -> Coverage:
    """Coverage of the central bands of probability `nominal`, noise included, on the record's own y."""
    return coverage(band_holds(prediction, nominal), nominal)


def band_holds(prediction: Prediction, nominal: float = INTERVAL_PROBABILITY) -> FloatArray:
    """Where the band of probability `nominal` holds the measured y: ones and zeros (measured samples,)."""
    probability = prediction.predicted_probability
    inside = np.abs(2 * probability[~np.isnan(probability)] - 1) <= nominal
    return inside.astype(np.float64)


def _simulated(axis: AxisParameters, draws: FloatArray, record: Record) -> Iterator[tuple[int, FloatArray]]:
    """Outputs (draws, samples) block by block, from rest or from the states that the record's first part
    shows."""
    values, before = draws.T, 0.0
    if axis.start_positions is not None:
        before = float(record.u[0])
        if record.has_output:
            axis, values = with_start_state(axis, draws, record)
    signals = axis.known_signals(record.known, len(record))
    form, delay = axis.modal_form(values, 0), axis.model.linear.delay_samples
    yield from simulated_blocks(form, record.u, delay, before, signals)
