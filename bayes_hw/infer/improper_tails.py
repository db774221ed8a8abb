"""Improper tails: the flat region of the likelihood beyond a limit that the commands hardly reach.

Least squares likes to put such a limit just below the largest command, where clipping a few samples fits a
little of the noise. Beyond, the likelihood is constant, a little lower once the other parameters have
followed, but over a far wider range: nearly all of the posterior may lie there.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial
from bayes_hw.identify.output_error import DIFFERENCE_STEP, simulated_outputs, whitened
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.model.parameters import as_values

LIMITS = ("saturation.lower", "saturation.upper")
FOLLOWING_STEPS = 3


def onto_plains(
    target: LogPosterior, coordinates: FloatArray, covariance: FloatArray, prior_sd: FloatArray, loss: float
) -> tuple[list[int], FloatArray, FloatArray | None]:
    """The rows of limits beyond which a plain outweighs the peak at `coordinates` (parameters,), the
    coordinates half a prior width onto those plains, the axis's other parameters re-estimated there, and
    their information there, where a peak was left that is no plain itself (else None): a limit hides from the
    others what it takes off the command.

    A plain outweighs the peak when its log-likelihood is lower by less than `loss` and the logarithm of the
    two widths' ratio.
    """
    current, rows, information = coordinates.copy(), [], None
    for row, name in enumerate(target.axis.names):
        if name not in LIMITS:
            continue
        moved = current.copy()
        moved[row] += prior_sd[row]
        found = _followed(target, moved, prior_sd, row)
        if found is None:
            continue
        followed, there = found
        width = float(np.sqrt(covariance[row, row]))
        allowed = loss + max(0.0, float(np.log(prior_sd[row] / width)))
        if _log_likelihood(target, followed) > _log_likelihood(target, current) - allowed:
            followed[row] -= 0.5 * prior_sd[row]
            current = followed
            if 0.5 * (prior_sd[row] / width) ** 2 > loss:
                information = there
            rows.append(row)
    return rows, current, information


def _log_likelihood(target: LogPosterior, coordinates: FloatArray) -> float:
    with np.errstate(all="ignore"):
        value = target.log_likelihood(as_values(target.parameters, coordinates[:, None]))[0]
    return float(value) if np.isfinite(value) else -np.inf


def _followed(
    target: LogPosterior, coordinates: FloatArray, prior_sd: FloatArray, row: int
) -> tuple[FloatArray, FloatArray] | None:
    """Coordinates with all of the axis but `row` moved by Gauss-Newton, and the information about the axis
    before the last step; None where this is no plain: the information about `row` is larger than the prior's,
    or another parameter would have to move by more than its prior's width."""
    axis, count = target.axis, len(prior_sd)
    noise = as_values(target.noise, coordinates[count:, None])[:, 0]
    correlated = np.array([parameter.name.startswith("noise.partial") for parameter in target.noise])
    partial = noise[correlated]
    autoregression = autoregression_from_partial(partial[:, None])[:, 0]
    innovation_sigma = noise[0] * np.sqrt(np.prod(1 - partial**2))
    centre = coordinates.copy()
    others = [i for i in range(count) if i != row]
    for _ in range(FOLLOWING_STEPS):
        steps = DIFFERENCE_STEP * np.eye(count)
        at = centre[:count, None]
        trials = as_values(axis.parameters, np.concatenate([at, at + steps, at - steps], axis=1))
        outputs = simulated_outputs(axis, trials, target.records)
        measured = np.concatenate(
            [
                whitened(record.y - output, autoregression, record.measured)
                for record, output in zip(target.records, outputs, strict=True)
            ],
            axis=1,
        )
        residual = measured[0] / innovation_sigma
        slopes = (measured[count + 1 :] - measured[1 : count + 1]) / (2 * DIFFERENCE_STEP * innovation_sigma)
        if not np.isfinite(measured).all() or np.linalg.norm(slopes[row]) * prior_sd[row] >= 1:
            return None
        information = slopes @ slopes.T
        normal = information[np.ix_(others, others)] + np.diag(prior_sd[others] ** -2)
        step = np.linalg.solve(normal, slopes[others] @ residual)
        if np.any(np.abs(step) > prior_sd[others]):
            return None
        centre[others] += step
    return centre, information
