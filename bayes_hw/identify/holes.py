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

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.identify.hole_kernel import bridge, correct_sums, fill_predictors, runs_about_holes, whiten_runs
from bayes_hw.record import Record

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
    fill_predictors(partial, coefficients, variances)
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
        begins, lengths = runs_about_holes(measured, order)
        spreads, gains = np.zeros(int(lengths.sum())), np.zeros((int(lengths.sum()), order))
        change = bridge(measured, coefficients, variances, first, begins, lengths, spreads, gains)
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
        whiten_runs(
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
        firsts, lengths = runs_about_holes(measured, order)
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
        correct_sums(
            np.ascontiguousarray(residuals),
            np.ascontiguousarray(partial.T),
            np.zeros(walkers) if precision is None else precision,
            precision is not None,
            self.begins, self.lengths, self.pattern_of, self.measured, self.pattern_begins, self.fresh,
            terms, logarithms,
        )  # fmt: skip
        return terms, logarithms
