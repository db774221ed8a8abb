"""How much the posterior would move if the prior, or the likelihood, counted a little more or less."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from arviz_base import from_dict
from arviz_stats import psense

from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.parameters import log_prior

DRAWS = 4_000
SENSITIVE = 0.05
"""Sensitivity above which the prior is informative, or below which the likelihood is weak (Kallioinen et al.,
doi 10.1007/s11222-023-10366-5)."""


@dataclass(frozen=True)
class PowerScaling:
    """Power-scaling sensitivities of one parameter: to the prior of all, and to the likelihood."""

    prior: float
    likelihood: float


def power_scaling(posterior: Posterior, target: LogPosterior) -> dict[str, PowerScaling]:
    """Sensitivities of every parameter of the axis, by `arviz_stats.psense` with powers 0.99 and 1.01.

    Densities are those of the coordinates, where log-normal priors are normal ones; the prior of the noise's
    parameters is left as it is. `target` gives the densities that the posterior was sampled with.
    """
    n_axis = len(posterior.axis.parameters)
    walkers = posterior.values.shape[2]
    flat = np.moveaxis(posterior.values, 1, 2).reshape(-1, posterior.values.shape[1], len(posterior.names))
    probability = np.moveaxis(posterior.log_probability, 1, 2).reshape(flat.shape[:2])
    thin = max(1, flat.shape[0] * flat.shape[1] // DRAWS)
    chains = max(1, min(walkers, 4))
    values = flat.reshape(-1, flat.shape[-1])[::thin]
    level = probability.ravel()[::thin]
    kept = len(values) // chains * chains
    coordinates = target.coordinates(values[:kept])
    prior = log_prior(target.axis.parameters, coordinates.T[:n_axis])
    everything = log_prior(target.parameters, coordinates.T)
    likelihood = level[:kept] - everything
    shape = (chains, -1)
    tree = from_dict(
        {
            "posterior": {
                name: coordinates[:, i].reshape(shape) for i, name in enumerate(posterior.names[:n_axis])
            },
            "log_prior": {"axis": prior.reshape(shape)},
            "log_likelihood": {"records": likelihood.reshape(shape)},
        }
    )
    found = {group: psense(tree, group=group) for group in ("prior", "likelihood")}
    return {
        name: PowerScaling(float(found["prior"][name]), float(found["likelihood"][name]))
        for name in posterior.names[:n_axis]
    }
