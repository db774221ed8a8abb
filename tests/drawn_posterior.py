"""A posterior without a run: draws scattered about the nominal values of an axis."""

from __future__ import annotations

import numpy as np

from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

NOISE = NoiseEstimate(0.012, np.array([0.4, -0.2]))
ENSEMBLES, STEPS, WALKERS = 4, 60, 24


def posterior_of(
    model: HammersteinWiener, *, start: np.ndarray | None = None, steps: int = STEPS
) -> Posterior:
    """Draws scattered by one per cent about the nominal values."""
    axis = AxisParameters(model, output_scale=2.0, start_positions=start)
    sampled = noise_parameters(NOISE, "deg")
    nominal = np.array([p.nominal for p in (*axis.parameters, *sampled)])
    rng = np.random.default_rng(1)
    scatter = rng.standard_normal((ENSEMBLES, steps, WALKERS, len(nominal)))
    return Posterior(
        axis=axis,
        noise_parameters=sampled,
        values=nominal * (1 + 0.01 * scatter),
        log_probability=rng.normal(size=(ENSEMBLES, steps, WALKERS)),
        point_estimate=nominal,
        converged=False,
        problems=("too short",),
        seconds=1.25,
    )
