"""Plain residuals whose samples are not independent: fewer of them count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.whitener import LOG_2PI, Homogeneous

LARGEST_CORRELATION = 0.998


@dataclass(frozen=True)
class CorrelatedPlain(Homogeneous):
    """Residuals as they are, each worth 1 / tau of an independent Gaussian sample of deviation sigma.

    tau = (1 + phi) / (1 - phi) of first-order noise phi (Sokal, doi 10.1007/978-1-4899-0319-8_6). Where a
    simulator is a little wrong at high frequency, coloured noise close to a random walk would weigh the steps
    of the residual and leave its level to itself; least squares of the level are then the better estimate,
    and this is their uncertainty.
    """

    coefficients: FloatArray
    sigma: float
    log_likelihood: float
    parameter_count: int = 2
    unread: Sequence[BoolArray] | None = None
    has_density = False

    @classmethod
    def of(cls, correlation: float, fit: Misfit) -> CorrelatedPlain:
        """That of a plain fit's residuals with first autocorrelation `correlation`."""
        coefficients = np.array([np.clip(correlation, 0.0, LARGEST_CORRELATION)])
        found = cls(coefficients, fit.rmse, 0.0, unread=fit.unread)
        each = np.log(fit.rmse) + 0.5 * (LOG_2PI + 1)
        return replace(found, log_likelihood=-fit.readings / found.tau * each)

    @property
    def correlation(self) -> float:
        return float(self.coefficients[0])

    @property
    def tau(self) -> float:
        """Samples that count as one."""
        return (1 + self.correlation) / (1 - self.correlation)

    def whiten(self, columns: FloatArray, record: int) -> FloatArray:
        white = np.asarray(columns / (self.sigma * np.sqrt(self.tau)))
        if self.unread is not None:
            white[self.unread[record]] = 0.0
        return white
