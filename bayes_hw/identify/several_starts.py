"""Output-error estimation from several starts, against local minima.

Gauss-Newton from one start can end in a wrong minimum: an integrator turns a small error of a saturation
limit into a drift that grows over the whole record, and the sum of squares is then far from quadratic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.output_error import OutputErrorFit, fit_output_error, simulated_outputs
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

SPREAD = 0.4
"""Standard deviation of a start about the nominal model, in units of half the prior's central 68 %."""

CANDIDATES_PER_START = 32
"""Each jittered start is the best of so many draws, by its sum of squares before any descent."""

AGREEMENT = 0.01
"""Starts agree when their sums of squares exceed the smallest one by no more than this fraction."""


@dataclass(frozen=True, eq=False)
class SeveralStarts:
    """The outcome of all starts, with the plain fit that each start reached.

    `sums_of_squares` (starts,) of the plain (unwhitened) residual that each start reached, output units
    squared, the nominal start first; `agreeing` counts the starts within AGREEMENT of the smallest.
    """

    best: OutputErrorFit
    fits: tuple[OutputErrorFit, ...]
    sums_of_squares: FloatArray
    agreeing: int


def fit_from_several_starts(
    axis: AxisParameters,
    records: Sequence[Record],
    *,
    rng: np.random.Generator,
    starts: int = 12,
) -> SeveralStarts:
    """Minimise the plain output error from `starts` points.

    The first start is the nominal model; the others are drawn about it in coordinates (see SPREAD), initial
    states excepted, since the output depends on those almost linearly. Residuals are plain, because whitening
    hides the slow error that tells wrong minima apart.
    """
    plain = [fit_output_error(axis, records, start) for start in _start_points(axis, records, rng, starts)]
    sums = np.array([fit.plain_sum_of_squares for fit in plain])
    agreeing = int(np.count_nonzero(sums <= (1 + AGREEMENT) * sums.min()))
    return SeveralStarts(plain[int(np.argmin(sums))], tuple(plain), sums, agreeing)


def _start_points(
    axis: AxisParameters, records: Sequence[Record], rng: np.random.Generator, starts: int
) -> list[FloatArray]:
    """The nominal values, then for each further start the best of CANDIDATES_PER_START draws."""
    nominal = axis.nominal
    points = [nominal]
    centre = as_coordinates(axis.parameters, nominal)
    spread = SPREAD * _prior_half_widths(axis)
    for _ in range(starts - 1):
        draws = centre[:, None] + spread[:, None] * rng.standard_normal((len(centre), CANDIDATES_PER_START))
        values = as_values(axis.parameters, draws)
        errors = np.zeros(CANDIDATES_PER_START)
        for record, output in zip(records, simulated_outputs(axis, values, records), strict=True):
            errors += np.sum((record.y - output)[:, record.measured_samples] ** 2, axis=1)
        points.append(values[:, int(np.argmin(np.nan_to_num(errors, nan=np.inf)))])
    return points


def _prior_half_widths(axis: AxisParameters) -> FloatArray:
    """Half the central 68 % of every prior in coordinates, zero for initial states."""
    widths = np.zeros(len(axis.parameters))
    for index, parameter in enumerate(axis.parameters):
        if parameter.name.startswith("start"):
            continue
        low, high = parameter.transform.to_coordinate(parameter.prior.quantile(np.array([0.1587, 0.8413])))
        widths[index] = abs(high - low) / 2
    return widths
