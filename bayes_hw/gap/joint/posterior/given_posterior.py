"""Posterior about a given model with effects: a normal in its coordinates, with the nominal prior."""

from __future__ import annotations

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.chaotic_motion import drawn_about
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.given.given_response import DELAY, LIMITS, MODE, GivenFit
from bayes_hw.gap.joint.posterior.joint_posterior import CHAOTIC, DRAWS, JointPosterior
from bayes_hw.gap.joint.posterior.reported_quantities import (
    base_units,
    dominant_sections,
    effect_quantities,
    effect_units,
    torque_draws,
)
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Units

INFLATION = 1.2
"""Of standard deviations: G's structure is given, forms of effects are a little wrong."""

UNSEEN = 1e-12
"""Share of the largest precision below which the records say nothing of a coordinate."""


def laplace_given(
    fit: GivenFit, units: Units, rng: np.random.Generator, inflation: float = INFLATION
) -> JointPosterior:
    """Draws of likelihood times prior, standard deviations times `inflation`, told with G's sections free."""
    about, factor, where = drawn_about(fit)
    if about is not fit:
        inflation *= CHAOTIC
    size, given = len(factor) - 1, fit.response.given
    variance = fit.point.variance_by(factor)
    precision = factor[:size, :size].T @ factor[:size, :size] / variance
    scale = np.sqrt(np.diag(precision))
    seen = scale > 0
    scale[~seen] = 1.0
    values, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    values = np.maximum(values, UNSEEN * values[-1])
    root = vectors / np.sqrt(values) / scale[:, None]
    centre = fit.point.coordinates
    steps = np.zeros((DRAWS, len(centre)))
    steps[:, where[seen]] = (inflation * rng.standard_normal((DRAWS, size)) @ root.T)[:, seen]
    drawn = [fit.response.admissible(centre + step, centre) for step in steps]
    for row in np.flatnonzero(centre[:LIMITS] > fit.response.reach):
        # No command reaches the limit: the records say that, its prior the rest.
        sd = given.prior_sd()[row]
        beyond = stats.truncnorm.rvs(
            fit.response.reach[row] / sd, np.inf, scale=sd, size=DRAWS, random_state=rng
        )
        for x, value in zip(drawn, beyond, strict=True):
            x[row] = value
    base: dict[str, list[float]] = {}
    effects: dict[str, list[float]] = {}
    free = np.empty((0, 0))
    for number, x in enumerate(drawn):
        at = fit.response.values(x)
        own = fit.response.free(at)[1]
        if number == 0:
            free = np.empty((len(drawn), len(own)))
        free[number] = own
        for name, value in given.named(x[: given.size]).items():
            base.setdefault(name, []).append(value)
        for name, value in {**effect_quantities(fit, at), **added_quantities(fit, x)}.items():
            effects.setdefault(name, []).append(value)
    free_fit = unfolded(fit)
    own_torques = {name: np.array(value) for name, value in torque_draws(free_fit, free, rng).items()}
    return JointPosterior(
        free_fit,
        free,
        {name: np.array(value) for name, value in base.items()},
        {name: np.array(value) for name, value in effects.items()} | own_torques,
        {
            **base_units(base, units),
            **effect_units(fit, units),
            f"{DELAY}.time": "s",
            f"{MODE}.frequency": "Hz",
        },
        tuple(dominant_sections(free_fit)),
    )


def unfolded(fit: GivenFit) -> JointFit:
    """The same explanation with G's sections free, for what simulates and stores it."""
    values = fit.values
    response, coordinates = fit.response.free(JointValues(values.cascade, values.effects))
    return JointFit(response, evaluate(response, coordinates, fit.point.whitener))


def added_quantities(fit: GivenFit, x: FloatArray) -> dict[str, float]:
    """Delay in s beyond the model's, frequency (Hz) and damping of the further mode."""
    r, n = fit.response, fit.response.given.size
    found: dict[str, float] = {}
    if r.part:
        found[f"{DELAY}.time"] = float(fit.extra_delay + x[n]) / r.scale.rate_hz
    if r.further:
        at = n + int(r.part)
        found[f"{MODE}.frequency"], found[f"{MODE}.damping_ratio"] = (
            float(v) for v in np.exp(x[at : at + 2])
        )
    return found
