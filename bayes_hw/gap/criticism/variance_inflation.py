"""Inflated variance of slow noise: it grows to hold whatever no effect of the catalogue does.

Held against noise that strong a cause explains little. With the cause told by a free function less noise is
needed: what both come to is a likelihood ratio, where `free_functions` has the score at full strength.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.free_functions import FreeFunction, free_functions
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.state_noise import StateNoise

STRENGTHS = (1.0, 0.1, 0.01)
"""Of the variance of the slow noise, from what it is on."""

AS_NOISE = "disturbance"
"""The block whose free function of time is what slow noise is itself: less noise beside it says nothing."""


def free_functions_with_free_variance(
    shown: Mapping[str, Sequence[FloatArray]],
    residuals: Sequence[FloatArray],
    fit: Fit,
    noise: StateNoise,
) -> list[FreeFunction]:
    """Every free function under the strength of the slow `noise` at which it and the noise explain
    `residuals` (samples,), a record each, best; its gain is that over the base at the strength that suits it.
    """
    best: dict[str, tuple[float, FreeFunction]] = {}
    alone = -np.inf
    for strength in STRENGTHS:
        weaker = noise.weaker(strength)
        base = weaker.fitted_to(residuals).log_likelihood + _gain_of_base(residuals, fit.jacobians, weaker)
        alone = max(alone, base)
        for function in free_functions(shown, residuals, fit.jacobians, weaker):
            total = base + function.gain
            known = best.get(function.block)
            if known is None or (total > known[0] and function.block != AS_NOISE):
                best[function.block] = (total, function)
    return [replace(function, gain=total - alone) for total, function in best.values()]


def _gain_of_base(
    residuals: Sequence[FloatArray], tangents: Sequence[FloatArray], noise: StateNoise
) -> float:
    """Log-likelihood that re-estimating the base would gain."""
    basis = np.linalg.qr(np.concatenate([noise.whiten(j, r) for r, j in enumerate(tangents)]))[0]
    taken = basis.T @ np.concatenate([noise.whiten(e[:, None], r)[:, 0] for r, e in enumerate(residuals)])
    return 0.5 * float(taken @ taken)
