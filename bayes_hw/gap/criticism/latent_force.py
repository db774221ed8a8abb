"""The force that is missing: a free torque over time that would close the gap of a fit.

A random walk of unknown size at the drive, seen through the linear block beside the encoder's noise; its
posterior mean and standard deviation by whitened least squares (a Gaussian process on knots; Rasmussen and
Williams, Gaussian Processes for Machine Learning, section 2.2), in the directions in which the steps of the
walk are independent given the data. Its size maximises the marginal likelihood.
It names no cause: held against speed and position it shows what a cause must do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.simulate.columns import linear_splines_over
from bayes_hw.gap.simulate.injection_point import InjectionPoint

KNOTS, FEWEST_KNOTS = 960, 40
SAMPLES_A_KNOT = 4
MOST_VALUES = 20_000_000
"""Of the response to every knot, which bounds the knots of long records."""

SIZES = np.geomspace(1e-3, 1e3, 25)
"""Of the walk's steps, in units of the knot amplitude that a whitened residual of one would need."""


@dataclass(frozen=True)
class LatentForce:
    """Mean and standard deviation (samples,) of the missing signal at `door`, with the motion it goes with.

    `unit` is that of the signal: of an acceleration at the drive, of the command where no force enters;
    `response` (samples,) what its mean adds to the output, output units.
    """

    door: InjectionPoint
    unit: str
    time: FloatArray
    mean: FloatArray
    sd: FloatArray
    response: FloatArray
    speed: FloatArray
    position: FloatArray

    @property
    def band(self) -> tuple[FloatArray, FloatArray]:
        """Ends (samples,) of the 94 % band of the missing signal."""
        half = NORMAL_HALF_WIDTH * self.sd
        return self.mean - half, self.mean + half


def latent_force(fit: Fit, record: int, noise: Whitener) -> LatentForce:
    """The missing force of one training record of `fit` beside the encoder's `noise`.

    Noise that was fitted to the residuals of a model that lacks something takes up what is missing.
    """
    hypothesis, residual = fit.hypothesis, fit.residuals[record]
    scale, samples = hypothesis.scale, len(residual)
    chain = hypothesis.chain(fit.values)
    door: InjectionPoint = "motor_torque" if chain.can_inject("motor_torque") else "command"
    most = max(MOST_VALUES // samples, FEWEST_KNOTS)
    places = np.linspace(0, samples - 1, min(KNOTS, samples // SAMPLES_A_KNOT, most))
    splines = linear_splines_over(np.arange(float(samples)), places)
    responses = chain.small_responses(door, splines)
    columns = noise.whiten(responses, record)
    white = noise.whiten(residual[:, None], record)[:, 0]
    steps = np.tril(np.ones((len(places), len(places))))
    along = columns @ steps
    information, directions = eigh(along.T @ along)
    information, amplitudes = np.maximum(information, 0.0), directions.T @ (along.T @ white)
    usual = len(places) / np.sum(columns**2)
    variances = usual * SIZES[:, None] ** 2
    shrunk = variances / (1 + variances * information)
    evidence = 0.5 * (shrunk @ amplitudes**2 - np.sum(np.log1p(variances * information), axis=1))
    best = shrunk[int(np.argmax(evidence))]
    paths = steps @ directions
    mean = paths @ (best * amplitudes)
    y = fit.simulated[record]
    units = scale.units
    return LatentForce(
        door,
        f"{units.output}/s^2" if door == "motor_torque" else units.input,
        np.arange(samples) / scale.rate,
        splines @ mean,
        np.sqrt((splines @ paths) ** 2 @ best),
        responses @ mean,
        np.gradient(y) * scale.rate,
        y,
    )


def free_residual(fit: Fit, noise: Whitener) -> dict[str, FloatArray]:
    """Columns (samples of all training records,) of free_residual.csv: number of the record, time in s, what
    `fit` predicts, the missing force with its 94 % band, and what the force adds to the prediction."""
    columns: dict[str, list[FloatArray]] = {}
    for record, simulated in enumerate(fit.simulated):
        found = latent_force(fit, record, noise)
        low, high = found.band
        row = {
            "record": np.full(len(simulated), float(record)),
            "t": found.time,
            "before": simulated,
            "force": found.mean,
            "lo": low,
            "hi": high,
            "response": found.response,
        }
        for name, column in row.items():
            columns.setdefault(name, []).append(column)
    return {name: np.concatenate(parts) for name, parts in columns.items()}
