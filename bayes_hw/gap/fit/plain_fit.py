"""Least squares of plain residuals, the noise taken to be what is left."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Plain

NOISE_SHARE = 1 / 3
"""Of what the base model leaves: the noise assumed to start with."""

ROUNDS = 4


def plain_fit(start: Fit, measured: Sequence[FloatArray]) -> Fit:
    """Plain least squares from `start`, the noise taken to be what is left."""
    current = start
    for _ in range(ROUNDS):
        noise = Plain(current.rmse, masked=current.unread or ())
        current = fit(current.hypothesis, measured, current.coordinates, noise)
    return current


def first_sigma(base: Hypothesis, measured: Sequence[FloatArray]) -> float:
    """A noise to start with, output units, where none is given."""
    rough = Plain(float(np.std(np.concatenate(list(measured)))), masked=base.unread or ())
    return NOISE_SHARE * plain_fit(fit(base, measured, base.prior_means, rough), measured).rmse
