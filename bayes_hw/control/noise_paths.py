"""Encoder noise as the posterior has it, for loops in the time domain."""

from __future__ import annotations

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial

BURN_IN = 500


def noise_paths(sigma: FloatArray, partial: FloatArray, samples: int, rng: np.random.Generator) -> FloatArray:
    """One path (draws, samples) of e(k) = sum_i phi_i e(k - i) + a(k) a draw.

    `sigma` (draws,) is the marginal standard deviation in output units, `partial` (p, draws) are the partial
    autocorrelations.
    """
    innovation = sigma * np.sqrt(np.prod(1 - partial**2, axis=0))
    shocks = innovation[:, None] * rng.standard_normal((len(sigma), BURN_IN + samples))
    coefficients = autoregression_from_partial(partial)
    paths = [
        signal.lfilter([1.0], np.concatenate([[1.0], -phi]), row)[BURN_IN:]
        for phi, row in zip(coefficients.T, shocks, strict=True)
    ]
    return np.asarray(paths, dtype=np.float64)
