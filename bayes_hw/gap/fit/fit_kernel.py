"""Compiled steps of a least-squares fit; each is short and keeps hold of the interpreter (`columns`)."""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled


@compiled
def forward_differences(moved, at, steps):  # type: ignore[no-untyped-def]
    """Derivatives (samples, n) from outputs `at` (samples,) a point and `moved` (samples, n) by `steps` (n,)
    from it; zero where they are not finite."""
    slopes = np.empty(moved.shape)
    for k in range(moved.shape[0]):
        for i in range(moved.shape[1]):
            slope = (moved[k, i] - at[k]) / steps[i]
            slopes[k, i] = slope if np.isfinite(slope) else 0.0
    return slopes


@compiled
def agreeing(slopes, step, after, before):  # type: ignore[no-untyped-def]
    """`slopes` (samples, n) made to agree with what a `step` (n,) did to the outputs (samples,).

    Broyden's update (doi 10.1090/S0025-5718-1965-0198670-6).
    """
    n, length = len(step), 0.0
    for i in range(n):
        length += step[i] * step[i]
    updated = np.empty(slopes.shape)
    for k in range(slopes.shape[0]):
        missed = after[k] - before[k]
        for i in range(n):
            missed -= slopes[k, i] * step[i]
        missed /= length
        for i in range(n):
            updated[k, i] = slopes[k, i] + missed * step[i]
    return updated


@compiled
def normal_equations(slopes, white):  # type: ignore[no-untyped-def]
    """slopes' slopes (n, n) and slopes' white (n,) of whitened derivatives (samples, n) and errors."""
    return slopes.T @ slopes, slopes.T @ white
