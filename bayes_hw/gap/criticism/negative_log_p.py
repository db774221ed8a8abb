"""The negative log p-value of a statistic where nothing is left."""

from __future__ import annotations

import math

from scipy.stats import chi2


def chi_squared_negative_log_p(statistic: float, degrees: int) -> float:
    """Minus the logarithm of the probability that chi-squared of so many degrees exceeds `statistic`.

    Where that probability is too small for a number, by the leading terms of the incomplete gamma function
    (Abramowitz and Stegun 6.5.32).
    """
    statistic, degrees = max(statistic, 0.0), max(degrees, 1)
    negative_log_p = -float(chi2.logsf(statistic, degrees))
    if math.isfinite(negative_log_p) or not math.isfinite(statistic):
        return negative_log_p
    half, x = 0.5 * degrees, 0.5 * statistic
    return x - (half - 1) * math.log(x) + math.lgamma(half) + math.log1p(-(half - 1) / x)
