"""How far true base parameters lie outside the posteriors that were stated for them.

Errors of simulated cases are counted in the standard deviations that an interval stands for. A posterior that
is right makes them normal. Some are not: an explanation that is wrong has its base parameters anywhere. Those
errors are taken for a share of all that follows a wide t distribution, fitted by the log score (contaminated
normal distribution: Tukey 1960, A survey of sampling from contaminated distributions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.base_average import DEGREES_ASTRAY
from bayes_hw.gap.answer.verdict import NOISE_SIGMA
from bayes_hw.gap.blind.counts import Share, share
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict
from blind_check.calibrate import FOLDS

LEVEL = 0.94
"""Of the stated intervals."""

SHARES = np.geomspace(0.001, 0.5, 81)
SCALES = np.geomspace(1.0, 30.0, 61)
"""That are tried: of errors that are astray, and how wide those lie."""


@dataclass(frozen=True)
class Tails:
    """Of errors in stated standard deviations, the `share` that is astray, by a t distribution of `scale`."""

    share: float
    scale: float

    def log_density(self, errors: FloatArray) -> FloatArray:
        """The same shape as `errors`, of a share that is not zero."""
        return _log_mixture(stats.norm.logpdf(errors), _log_astray(errors, self.scale), self.share)

    def half_width(self, level: float) -> float:
        """Of the central interval of `level`, in stated standard deviations."""

        def short(x: float) -> float:
            astray = stats.t.sf(x, DEGREES_ASTRAY, scale=self.scale)
            return float((1 - self.share) * stats.norm.sf(x) + self.share * astray - 0.5 * (1 - level))

        return float(brentq(short, 0.0, 1e6))


NORMAL = Tails(0.0, 1.0)


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
    """The tails of the `errors` (an array a case)."""

    errors: Sequence[FloatArray]

    @cached_property
    def tails(self) -> Tails:
        """Of largest likelihood."""
        return _best(self.errors)

    @cached_property
    def without_fold(self) -> list[Tails]:
        """Fitted without the fold of the case, one a case."""
        fold = np.arange(len(self.errors)) % FOLDS
        fitted = [
            _best([errors for errors, its in zip(self.errors, fold, strict=True) if its != left])
            for left in range(FOLDS)
        ]
        return [fitted[its] for its in fold]

    @property
    def gain(self) -> tuple[float, float]:
        """Mean gain a case in log score over the normal distribution, left out; its standard error."""
        pairs = zip(self.errors, self.without_fold, strict=True)
        gains = np.array([np.sum(tails.log_density(e) - stats.norm.logpdf(e)) for e, tails in pairs])
        return float(gains.mean()), float(gains.std(ddof=1) / np.sqrt(len(gains)))

    def held(self, level: float = LEVEL) -> tuple[Share, Share]:
        """Parameters within central intervals of `level`: of posteriors, and with tails left out."""
        alone, width = NORMAL.half_width(level), {t: t.half_width(level) for t in set(self.without_fold)}
        pairs = list(zip(self.errors, self.without_fold, strict=True))
        return (
            share(bool(x <= alone) for errors in self.errors for x in np.abs(errors)),
            share(bool(x <= width[tails]) for errors, tails in pairs for x in np.abs(errors)),
        )


def _best(errors: Sequence[FloatArray]) -> Tails:
    every = np.concatenate(errors)
    right, trials = stats.norm.logpdf(every), []
    for scale in SCALES:
        astray = _log_astray(every, scale)
        trials.append([np.sum(_log_mixture(right, astray, share)) for share in SHARES])
    row, column = np.unravel_index(np.argmax(trials), (len(SCALES), len(SHARES)))
    return Tails(float(SHARES[column]), float(SCALES[row]))


def _log_astray(errors: FloatArray, scale: float) -> FloatArray:
    return np.asarray(stats.t.logpdf(errors, DEGREES_ASTRAY, scale=scale))


def _log_mixture(right: FloatArray, astray: FloatArray, share: float) -> FloatArray:
    return np.logaddexp(np.log1p(-share) + right, np.log(share) + astray)
