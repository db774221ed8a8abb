"""A given model without effects at the base parameters that explain the records best, and under the weights
that the faults of their readings ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.base_cascade import natural_scale
from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.given.base_starts import limit_starts, unreached_starts
from bayes_hw.gap.joint.given.given_model import GivenModel
from bayes_hw.gap.joint.given.given_response import GivenFit, GivenResponse
from bayes_hw.gap.joint.given.given_rivals import shape_beyond
from bayes_hw.gap.joint.residuals.readings import Readings, glitches_read_again, read_faults
from bayes_hw.gap.joint.residuals.rounded_readings import without_rounding
from bayes_hw.identify.experiment import white_noise_level
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

BASES_KEPT, PLAIN_EVALUATIONS = 4, 25
LARGEST = 1e9
"""Of a residual, output units: a runaway trial stays finite."""


def base_and_readings(records: Sequence[Record], model: HammersteinWiener) -> tuple[GivenFit, Readings]:
    """The model without effects under the weights that the readings' faults ask for."""
    base = best_base(records, model)
    readings = read_faults(base)
    shape = shape_beyond(base, base) if "timing_jitter.sd" in readings.parameters else None
    if shape is not None:
        # What is wrong by position is wrong by speed too.
        readings = read_faults(shape)
    if not readings.nats:
        return base, readings
    base = reweighted(base, readings)
    if readings.rounded_first:
        base, readings = without_rounding(base, readings)
    again = glitches_read_again(base, readings)
    return (base, readings) if again is readings else (reweighted(base, again), again)


def best_base(records: Sequence[Record], model: HammersteinWiener) -> GivenFit:
    """The model without effects at the base parameters that explain the records best."""
    level = white_noise_level([record.y_or_nan for record in records])
    given = GivenModel.of(model, 0.1 * level)
    nominal = given.cascade(np.zeros(given.size), part=False, further=False)
    own_gain = abs(model.linear.velocity_gain(given.rate_hz)) / given.rate_hz
    speed_gain = abs(nominal.integrator_residue) or own_gain
    scale = natural_scale(records, (given.lower, given.upper), speed_gain, level)
    response = GivenResponse(given.structure(False, False), (), records, scale, given=given)
    low, high = given.bounds(part=False, further=False)
    nominal_fit = GivenFit(response, evaluate(response, np.clip(np.zeros(given.size), low, high)))
    starts = limit_starts(nominal_fit)
    tried = sorted((plainly(s) for s in starts[:BASES_KEPT]), key=lambda fit: fit.point.rms)
    found = highest([fit.descended() for fit in tried[:2]])
    return highest([found, *(start.descended() for start in unreached_starts(found))])


def plainly(fit: GivenFit) -> GivenFit:
    """Least squares of the base alone, as though the noise were white: a coloured one hides slow errors."""
    response, n = fit.response, len(fit.theta)
    low, high = response.given.bounds(response.part, response.further)
    rest = fit.point.coordinates[n:]

    root = np.sqrt(response.prior_precision()[:n]) * response.scale.sigma

    def residual(theta: FloatArray) -> FloatArray:
        found = zip(response.residuals(np.concatenate([theta, rest])), response.told, strict=True)
        errors = np.concatenate([e[told] for e, told in found])
        bounded = np.clip(np.nan_to_num(errors, nan=LARGEST), -LARGEST, LARGEST)
        return np.concatenate([bounded, root * theta])

    def slope(theta: FloatArray) -> FloatArray:
        blocks = response.linearise(np.concatenate([theta, rest]), 0)
        rows = [r[:n] if m is None else r[:n, m] for r, _, m in blocks]
        whole = np.nan_to_num(np.concatenate(rows, axis=1).T, nan=0.0, posinf=LARGEST, neginf=-LARGEST)
        return np.concatenate([-whole, np.diag(root)])

    inside = 1e-6 * (high - low)
    start = np.clip(fit.theta, low + inside, high - inside)
    found = least_squares(
        residual, start, slope, bounds=(low, high), x_scale="jac", max_nfev=PLAIN_EVALUATIONS
    )
    return GivenFit(response, evaluate(response, np.concatenate([found.x, rest])))


def reweighted(fit: GivenFit, readings: Readings) -> GivenFit:
    """The same explanation under the weights that the readings' faults ask for, descended. What rounding does
    repeats with its step: no shorter period is looked for."""
    scale = readings.seen_in(fit.response.scale)
    late = readings.parameters.get("timing_jitter.sd", 0.0) * scale.rate_hz
    response = replace(fit.response, weights=readings.weights, scale=scale, late=late)
    begun = GivenFit(response, evaluate(response, fit.point.coordinates))
    return highest([one.descended() for one in (begun, *begun.read_late())])
