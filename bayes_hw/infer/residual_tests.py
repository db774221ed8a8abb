"""What the residuals still hold: tests of the model that come before any statement of probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special, stats

from bayes_hw.arrays import FloatArray, robust_sigma
from bayes_hw.identify.feedback import FeedbackTest, feedback_test
from bayes_hw.identify.holes import with_holes
from bayes_hw.identify.noise import autoregression_from_partial, burg
from bayes_hw.identify.output_error import whitened
from bayes_hw.identify.validation import fit_percent
from bayes_hw.record import Record

SIGNIFICANCE = 0.01
LARGEST_LAG = 25
LEAST_FIT_PERCENT = 50.0


@dataclass(frozen=True)
class ResidualTest:
    """One test of the whitened residuals: its statistic, p-value, and what it says in words."""

    name: str
    statistic: float
    p_value: float
    passed: bool
    meaning: str


@dataclass(frozen=True, eq=False)
class ResidualReport:
    """Residuals of all records, whitened by the noise model, and the tests of them.

    `residuals` and `innovations` are one array a record, (samples,), output units, NaN where nothing was
    measured; `autocorrelation` (lags,)
    is that of the innovations from lag 0, `bound` its two-sided 95 % bound for white noise. `fit_percent`
    is the smallest fit (eq. 14) of the simulated output on any record; `feedback` whether later commands
    follow the innovations.
    """

    residuals: list[FloatArray]
    innovations: list[FloatArray]
    autocorrelation: FloatArray
    bound: float
    tests: tuple[ResidualTest, ...]
    fit_percent: float
    feedback: FeedbackTest

    @property
    def white(self) -> bool:
        """Whether the innovations pass the tests of the model's structure (not of their distribution)."""
        return all(test.passed for test in self.tests if test.name not in DISTRIBUTIONS)

    @property
    def failures(self) -> tuple[str, ...]:
        """In words, what the tests of the model's structure say against it; empty where all passed."""
        failed = [t for t in self.tests if not t.passed and t.name not in DISTRIBUTIONS]
        return tuple(f"{t.name}: {t.meaning}" for t in failed)

    @property
    def explained(self) -> bool:
        """Whether the model, not its noise, explains the records: white innovations alone do not say so."""
        return self.fit_percent >= LEAST_FIT_PERCENT

    def to_dict(self) -> dict[str, object]:
        return {
            "fit_percent": float(self.fit_percent),
            "white": bool(self.white),
            "closed_loop": self.feedback.closed_loop,
            "tests": [
                {
                    "name": test.name,
                    "statistic": float(test.statistic),
                    "p_value": float(test.p_value),
                    "passed": bool(test.passed),
                    "meaning": test.meaning,
                }
                for test in self.tests
            ],
        }


NORMALITY = "normal distribution"
STUDENT_T = "Student-t distribution"
DISTRIBUTIONS = (NORMALITY, STUDENT_T)
DEPENDENCE = ("independent of the command", "independent of the command's magnitude")
WINSOR = 3.0
"""Robust standard deviations that outliers are drawn in to."""

FARTHEST = 8.0
"""Standard deviations that an innovation in the tail is set to at most where it is made normal."""


def reach(values: Sequence[FloatArray]) -> float:
    """WINSOR robust standard deviations of what of `values` was measured: where outliers are drawn in to
    (Huber's pseudo-data)."""
    return WINSOR * robust_sigma(np.concatenate(values))


def examine_residuals(
    records: Sequence[Record],
    residuals: Sequence[FloatArray],
    autoregression: FloatArray,
    fitted: int | None = None,
    degrees_of_freedom: float | None = None,
) -> ResidualReport:
    """Test the innovations e(k) - sum phi_i e(k - i) of every record; `fitted` is how many numbers of the
    noise were fitted where these are not the phi themselves, `degrees_of_freedom` those of Student-t ones.

    Ljung-Box for whiteness (doi 10.1093/biomet/65.2.297), the largest cross-correlation with the command for
    dynamics the model lacks, the same with the command's magnitude for nonlinearity it lacks, both of
    innovations whose outliers are drawn in, which would hide what the many others say; and Jarque-Bera for
    normality, of Student-t innovations once their distribution has made them normal. Each at 1 %.
    """
    order = len(autoregression)
    innovations = [
        with_holes(whitened(e, autoregression, record.measured), record.measured)[order:]
        for record, e in zip(records, residuals, strict=True)
    ]
    commands = [record.u[order:] for record in records]
    lags = min(LARGEST_LAG, min(len(a) for a in innovations) // 2)
    autocorrelation = _autocorrelation(innovations, lags)
    bound = reach(innovations)
    drawn_in = [np.clip(a, -bound, bound) for a in innovations] if bound > 0 else innovations
    samples = sum(_count(a) for a in innovations)
    tests = (
        _ljung_box(autocorrelation, samples, fitted or order, _pairs(innovations, lags)),
        _cross_correlation(DEPENDENCE[0], drawn_in, commands, lags, "linear dynamics"),
        _cross_correlation(
            DEPENDENCE[1],
            drawn_in,
            [np.abs(u) for u in commands],
            lags,
            "a nonlinearity",
        ),
        _distribution(_known(np.concatenate(innovations)), degrees_of_freedom),
    )
    fit = min(_fit(record.y_or_nan, e) for record, e in zip(records, residuals, strict=True))
    return ResidualReport(
        list(residuals),
        innovations,
        autocorrelation,
        1.96 / np.sqrt(samples),
        tests,
        fit,
        feedback_test(commands, innovations),
    )


def _fit(y: FloatArray, residual: FloatArray) -> float:
    """Fit percentage of one record; 0 for a constant output, which no model can be said to explain."""
    return fit_percent(y, y - residual) if np.ptp(_known(y)) > 0 else 0.0


def _known(values: FloatArray) -> FloatArray:
    """What was measured."""
    return values[~np.isnan(values)]


def _count(values: FloatArray) -> int:
    return int(np.count_nonzero(~np.isnan(values)))


def _pairs(segments: Sequence[FloatArray], lags: int) -> FloatArray:
    """Of every lag from 1 on, how many pairs of samples were measured: (lags,)."""
    found = np.zeros(lags)
    for segment in segments:
        known = ~np.isnan(segment)
        for lag in range(1, min(lags, len(known) - 1) + 1):
            found[lag - 1] += np.count_nonzero(known[lag:] & known[: len(known) - lag])
    return found


def _autocorrelation(segments: Sequence[FloatArray], lags: int) -> FloatArray:
    sums = np.zeros(lags + 1)
    for segment in segments:
        centred = np.nan_to_num(segment - _known(segment).mean())
        for lag in range(min(lags, len(segment) - 1) + 1):
            sums[lag] += centred[lag:] @ centred[: len(centred) - lag]
    return sums / sums[0]


def _ljung_box(autocorrelation: FloatArray, samples: int, order: int, pairs: FloatArray) -> ResidualTest:
    """With holes fewer `pairs` (lags,) make up each correlation (Stoffer and Toloi 1992,
    doi 10.1016/0167-7152(92)90170-C): the term of each lag is over their number."""
    lags = np.arange(1, len(autocorrelation))
    statistic = samples * (samples + 2) * np.sum(autocorrelation[1:] ** 2 / np.maximum(pairs, 1))
    p_value = float(stats.chi2.sf(statistic, max(len(lags) - order, 1)))
    passed = p_value >= SIGNIFICANCE
    return ResidualTest(
        f"white (Ljung-Box, {len(lags)} lags)",
        float(statistic),
        p_value,
        passed,
        "no correlation is left in time"
        if passed
        else "correlation in time is left: intervals are too narrow, or the model lacks dynamics",
    )


def _cross_correlation(
    name: str, innovations: Sequence[FloatArray], signals: Sequence[FloatArray], most_lags: int, lacking: str
) -> ResidualTest:
    """Largest |correlation| of the innovations with the signal whitened, over lags; Sidak over the lags.

    The signal is prewhitened by its own AR model, so that the correlations at different lags are nearly
    independent.
    """
    centred = [signal - signal.mean() for signal in signals]
    partial, _ = burg(centred, 8)
    filter_ = autoregression_from_partial(partial[:, None])[:, 0]
    inputs = [whitened(signal, filter_) for signal in centred]
    innovations = [np.nan_to_num(a) for a in innovations]
    lags = range(most_lags + 1)
    power = np.sqrt(sum(float(a @ a) for a in innovations) * sum(float(x @ x) for x in inputs))
    correlations = np.array(
        [
            sum(float(a[lag:] @ x[: len(x) - lag]) for a, x in zip(innovations, inputs, strict=True))
            for lag in lags
        ]
    )
    samples = sum(len(a) for a in innovations)
    largest = float(np.max(np.abs(correlations)) / power) if power > 0 else 0.0
    single = 2 * stats.norm.sf(largest * np.sqrt(samples))
    p_value = float(-np.expm1(len(lags) * np.log1p(-min(single, 1 - 1e-16))))
    passed = p_value >= SIGNIFICANCE
    return ResidualTest(
        name,
        largest,
        p_value,
        passed,
        "nothing of it is left in the residual" if passed else f"the model lacks {lacking}",
    )


def _distribution(innovations: FloatArray, degrees: float | None) -> ResidualTest:
    """Jarque-Bera on the innovations, of Student-t ones of likeliest scale on the normal quantiles."""
    name, found = NORMALITY, innovations
    if degrees is not None:
        _, _, scale = stats.t.fit(innovations, f0=degrees, floc=0.0)
        tail = stats.t.logsf(np.abs(innovations), degrees, 0.0, scale)
        quantile = np.minimum(-special.ndtri_exp(tail), FARTHEST)
        name, found = STUDENT_T, np.sign(innovations) * quantile
    result = stats.jarque_bera(found)
    p_value = float(result.pvalue)
    passed = p_value >= SIGNIFICANCE
    return ResidualTest(
        name,
        float(result.statistic),
        p_value,
        passed,
        f"tails as a {name} has them"
        if passed
        else f"no {name}: outliers, quantization or changing noise; the likelihood is approximate",
    )
