"""Limits begun elsewhere: none leads back from where it clips next to nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_basis import linear_basis, with_linear_solution
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.levels import level_shapes
from bayes_hw.identify.growth.lowered import clipped, commands
from bayes_hw.record import Record

SHARES = np.linspace(0.15, 0.95, 9)
"""Of the outermost place of a limit: where it is begun."""

AT_OUTERMOST = 0.999
"""Share of the outermost place from which a limit stands there."""

MOST_ROWS = 4000
"""Samples, evenly taken, that weights are sought on."""


def with_limits_anew(response: CascadeResponse, values: CascadeValues) -> CascadeValues | None:
    """`values` with every limit that stands at its outermost place at the one of SHARES that explains most,
    the weights of G by least squares; None where no limit stands there."""
    structure, (lower, upper) = response.structure, response.outermost_limits
    lowers = SHARES * lower if structure.lower and values.lower < AT_OUTERMOST * lower else [values.lower]
    uppers = SHARES * upper if structure.upper and values.upper > AT_OUTERMOST * upper else [values.upper]
    if len(lowers) == len(uppers) == 1:
        return None
    trials = [replace(values, lower=float(below), upper=float(above)) for below in lowers for above in uppers]
    solved = [with_least_squares(structure, trial, response.records) for trial in trials]
    return min(solved, key=lambda pair: pair[0])[1]


def with_least_squares(
    structure: Structure, values: CascadeValues, records: Sequence[Record]
) -> tuple[float, CascadeValues]:
    """What the weights of G (and initial states, and free levels) that explain most leave, a mean square of
    the samples outside the dead zone; and `values` with them."""
    limited = [clipped(commands(record), values.lower, values.upper) for record in records]
    shapes = level_shapes(records)
    columns, targets = [], []
    for number, (basis, record) in enumerate(
        zip(linear_basis(structure, values, limited), records, strict=True)
    ):
        levels = np.zeros((len(records), len(record)))
        levels[number] = shapes[number]
        outside = record.measured_samples & (record.y != 0)
        columns.append(np.concatenate([basis, levels])[:, outside])
        targets.append((record.y + values.half_width * np.sign(record.y))[outside])
    target = np.concatenate(targets)
    every = max(1, len(target) // MOST_ROWS)
    matrix, target = np.concatenate(columns, axis=1)[:, ::every].T, target[::every]
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    left = float(np.mean((target - matrix @ solution) ** 2))
    return left, with_linear_solution(structure, values, solution[: len(solution) - len(records)])
