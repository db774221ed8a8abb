"""A fault to be found: the structure of G chosen through a linear model, of order eight at most.

Limits and dead zone look like dynamics to a linear model, and the orders up to eight are each fitted from
their own start: the cascade of that order and delay, fitted by output error, ends in a poor minimum, and its
dead zone takes up what G lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.identify.cascade_fit import fit_cascade
from bayes_hw.identify.experiment import pole_source, prepare
from bayes_hw.identify.four_steps import MAX_LINEAR_ORDER
from bayes_hw.identify.identified_model import hammerstein_wiener_model
from bayes_hw.identify.input_nonlinearity import estimate_input_nonlinearity, estimate_output_nonlinearity
from bayes_hw.identify.linear_output_error import best_poles, identify_linear
from bayes_hw.identify.noise import estimate_noise
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def model_by_linear_proxy(records: Sequence[Record]) -> HammersteinWiener:
    """The cascade whose order, delay and integrator are those of the best linear model of `records`."""
    experiment = prepare(records, free_start=False)
    source = pole_source(experiment, experiment.commands)
    linear = identify_linear(experiment, source, MAX_LINEAR_ORDER, _silent).fit
    at_rest = replace(linear.structure, input_offset=False)
    poles, _ = best_poles(experiment, at_rest, source, experiment.commands)
    limits = estimate_input_nonlinearity(experiment, at_rest, poles)
    lower, upper = experiment.sides_commanded
    structure = replace(at_rest, lower=lower, upper=upper)
    values = replace(
        limits.values,
        lower=limits.lower if lower else -np.inf,
        upper=limits.upper if upper else np.inf,
    )
    hinged = estimate_output_nonlinearity(experiment, structure, values).fit
    fit = fit_cascade(hinged.structure, hinged.values, experiment.records)
    sigma = estimate_noise(fit.residuals).sigma * experiment.output_scale
    return hammerstein_wiener_model(experiment, fit, sigma, "by linear proxy", records[0].units)


def _silent(stage: str, done: int, total: int) -> None:
    """Report nothing."""
