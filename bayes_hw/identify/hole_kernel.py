"""Compiled filter of an autoregression with samples that were not measured; see `holes` for what it is.

Predictors of orders 0 to p stand in `coefficients` (p + 1, p), their innovations' variances over that of
order p in `variances` (p + 1,); runs of samples about holes begin at `begins` and are `lengths` long.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside

SIDE_BY_SIDE = 8
"""Walkers whose residuals lie in one line of the cache."""


@compiled(nogil=True)
def fill_predictors(partial, coefficients, variances):  # type: ignore[no-untyped-def]
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


@compiled_inside
def _gains(coefficients, variances, measured, fresh, covariance, towards, spreads, gains):  # type: ignore[no-untyped-def]
    """Variances `spreads` (n,) of the innovations of a run and `gains` (n, p) of the means before each.

    A run that is not `fresh` begins with p measured samples, of which only the past is needed. `covariance`
    (p, p) and `towards` (p,) are scratch: what is known of sample k stands at k modulo p, and only samples of
    the last p that were not measured are uncertain.
    """
    order = len(variances) - 1
    if order == 0:
        spreads[:] = variances[0]
        return
    covariance[:, :] = 0.0
    uncertain = np.zeros(order, dtype=np.bool_)
    for k in range(0 if fresh else order, len(measured)):
        j, own = min(k, order), k % order
        towards[:] = 0.0
        for m in range(j):
            at = (k - 1 - m) % order
            if uncertain[at]:
                share = coefficients[j, m]
                for i in range(order):
                    towards[i] += share * covariance[at, i]
        spread = variances[j]
        for m in range(j):
            spread += coefficients[j, m] * towards[(k - 1 - m) % order]
        spreads[k] = spread
        if measured[k]:
            for m in range(order):
                gains[k, m] = towards[(k - 1 - m) % order] / spread
            for at in range(order):
                if uncertain[at]:
                    share = towards[at] / spread
                    for i in range(order):
                        covariance[at, i] -= share * towards[i]
            for i in range(order):
                covariance[own, i] = covariance[i, own] = 0.0
        else:
            for i in range(order):
                gains[k, i] = 0.0
                covariance[own, i] = covariance[i, own] = towards[i]
            covariance[own, own] = spread
        uncertain[own] = not measured[k]


@compiled(nogil=True)
def runs_about_holes(measured, order):  # type: ignore[no-untyped-def]
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


@compiled(nogil=True)
def bridge(measured, coefficients, variances, first, begins, lengths, spreads, gains):  # type: ignore[no-untyped-def]
    """Fills `spreads` (n,) and `gains` (n, p) of the runs of a record, one after another; the change of the
    sum of the logarithms of the innovations' standard deviations from sample `first` on."""
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


@compiled(nogil=True)
def whiten_runs(rows, measured, coefficients, first, begins, lengths, spreads, gains, result):  # type: ignore[no-untyped-def]
    """Fills `result` (rows, samples - first) about holes with innovations over their standard deviations."""
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


@compiled(nogil=True)
def correct_sums(  # type: ignore[no-untyped-def]
    residuals, partial, precision, robust, begins, lengths, pattern_of, measured, pattern_begins, fresh,
    terms, logarithms,
):  # fmt: skip
    """Fills the changes (walkers,) that `Holes.corrections` tells, every walker under its own noise."""
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
        fill_predictors(partial[walker], coefficients, variances)
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
