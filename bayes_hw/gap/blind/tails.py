"""How far true base parameters lie outside the posteriors that were stated for them.

Errors of simulated cases are counted in the standard deviations that an interval stands for. A t distribution
is fitted to them by the log score, its scale fixed: a posterior that is right gives a normal one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.blind.calibrate import FOLDS
from bayes_hw.gap.blind.counts import Share, share
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict
from bayes_hw.gap.verdict import NOISE_SIGMA

LEVEL = 0.94
"""Of the stated intervals."""

DEGREES = np.geomspace(1.0, 1000.0, 121)
"""Of freedom, that are tried."""


def standardized_errors(truth: CaseTruth, verdict: CaseVerdict) -> FloatArray:
    """True base parameters less the middle of their intervals, in standard deviations.

    The encoder's noise is not among them.
    """
    half_width = stats.norm.ppf(0.5 + LEVEL / 2)
    return np.array([
        half_width * (truth.base[name] - 0.5 * (low + high)) / (0.5 * (high - low))
        for name, (low, high) in verdict.base.items()
        if name in truth.base and name != NOISE_SIGMA and high > low
    ])  # fmt: skip


@dataclass(frozen=True, eq=False)
class TailFit:
    """The t distribution of the `errors` (an array a case)."""

    errors: Sequence[FloatArray]

    @cached_property
    def degrees(self) -> float:
        """Of freedom, of largest likelihood."""
        return _best(self.errors)

    @cached_property
    def without_fold(self) -> FloatArray:
        """Degrees of freedom (cases,) fitted without the fold of the case."""
        fold = np.arange(len(self.errors)) % FOLDS
        fitted = [
            _best([errors for errors, its in zip(self.errors, fold, strict=True) if its != left])
            for left in range(FOLDS)
        ]
        return np.array(fitted)[fold]

    @property
    def gain(self) -> tuple[float, float]:
        """Mean gain a case in log score over the normal distribution, left out; its standard error."""
        pairs = zip(self.errors, self.without_fold, strict=True)
        gains = np.array([np.sum(stats.t.logpdf(e, degrees) - stats.norm.logpdf(e)) for e, degrees in pairs])
        return float(gains.mean()), float(gains.std(ddof=1) / np.sqrt(len(gains)))

    def held(self, level: float = LEVEL) -> tuple[Share, Share]:
        """Parameters within central intervals of `level`: of posteriors, and of t distributions left out."""
        tail = 0.5 + level / 2
        pairs = list(zip(self.errors, self.without_fold, strict=True))
        return (
            share(bool(x) for errors in self.errors for x in np.abs(errors) <= stats.norm.ppf(tail)),
            share(bool(x) for errors, degrees in pairs for x in np.abs(errors) <= stats.t.ppf(tail, degrees)),
        )


def _best(errors: Sequence[FloatArray]) -> float:
    every = np.concatenate(errors)
    return float(DEGREES[np.argmax([np.sum(stats.t.logpdf(every, degrees)) for degrees in DEGREES])])
