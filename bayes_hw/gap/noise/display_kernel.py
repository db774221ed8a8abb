"""Compiled likelihoods of repeated or quantised readings."""

from __future__ import annotations

import math

import numpy as np

from bayes_hw.compiled import compiled

LOG_2PI = np.log(2 * np.pi)

AGES = 16
NEGLIGIBLE = 1e-9
"""Probability of an age below which it is not followed."""

SMALLEST = 1e-300


@compiled(nogil=True)
def held_log_likelihood(y, simulated, hold, coefficient, innovation_sigma, total):  # type: ignore[no-untyped-def]
    """Add the log-likelihood of y (samples,) to `total` (n,), for `simulated` (samples, n) and noise (n,).

    The encoder shows simulated[k - a] with a = 0 where it is fresh and one more than before where it repeats,
    which it does with probability `hold`; first-order noise is added. Forward algorithm over the age a
    (Rabiner, doi 10.1109/5.18626), scaled in every sample.
    """
    samples, n = simulated.shape
    before, after = np.zeros(AGES), np.zeros(AGES)
    errors = np.zeros(AGES)
    for i in range(n):
        h, rho, sigma = hold[i], coefficient[i], innovation_sigma[i]
        half = 0.5 / sigma**2
        norm = -math.log(sigma) - 0.5 * LOG_2PI
        before[:] = 0.0
        before[0] = 1.0
        oldest = 0
        value = 0.0
        for k in range(samples):
            shown = simulated[k, i]
            for a in range(oldest + 1):
                errors[a] = 0.0 if k == 0 else y[k - 1] - simulated[max(k - 1 - a, 0), i]
            best = np.inf
            for a in range(oldest + 1):
                if before[a] > 0:
                    e = y[k] - shown - rho * errors[a]
                    best = min(best, e * e)
                    if a + 1 < AGES and k > a:
                        e = y[k] - simulated[k - a - 1, i] - rho * errors[a]
                        best = min(best, e * e)
            fresh, scale = 0.0, 0.0
            newest = 0
            after[0] = 0.0
            for a in range(min(oldest + 1, AGES - 1)):
                after[a + 1] = 0.0
            for a in range(oldest + 1):
                if before[a] <= 0:
                    continue
                e = y[k] - shown - rho * errors[a]
                fresh += before[a] * (1 - h) * math.exp(half * (best - e * e))
                if a + 1 < AGES and k > a:
                    e = y[k] - simulated[k - a - 1, i] - rho * errors[a]
                    after[a + 1] = before[a] * h * math.exp(half * (best - e * e))
            after[0] = fresh
            for a in range(min(oldest + 2, AGES)):
                scale += after[a]
            for a in range(min(oldest + 2, AGES)):
                share = after[a] / scale
                before[a] = share if share > NEGLIGIBLE else 0.0
                if before[a] > 0:
                    newest = a
            oldest = newest
            value += math.log(max(scale, SMALLEST)) - half * best + norm
        total[i] += value


@compiled(nogil=True)
def rounded_log_likelihood(y, simulated, step, sigma, correlation, total):  # type: ignore[no-untyped-def]
    """Add the log-likelihood of rounded y (samples,) to `total` (n,), for `simulated` (samples, n) and noise
    before the rounding, of first order: marginal `sigma` (n,) and `correlation` (n,).

    log(Phi(b) - Phi(a)) with a, b = (y -+ step / 2 - expected) / spread. Of white noise exact; else what a
    sample is expected to be follows from those before it, their rounding taken for noise of step^2 / 12.
    """
    samples, n = simulated.shape
    root = math.sqrt(2.0)
    of_rounding = step * step / 12
    for i in range(n):
        value = 0.0
        rho, fresh = correlation[i], sigma[i] ** 2 * (1 - correlation[i] ** 2)
        mean, variance = 0.0, sigma[i] ** 2
        for k in range(samples):
            error = y[k] - simulated[k, i] - mean
            spread, middle = math.sqrt(variance), abs(error)
            a, b = (middle - 0.5 * step) / spread, (middle + 0.5 * step) / spread
            if a > 5.0:
                hazard = a + 1 / (a + 2 / (a + 3 / a))
                value += -0.5 * a * a - 0.5 * LOG_2PI - math.log(hazard)
            else:
                value += math.log(max(0.5 * (math.erfc(a / root) - math.erfc(b / root)), SMALLEST))
            gain = variance / (variance + of_rounding)
            mean = rho * (mean + gain * error)
            variance = rho * rho * (1 - gain) * variance + fresh
        total[i] += value
