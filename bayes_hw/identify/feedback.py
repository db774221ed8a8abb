"""Whether commands follow the noise of the output, as those of a closed loop do.

In open loop no command knows the noise: innovations and later commands are uncorrelated. A controller that
sees the measured output feeds its noise back into every command after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray

LAGS = 20
BLOCK = 65_536
"""Samples whose lagged commands are held at a time."""

RANK = 1e-10
"""Of the largest eigenvalue of the commands' products: smaller ones are rounding."""

SIGNIFICANCE = 1e-3


@dataclass(frozen=True)
class FeedbackTest:
    """Innovations of the noise against commands 1 to LAGS samples later: the statistic, its probability in
    open loop, and the correlation."""

    statistic: float
    p_value: float
    correlation: float

    @property
    def closed_loop(self) -> bool:
        return self.p_value < SIGNIFICANCE

    @property
    def sentence(self) -> str:
        """What a reader must know; empty in open loop."""
        if not self.closed_loop:
            return ""
        return (
            "the commands follow the noise of the output (correlation "
            f"{self.correlation:.2g}, p-value {self.p_value:.1g}), as in a closed loop: what is estimated "
            "holds only as far as the noise model does; take records whose commands no measured angle enters"
        )


def feedback_test(commands: Sequence[FloatArray], innovations: Sequence[FloatArray]) -> FeedbackTest:
    """Test whitened residuals (samples,) of every record, NaN where none is known, against its later commands
    (samples,).

    What LAGS later commands explain of the innovations beyond the LAGS + 1 commands up to now, over the
    innovations' variance: given the commands, chi-square with as many degrees of freedom as the later
    commands add directions (Wald's test; Seber and Lee, Linear Regression Analysis, sec. 4.3).
    """
    size = 2 * LAGS + 2
    products, power, samples = np.zeros((size, size)), 0.0, 0
    cross = np.zeros(size)
    for u, e in zip(commands, innovations, strict=True):
        scale = float(np.std(u)) or 1.0
        windows = np.lib.stride_tricks.sliding_window_view(u / scale, 2 * LAGS + 1)
        for begin in range(0, len(windows), BLOCK):
            part = windows[begin : begin + BLOCK]
            rows = np.concatenate([part, np.ones((len(part), 1))], axis=1)
            own = e[LAGS + begin : LAGS + begin + len(part)]
            known = np.isfinite(own)
            rows, own = rows[known], own[known]
            products += rows.T @ rows
            cross += rows.T @ own
            power += float(own @ own)
            samples += len(own)
    future = np.arange(LAGS + 1, 2 * LAGS + 1)
    past = np.setdiff1d(np.arange(size), future)
    whole, whole_rank = _explained(products, cross)
    before, before_rank = _explained(products[np.ix_(past, past)], cross[past])
    degrees = whole_rank - before_rank
    if degrees < 1 or power <= 0:
        return FeedbackTest(0.0, 1.0, 0.0)
    statistic = max(whole - before, 0.0) / ((power - whole) / max(samples - whole_rank, 1))
    share = max(whole - before, 0.0) / power
    return FeedbackTest(statistic, float(stats.chi2.sf(statistic, degrees)), float(np.sqrt(share)))


def _explained(products: FloatArray, cross: FloatArray) -> tuple[float, int]:
    """Sum of squares that regressors with these products explain, and how many directions they have."""
    values, vectors = np.linalg.eigh(products)
    kept = values > RANK * values[-1]
    along = vectors[:, kept].T @ cross
    return float(np.sum(along**2 / values[kept])), int(np.count_nonzero(kept))
