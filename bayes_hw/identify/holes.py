"""Samples that were not measured, under autoregressive noise: conditioned across exactly.

The past of a sample behind a hole holds values that nobody measured. Their conditional means, given what was
measured before, stand in for them in the predictor; the covariance P of what these means miss (over the last
p samples, zero where measured) widens the innovation:

    s(k) = variance of order min(k, p) + phi' P phi,    mean(k - i) += (P phi)_i / s(k) times the innovation.

This is the Kalman filter of the autoregression with missing readings (Jones 1980,
doi 10.1080/00401706.1980.10486171), run only over a hole and the p samples behind it: elsewhere P is zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.record import Record

IntArray = NDArray[np.int64]

SIDE_BY_SIDE = 8
"""Walkers whose residuals lie in one line of the cache."""


PAST_DELAYS = 2
"""Delays that pass in a record begun in motion before its outputs count: during the first they answer
commands given before it, and during the second what fast poles still hold of these decays."""

MOST_OF_RECORD = 0.25
"""Of a record begun in motion that its unknown past may cost."""


def without_past(records: Sequence[Record], delay_samples: int) -> tuple[Record, ...]:
    """Records begun in motion without the outputs that commands before their beginning decide: nobody knows
    these, and initial states cannot stand for the fast poles' part of them."""
    found = []
    for record in records:
        unknown = min(PAST_DELAYS * delay_samples, int(MOST_OF_RECORD * len(record)))
        found.append(replace(record, measured=record.measured_samples & (np.arange(len(record)) >= unknown)))
    return tuple(found)


def masks_of(records: Sequence[Record]) -> tuple[BoolArray, ...] | None:
    """Which samples of every record were measured; None where all were."""
    if all(record.measured is None for record in records):
        return None
    return tuple(record.measured_samples for record in records)


def mask_of(masks: Sequence[BoolArray] | None, number: int) -> BoolArray | None:
    """That of one record; None where all its samples were measured."""
    if masks is None or masks[number].all():
        return None
    return masks[number]


def measured_count(residuals: Sequence[FloatArray], masks: Sequence[BoolArray] | None) -> int:
    """Samples of all records that were measured."""
    if masks is None:
        return sum(len(e) for e in residuals)
    return int(sum(np.count_nonzero(mask) for mask in masks))


def with_holes(values: FloatArray, measured: BoolArray | None) -> FloatArray:
    """`values` (..., samples), NaN where nothing was measured."""
    return values if measured is None else np.where(measured, values, np.nan)


def without_holes(values: FloatArray) -> FloatArray:
    """`values` (samples,) with those that are NaN put between their neighbours."""
    missing = np.isnan(values)
    if not missing.any() or missing.all():
        return values
    at = np.arange(len(values))
    return np.where(missing, np.interp(at, at[~missing], values[~missing]), values)


def predictors(partial: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients (p + 1, max(p, 1)) of the predictors of orders 0 to p of partial autocorrelations (p,),
    and the variances (p + 1,) of their innovations over that of order p."""
    order = len(partial)
    coefficients, variances = np.zeros((order + 1, max(order, 1))), np.ones(order + 1)
    _predictors(partial, coefficients, variances)
    return coefficients, variances


@dataclass(frozen=True, eq=False)
class Bridges:
    """How holes of one record are bridged under one noise, whatever the values.

    Runs of samples about holes begin at `begins` (runs,) and are `lengths` long; of their samples, one run
    after another, `spreads` are the innovations' variances, and `gains` (samples, p) what an innovation
    corrects. `change` is the sum of the logarithms of the measured samples' standard deviations less those of
    all as if complete.
    """

    begins: IntArray
    lengths: IntArray
    spreads: FloatArray
    gains: FloatArray
    change: float

    @classmethod
    def of(
        cls, measured: BoolArray, coefficients: FloatArray, variances: FloatArray, first: int = 0
    ) -> Bridges:
        """Of a record whose samples are measured or not; `coefficients` and `variances` as `predictors` gives
        them; samples before `first` do not count in `change`."""
        order = len(variances) - 1
        begins, lengths = _runs(measured, order)
        spreads, gains = np.zeros(int(lengths.sum())), np.zeros((int(lengths.sum()), order))
        change = _bridged(measured, coefficients, variances, first, begins, lengths, spreads, gains)
        return cls(begins, lengths, spreads, gains, float(change))

    def whiten(
        self,
        rows: FloatArray,
        measured: BoolArray,
        coefficients: FloatArray,
        result: FloatArray,
        first: int = 0,
    ) -> None:
        """Overwrite what of `result` (n, samples - first) holes of `rows` (n, samples) have spoilt.

        `result` are the innovations of `rows` over their standard deviations as if every sample had been
        measured. A sample that was not becomes zero.
        """
        _whitened(
            rows, measured, coefficients, first, self.begins, self.lengths, self.spreads, self.gains, result
        )


def whitened_over_holes(
    rows: FloatArray,
    measured: BoolArray,
    coefficients: FloatArray,
    variances: FloatArray,
    result: FloatArray,
) -> float:
    """As `Bridges.whiten`, for values that come under this noise once; returns the bridges' `change`."""
    bridges = Bridges.of(measured, coefficients, variances)
    bridges.whiten(rows, measured, coefficients, result)
    return bridges.change


@dataclass(frozen=True, eq=False)
class Holes:
    """The holes of one record, with what of its residual decides their part of a likelihood.

    `near` (k,) are the samples up to the noise's order before or behind a hole; in them runs, which may share
    samples, begin at `begins`, are `lengths` long and hold the pattern `pattern_of` (runs,). Of the patterns,
    one after another in `measured`, from `pattern_begins` on, `fresh` says which stand at the start of the
    record.
    """

    missing: int
    near: IntArray
    begins: IntArray
    lengths: IntArray
    pattern_of: IntArray
    measured: BoolArray
    pattern_begins: IntArray
    fresh: BoolArray

    @classmethod
    def of(cls, measured: BoolArray, order: int) -> Holes:
        """Of a record whose samples (samples,) are measured or not, for noise of `order`."""
        firsts, lengths = _runs(measured, order)
        reached = np.zeros(len(measured) + 1)
        np.add.at(reached, firsts, 1)
        np.add.at(reached, firsts + lengths, -1)
        near = np.flatnonzero(np.cumsum(reached)[:-1] > 0)
        begins = np.searchsorted(near, firsts)
        known: dict[tuple[bool, bytes], int] = {}
        pattern_of, parts = [], []
        for begin, length in zip(begins.tolist(), lengths.tolist(), strict=True):
            part = measured[near[begin : begin + length]]
            key = bool(near[begin] == 0), part.tobytes()
            if key not in known:
                known[key] = len(known)
                parts.append(part)
            pattern_of.append(known[key])
        ends = np.cumsum([0, *map(len, parts)])
        return cls(
            int(np.count_nonzero(~measured)),
            near,
            begins,
            lengths,
            np.array(pattern_of, dtype=np.int64),
            np.concatenate(parts) if parts else np.zeros(0, dtype=np.bool_),
            ends.astype(np.int64),
            np.array([key[0] for key in known], dtype=np.bool_),
        )

    def corrections(
        self, residuals: FloatArray, partial: FloatArray, precision: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """What the holes change in the sums of a likelihood made as if every sample had been measured.

        `residuals` (k, walkers) are those at `near`, with any value in the holes, `partial` (p, walkers). The
        first (walkers,) is the change of the sum of squared innovations in units of order p's variance, or,
        with a `precision` (walkers,), of the sum of the logarithms of one and precision times them; the
        second that of the sum of the logarithms of the innovations' standard deviations.
        """
        walkers = residuals.shape[1]
        terms, logarithms = np.zeros(walkers), np.zeros(walkers)
        _corrections(
            residuals,
            np.ascontiguousarray(partial.T),
            np.zeros(walkers) if precision is None else precision,
            precision is not None,
            self.begins, self.lengths, self.pattern_of, self.measured, self.pattern_begins, self.fresh,
            terms, logarithms,
        )  # fmt: skip
        return terms, logarithms


@njit(cache=True, nogil=True, error_model="numpy")
def _predictors(partial, coefficients, variances):  # type: ignore[no-untyped-def]
    """The Durbin-Levinson recursion."""
    order = len(partial)
    for j in range(1, order + 1):
        kappa = partial[j - 1]
        for i in range(j - 1):
            coefficients[j, i] = coefficients[j - 1, i] - kappa * coefficients[j - 1, j - 2 - i]
        coefficients[j, j - 1] = kappa
    variances[order] = 1.0
    for j in range(order - 1, -1, -1):
        variances[j] = variances[j + 1] / (1 - partial[j] * partial[j])


@njit(cache=True, nogil=True, error_model="numpy")
def _gains(coefficients, variances, measured, fresh, covariance, towards, spreads, gains):  # type: ignore[no-untyped-def]
    """Variances `spreads` (n,) of the innovations of a run and `gains` (n, p) of the means before each.

    A run that is not `fresh` begins with p measured samples, of which only the past is needed. `covariance`
    (p, p) and `towards` (p,) are scratch.
    """
    order = len(variances) - 1
    covariance[:, :] = 0.0
    for k in range(0 if fresh else order, len(measured)):
        j = min(k, order)
        spread = variances[j]
        for i in range(order):
            value = 0.0
            for m in range(j):
                value += coefficients[j, m] * covariance[m, i]
            towards[i] = value
        for i in range(j):
            spread += coefficients[j, i] * towards[i]
        spreads[k] = spread
        if measured[k]:
            for i in range(order):
                gains[k, i] = towards[i] / spread
            for i in range(order - 1, 0, -1):
                for m in range(order - 1, 0, -1):
                    covariance[i, m] = covariance[i - 1, m - 1] - towards[i - 1] * gains[k, m - 1]
            for i in range(order):
                covariance[0, i] = covariance[i, 0] = 0.0
        else:
            for i in range(order):
                gains[k, i] = 0.0
            for i in range(order - 1, 0, -1):
                for m in range(order - 1, 0, -1):
                    covariance[i, m] = covariance[i - 1, m - 1]
            for i in range(1, order):
                covariance[0, i] = covariance[i, 0] = towards[i - 1]
            if order > 0:
                covariance[0, 0] = spread


@njit(cache=True, nogil=True, error_model="numpy")
def _runs(measured, order):  # type: ignore[no-untyped-def]
    """Where runs about holes begin, from p samples before one to p behind, and their lengths.

    Holes with p measured samples between them are in two: of what came before these nothing is missed.
    """
    samples = len(measured)
    begins, lengths = [0 for _ in range(0)], [0 for _ in range(0)]
    hole = 0
    while True:
        while hole < samples and measured[hole]:
            hole += 1
        if hole == samples:
            return np.array(begins, dtype=np.int64), np.array(lengths, dtype=np.int64)
        begin, last = max(hole - order, 0), hole
        end = hole + 1
        while end < samples and end <= last + order:
            if not measured[end]:
                last = end
            end += 1
        end = min(last + order + 1, samples)
        begins.append(begin)
        lengths.append(end - begin)
        hole = end


@njit(cache=True, nogil=True, error_model="numpy")
def _bridged(measured, coefficients, variances, first, begins, lengths, spreads, gains):  # type: ignore[no-untyped-def]
    order = len(variances) - 1
    covariance, towards = np.zeros((order, order)), np.zeros(order)
    logarithms, at = 0.0, 0
    for number in range(len(begins)):
        begin, length = begins[number], lengths[number]
        run = measured[begin : begin + length]
        own = slice(at, at + length)
        _gains(coefficients, variances, run, begin == 0, covariance, towards, spreads[own], gains[own])
        for k in range(0 if begin == 0 else order, length):
            if begin + k >= first:
                logarithms -= 0.5 * np.log(variances[min(k, order)])
                if run[k]:
                    logarithms += 0.5 * np.log(spreads[at + k])
        at += length
    return logarithms


@njit(cache=True, nogil=True, error_model="numpy")
def _whitened(rows, measured, coefficients, first, begins, lengths, spreads, gains, result):  # type: ignore[no-untyped-def]
    order = gains.shape[1]
    longest = 0
    for length in lengths:
        longest = max(longest, length)
    for c in range(len(rows)):
        values, at = np.zeros(longest), 0
        for number in range(len(begins)):
            begin, length = begins[number], lengths[number]
            for k in range(length):
                values[k] = rows[c, begin + k]
            for k in range(0 if begin == 0 else order, length):
                j, mean, left = min(k, order), 0.0, 0.0
                for m in range(j):
                    mean += coefficients[j, m] * values[k - 1 - m]
                if measured[begin + k]:
                    left = values[k] - mean
                    for m in range(j):
                        values[k - 1 - m] += gains[at + k, m] * left
                else:
                    values[k] = mean
                if begin + k >= first:
                    result[c, begin + k - first] = left / np.sqrt(spreads[at + k])
            at += length


@njit(cache=True, nogil=True, error_model="numpy")
def _corrections(  # type: ignore[no-untyped-def]
    residuals, partial, precision, robust, begins, lengths, pattern_of, measured, pattern_begins, fresh,
    terms, logarithms,
):  # fmt: skip
    walkers, order = partial.shape
    coefficients, variances = np.zeros((order + 1, max(order, 1))), np.ones(order + 1)
    covariance, towards = np.zeros((order, order)), np.zeros(order)
    spreads, gains = np.zeros(len(measured)), np.zeros((len(measured), order))
    patterns = len(fresh)
    of_pattern, longest = np.zeros(patterns), 0
    for i in range(patterns):
        longest = max(longest, pattern_begins[i + 1] - pattern_begins[i])
    values, few = np.zeros(longest), np.zeros((SIDE_BY_SIDE, len(residuals)))
    for walker in range(walkers):
        if walker % SIDE_BY_SIDE == 0:
            for k in range(len(residuals)):
                for other in range(min(SIDE_BY_SIDE, walkers - walker)):
                    few[other, k] = residuals[k, walker + other]
        _predictors(partial[walker], coefficients, variances)
        for i in range(patterns):
            one = slice(pattern_begins[i], pattern_begins[i + 1])
            _gains(
                coefficients,
                variances,
                measured[one],
                fresh[i],
                covariance,
                towards,
                spreads[one],
                gains[one],
            )
            change = 0.0
            start = 0 if fresh[i] else order
            for k in range(start, pattern_begins[i + 1] - pattern_begins[i]):
                change -= 0.5 * np.log(variances[min(k, order)])
                if measured[pattern_begins[i] + k]:
                    change += 0.5 * np.log(spreads[pattern_begins[i] + k])
            of_pattern[i] = change
        total, change = 0.0, 0.0
        for run in range(len(begins)):
            i, length = pattern_of[run], lengths[run]
            own = few[walker % SIDE_BY_SIDE, begins[run] : begins[run] + length]
            change += of_pattern[i]
            for k in range(length):
                values[k] = own[k]
            for k in range(0 if fresh[i] else order, length):
                j, at = min(k, order), pattern_begins[i] + k
                complete, mean = own[k], 0.0
                for m in range(j):
                    complete -= coefficients[j, m] * own[k - 1 - m]
                    mean += coefficients[j, m] * values[k - 1 - m]
                complete *= complete / variances[j]
                total -= np.log1p(precision[walker] * complete) if robust else complete
                if measured[at]:
                    left = values[k] - mean
                    for m in range(j):
                        values[k - 1 - m] += gains[at, m] * left
                    left *= left / spreads[at]
                    total += np.log1p(precision[walker] * left) if robust else left
                else:
                    values[k] = mean
        terms[walker], logarithms[walker] = total, change
