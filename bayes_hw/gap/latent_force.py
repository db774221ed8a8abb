"""The force that is missing: a free torque over time that would close the gap of a fit.

A random walk of unknown size at the drive, seen through the linear block beside the noise of the fit; its
posterior mean and standard deviation by whitened least squares (a Gaussian process on knots; Rasmussen and
Williams, Gaussian Processes for Machine Learning, section 2.2). Its size maximises the marginal likelihood.
It names no cause: held against speed and position it shows what a cause must do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Door
from bayes_hw.gap.fit import Fit
from bayes_hw.gap.signals import door_responses, has_door

KNOTS = 160
SIZES = np.geomspace(1e-3, 1e3, 25)
"""Of the walk's steps, in units of the knot amplitude that a whitened residual of one would need."""


@dataclass(frozen=True)
class LatentForce:
    """Mean and standard deviation (samples,) of the missing signal at `door`, with the motion it goes with.

    `unit` is that of the signal: of an acceleration at the drive, of the command where no force enters.
    """

    door: Door
    unit: str
    time: FloatArray
    mean: FloatArray
    sd: FloatArray
    speed: FloatArray
    position: FloatArray


def latent_force(fit: Fit, record: int) -> LatentForce:
    """The missing force of one training record of `fit`."""
    hypothesis, residual = fit.hypothesis, fit.residuals[record]
    scale, samples = hypothesis.scale, len(residual)
    chain = hypothesis.chain(fit.values)
    door: Door = "motor_torque" if has_door(chain, "motor_torque") else "command"
    places = np.linspace(0, samples - 1, min(KNOTS, samples // 4))
    hats = np.stack([np.interp(np.arange(samples), places, row) for row in np.eye(len(places))], axis=1)
    response = fit.whitener.whiten(door_responses(chain, door, hats), record)
    white = fit.whitener.whiten(residual[:, None], record)[:, 0]
    gram, along = response.T @ response, response.T @ white
    usual = 1 / np.sqrt(np.trace(gram) / len(places))
    steps = np.tril(np.ones((len(places), len(places))))
    best = (-np.inf, np.zeros(len(places)), np.eye(len(places)))
    for size in SIZES * usual:
        prior = size**2 * (steps @ steps.T)
        root = cholesky(prior + 1e-9 * np.trace(prior) / len(places) * np.eye(len(places)), lower=True)
        inner = np.eye(len(places)) + root.T @ gram @ root
        factor = cholesky(inner, lower=True)
        amplitude = cho_solve((factor, True), root.T @ along)
        evidence = 0.5 * float(along @ (root @ amplitude)) - float(np.sum(np.log(np.diag(factor))))
        if evidence > best[0]:
            best = (evidence, root @ amplitude, root @ cho_solve((factor, True), root.T))
    _, mean, covariance = best
    y = fit.simulated[record]
    units = scale.units
    return LatentForce(
        door,
        f"{units.output}/s^2" if door == "motor_torque" else units.input,
        np.arange(samples) / scale.rate,
        hats @ mean,
        np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", hats, covariance, hats, optimize=True), 0.0)),
        np.gradient(y) * scale.rate,
        y,
    )
