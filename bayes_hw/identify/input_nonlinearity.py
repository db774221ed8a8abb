"""Step 2: the input nonlinearity, rebuilt without assuming its shape, then fitted by a saturation.

With G held, w = G f(u) is linear in the coefficients of f on a basis of hinges, f(u) = c0 u + sum_j c_j
h_j(u), where h_j(u) = max(u - knot, 0) or min(u - knot, 0). They follow from least squares on the
increments of the output, taken where it moves clear of a dead zone. G is then solved for again with the
saturated command, and both once more.

Step 3: the output nonlinearity, from w simulated with the saturation of step 2 and the measured y.

For every trial half width delta the inverse of the dead zone turns y into w where y has left zero; G's
residues are solved for on it, and the whole cascade is simulated. The delta with the smallest output error
is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure, intermediate_signal
from bayes_hw.identify.cascade_fit import (
    CascadeFit,
    difference,
    evaluated,
    scaled_least_squares,
    solve_linear_part,
)
from bayes_hw.identify.experiment import OUTSIDE_NOISE, Experiment

KNOTS_PER_SIDE = 7
GRID_POINTS = 201
ROUNDS = 2


@dataclass(frozen=True, eq=False)
class InputNonlinearity:
    """`command` and `rebuilt` (points,) are u and f(u) on the hinge basis; `lower`, `upper` the saturation
    fitted to it (at the extreme commands where no limit was found); `values` is G solved for with the
    saturated command.
    """

    command: FloatArray
    rebuilt: FloatArray
    lower: float
    upper: float
    values: CascadeValues


def estimate_input_nonlinearity(
    experiment: Experiment, structure: Structure, linear: CascadeValues
) -> InputNonlinearity:
    """Rebuild f from the records and G, and fit the limits; `structure` is that of `linear`, started at
    rest."""
    commands = np.concatenate(experiment.commands)
    lowest, highest = min(float(commands.min()), 0.0), max(float(commands.max()), 0.0)
    grid = np.linspace(lowest, highest, GRID_POINTS)
    half = (grid[1] - grid[0]) / 2
    density = np.histogram(commands, bins=np.append(grid - half, grid[-1] + half))[0].astype(float)
    values = linear
    for _ in range(ROUNDS):
        curve = _rebuild(experiment, structure, values, grid)
        slope, lower, upper = fit_saturation(grid, curve, density)
        saturated = [np.clip(u, lower, upper) for u in experiment.commands]
        values, _ = solve_linear_part(
            structure,
            values,
            saturated,
            experiment.outputs,
            experiment.moving,
            differenced=True,
        )
    return InputNonlinearity(grid, curve / slope, lower, upper, values)


def fit_saturation(command: FloatArray, curve: FloatArray, weight: FloatArray) -> tuple[float, float, float]:
    """Slope and limits of slope * min(max(u, lower), upper) nearest to `curve` in weighted least squares.

    `command` is increasing and contains zero or has it as an end; every pair of its points is tried as
    limits. Since the two sides meet at zero alone, each sum over u is one sum per limit.
    """
    below, above = np.minimum(command, 0), np.maximum(command, 0)
    limits_down, limits_up = _limits(command, -1), _limits(command, 1)
    left = np.maximum(below, limits_down[:, None])
    right = np.minimum(above, limits_up[:, None])
    cross = (left @ (weight * curve))[:, None] + (right @ (weight * curve))[None, :]
    square = (left**2 @ weight)[:, None] + (right**2 @ weight)[None, :]
    gained = np.where(square > 0, cross**2 / np.where(square > 0, square, 1), 0)
    down, up = np.unravel_index(int(np.argmax(gained)), gained.shape)
    return (
        float(cross[down, up] / square[down, up]),
        float(limits_down[down]),
        float(limits_up[up]),
    )


def _limits(command: FloatArray, sign: int) -> FloatArray:
    """The points of one side as limits, or its missing extreme, zero, when the side has none."""
    side = command[sign * command > 1e-12]
    return side if side.size else np.zeros(1)


def _rebuild(
    experiment: Experiment, structure: Structure, values: CascadeValues, grid: FloatArray
) -> FloatArray:
    knots = np.concatenate(
        [
            np.linspace(0, extreme, KNOTS_PER_SIDE + 2)[1:-1]
            for extreme in (grid[0], grid[-1])
            if abs(extreme) > 1e-12
        ]
    )
    linear = replace(structure, lower=False, upper=False, dead_zone=False)
    rows, right = [], []
    for record, moving in zip(experiment.records, experiment.moving, strict=True):
        signals = [
            intermediate_signal(linear, values, [replace(record, u=hinge)])[0]
            for hinge in _hinges(record.u, knots)
        ]
        chosen = moving > 0
        rows.append(difference(np.array(signals))[:, chosen].T)
        right.append(difference(record.y)[chosen])
    coefficients = scaled_least_squares(np.concatenate(rows), np.concatenate(right))
    return coefficients @ _hinges(grid, knots)


def _hinges(u: FloatArray, knots: FloatArray) -> FloatArray:
    bent = [np.maximum(u - k, 0) if k > 0 else np.minimum(u - k, 0) for k in knots]
    return np.array([u, *bent])


TRIALS = 16
LARGEST_SHARE = 1.5
"""Largest half width tried, in units of the largest |y|."""


@dataclass(frozen=True, eq=False)
class OutputNonlinearity:
    """`intermediate` and `output` (measured samples,) are w simulated and y measured; `fit` is the cascade at
    the best of the half widths tried."""

    intermediate: FloatArray
    output: FloatArray
    fit: CascadeFit


def estimate_output_nonlinearity(
    experiment: Experiment, structure: Structure, values: CascadeValues
) -> OutputNonlinearity:
    """Fit delta with the limits of `values` and the denominators of G held.

    `structure` has its saturation but no dead zone.
    """
    largest = max(float(np.abs(y).max()) for y in experiment.outputs)
    smallest = min(experiment.noise_level, 0.1 * largest)
    trials = np.concatenate([[0.0], np.geomspace(smallest, LARGEST_SHARE * largest, TRIALS)])
    fits = [at_half_width(experiment, structure, values, float(trial)) for trial in trials]
    best = min(fits, key=lambda fit: fit.rms)
    signals = intermediate_signal(best.structure, best.values, experiment.records)
    known = np.concatenate([record.measured_samples for record in experiment.records])
    outputs = np.concatenate(experiment.outputs)
    return OutputNonlinearity(np.concatenate(signals)[known], outputs[known], best)


def at_half_width(
    experiment: Experiment, structure: Structure, values: CascadeValues, half_width: float
) -> CascadeFit:
    """The cascade with residues (and initial states) solved for at a given half width, not descended
    further."""
    structure = replace(structure, dead_zone=half_width > 0)
    values = replace(values, half_width=half_width)
    commands = [np.clip(u, values.lower, values.upper) for u in experiment.commands]
    solved, _ = solve_linear_part(
        structure,
        values,
        commands,
        inverse_dead_zone(experiment.outputs, half_width),
        _outside(experiment, half_width),
        differenced=False,
    )
    candidates = [solved] if structure.free_start else [solved, values]
    return min(
        (evaluated(structure, item, experiment.records) for item in candidates),
        key=lambda fit: fit.sum_of_squares,
    )


def inverse_dead_zone(outputs: Sequence[FloatArray], half_width: float) -> list[FloatArray]:
    """y + half_width sign(y): w wherever y is not zero."""
    return [y + half_width * np.sign(y) for y in outputs]


def _outside(experiment: Experiment, half_width: float) -> list[FloatArray]:
    """Samples at which the sign of y tells the side of the dead zone; all of them where there is none."""
    everywhere = [record.measured_samples.astype(float) for record in experiment.records]
    if half_width == 0:
        return everywhere
    threshold = OUTSIDE_NOISE * experiment.noise_level
    masks = [m * (np.abs(y) > threshold) for m, y in zip(everywhere, experiment.outputs, strict=True)]
    return masks if sum(m.sum() for m in masks) > 0 else everywhere
