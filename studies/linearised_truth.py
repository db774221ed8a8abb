"""What records say of a known axis at best: the estimate linearised at the truth, and its spread.

With e the noise that the records really hold, J the slopes of the true outputs and l the density of an
innovation, an estimator that is as good as any is truth + I^-1 s, with score s = -J^T l'(e) / l(e) of
whitened e and J and information I (Cox and Hinkley, Theoretical Statistics, section 9.2). It is what somebody
finds who knows the structure, the noise and the truth to begin at, and its intervals hold as often as they
say but for the luck of the noise: beside intervals from the same records it says whose fault a miss is. The
inverse of I is the Cramer-Rao bound (Van Trees, Detection, Estimation, and Modulation Theory, part I,
section 2.4).

A record that begins in motion is simulated from rest under its earlier commands too, which is the trajectory
that the axis really ran. Nobody knows the state it begins in: what the states of all poles of G at its
beginning can add to the outputs is taken out of J, which is the same as to estimate them. Nor does anybody
know the commands that its outputs answer for one delay: these outputs do not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal
from true_axis import KnownAxis, TrueNoise

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.output_error import DIFFERENCE_STEP
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.parameters import as_coordinates, as_values

LEAST_INFORMATION = 1e-10
"""Eigenvalues of the scaled information below this are set to it: no bound is finite where it is singular."""

SAME_RESPONSE = 1e-9
"""Singular values of free responses of unit size below this are those of one response told twice."""

UNTOLD = 1e-6
"""Slopes of which less is left beside free responses are those responses, but for rounding."""


@dataclass(frozen=True)
class AtBest:
    """How far the linearised estimate of a true value lies from it, and its standard deviation, the square
    root of the Cramer-Rao bound, both in the units of the value."""

    error: float
    deviation: float


def linearised_at_truth(axis: KnownAxis) -> dict[str, AtBest]:
    """The estimate of every true value but the noise's that the records of `axis` say something of, all of
    the true structure free; by name."""
    parameters = AxisParameters(axis.model, "all")
    names, model, noise = parameters.names, axis.model, axis.noise
    centre = as_coordinates(parameters.parameters, parameters.nominal)[:, None]
    steps = DIFFERENCE_STEP * np.eye(len(names))
    trials = as_values(parameters.parameters, np.concatenate([centre + steps, centre - steps], axis=1))
    form, delay = parameters.modal_form(trials), model.linear.delay_samples
    information, score = np.zeros((len(names), len(names))), np.zeros(len(names))
    for record, commands in zip(axis.records, axis.commands, strict=True):
        begin = len(commands) - len(record)
        first = begin + delay if begin else 0
        outputs = simulate_batch(form, commands, delay).y[:, first:]
        slopes = (outputs[: len(names)] - outputs[len(names) :]) / (2 * DIFFERENCE_STEP)
        true = model.simulate(commands)
        e = record.y[first - begin :] - true.y[first:]
        rows, innovations = (innovations_of(noise, each) for each in (slopes, e))
        if begin:
            rows = without(rows, innovations_of(noise, free_responses(model, true.w[first:])))
        information += noise.information * (rows @ rows.T)
        score += rows @ noise.location_score(innovations)
    wanted = axis.true_values()
    return {
        name: AtBest(wanted[name] * float(error), abs(wanted[name]) * float(deviation))
        for name, error, deviation in zip(names, *solved(information, score), strict=True)
        if name in wanted and np.isfinite(deviation)
    }


def innovations_of(noise: TrueNoise, values: FloatArray) -> FloatArray:
    """What the true autoregression does not predict of `values` (..., samples), but for the first ones that
    it needs."""
    polynomial = np.concatenate([[1.0], -noise.autoregression])
    return np.asarray(signal.lfilter(polynomial, [1.0], values)[..., len(noise.partial) :])


def free_responses(model: HammersteinWiener, w: FloatArray) -> FloatArray:
    """What a unit of the state of every pole of G adds to the output (poles, samples) about the positions `w`
    (samples,): real and imaginary parts of p^k through the slope of the dead zone."""
    upper = model.linear.poles[model.linear.poles.imag >= 0]
    powers = upper[:, None] ** np.arange(len(w))
    gains, half_width = model.normalization, model.dead_zone.half_width
    slope = np.where(w > half_width, gains.c2, np.where(w < -half_width, gains.c3, 0.0))
    return slope * np.concatenate([powers.real, powers.imag[upper.imag > 0]])


def without(rows: FloatArray, others: FloatArray) -> FloatArray:
    """`rows` (n, samples) less what of them combinations of `others` (m, samples) explain; zero where that is
    all of one."""
    size = np.linalg.norm(others, axis=1)
    _, singular, basis = np.linalg.svd(others[size > 0] / size[size > 0, None], full_matrices=False)
    basis = basis[singular > SAME_RESPONSE]
    left = rows - (rows @ basis.T) @ basis
    left[np.linalg.norm(left, axis=1) <= UNTOLD * np.linalg.norm(rows, axis=1)] = 0.0
    return np.asarray(left)


def solved(information: FloatArray, score: FloatArray) -> tuple[FloatArray, FloatArray]:
    """I^-1 s of an information matrix (n, n) and a score (n,), and the square roots of the diagonal of I^-1;
    zero and infinite where it has none about a parameter."""
    size = np.sqrt(np.diag(information))
    known = size > 0
    errors, deviations = np.zeros(len(size)), np.full(len(size), np.inf)
    scaled = information[np.ix_(known, known)] / np.outer(size[known], size[known])
    values, vectors = np.linalg.eigh(scaled)
    values = np.maximum(values, LEAST_INFORMATION)
    errors[known] = vectors @ (vectors.T @ (score[known] / size[known]) / values) / size[known]
    deviations[known] = np.sqrt(np.square(vectors) @ (1 / values)) / size[known]
    return errors, deviations
