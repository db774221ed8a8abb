"""Posteriors made by hand for the tests of controllers: draws around a model, without sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters, FreeSet
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

RELATIVE_SPREAD = 0.02


def spread_posterior(
    model: HammersteinWiener, free: FreeSet = "conditional", spread: float = RELATIVE_SPREAD, seed: int = 1
) -> Posterior:
    """4 x 40 x 32 draws, every parameter normal about its value in `model` with a relative `spread`."""
    axis = AxisParameters(model, free)
    noise = noise_parameters(NoiseEstimate(0.01, np.array([0.5])), model.units.output)
    nominal = np.concatenate([axis.nominal, [p.nominal for p in noise]])
    shape = (4, 40, 32, len(nominal))
    values = nominal * (1 + spread * np.random.default_rng(seed).standard_normal(shape))
    return Posterior(axis, noise, values, np.zeros(shape[:-1]), nominal, True, (), 1.0)


def delayed(model: HammersteinWiener, delay_samples: int) -> HammersteinWiener:
    """`model` with another delay."""
    return replace(model, linear=replace(model.linear, delay_samples=delay_samples))
