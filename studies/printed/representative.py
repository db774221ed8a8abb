"""A member of a rounding box that can be an axis: an exact integrator, stable, and flat at low frequency."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.linear import LinearBlock, polynomial_roots
from printed.rounding_box import RoundingBox

SLOW_SCALE = np.array([1e-2, 1e-4, 1e-2])
"""Size of the slow factors' coefficients in powers of z - 1; it conditions the search."""


def find_representative(box: RoundingBox, slow_pole_limit: float) -> LinearBlock:
    """The member of `box` nearest to its centre that can be a velocity-driven axis.

    Nearest in the sum of squared displacements, in half widths, over all uncertain coefficients, subject to

    1. A(1) = 0 exactly: velocity commands move the angle for good;
    2. the two slow poles, those that share the neighbourhood of z = 1 with the integrator, have modulus
       at most `slow_pole_limit` < 1;
    3. the velocity gain at zero frequency equals its plateau above the slow poles: the two slow zeros z and
       poles p satisfy prod(1 - z) = prod(1 - p). A constant command then moves the axis the same way and
       nearly as fast as a slowly alternating one.

    With the slow factors given, the remaining factors of A and B enter the coefficients linearly and follow
    from least squares (variable projection, Golub and Pereyra, doi 10.1137/0710036); the search has three
    unknowns: the sum of 1 - p, the common product, the sum of 1 - z.

    Raises InputError when the search fails, or its result leaves the box or is unstable elsewhere.
    """
    lead = int(np.flatnonzero(box.numerator)[0])
    numerator, numerator_width = box.numerator[lead:], box.numerator_half_width[lead:]
    denominator, denominator_width = box.denominator[1:], box.denominator_half_width[1:]

    def remaining(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        pole_sum, product, zero_sum = x * SLOW_SCALE
        poles_map = _product_matrix(
            np.convolve([1.0, -1.0], _slow_factor(pole_sum, product)), len(denominator) - 2
        )
        zeros_map = _product_matrix(_slow_factor(zero_sum, product), len(numerator) - 2)
        other_poles, pole_misfit = _weighted_least_squares(
            poles_map[1:, 1:], denominator - poles_map[1:, 0], denominator_width
        )
        other_zeros, zero_misfit = _weighted_least_squares(zeros_map, numerator, numerator_width)
        return (
            np.concatenate([[1.0], other_poles]),
            other_zeros,
            np.concatenate([pole_misfit, zero_misfit]),
        )

    def distance(x: FloatArray) -> float:
        return float(np.sum(remaining(x)[2] ** 2))

    def inside(x: FloatArray) -> FloatArray:
        pole_sum, product, _ = x * SLOW_SCALE
        _, linear, constant = _slow_factor(pole_sum, product)
        r = slow_pole_limit
        return np.array([(r * r + linear * r + constant) / SLOW_SCALE[1], 1 - constant / r**2])

    p = 1 - slow_pole_limit
    start = np.array([2 * p, p * p, 2 * p]) / SLOW_SCALE
    result = optimize.minimize(
        distance,
        start,
        method="SLSQP",
        constraints=optimize.NonlinearConstraint(inside, 0, np.inf),
        options={"ftol": 1e-13, "maxiter": 500},
    )
    if not result.success:
        raise InputError(f"rounding box: the search for a representative failed, {result.message}")
    pole_sum, product, zero_sum = result.x * SLOW_SCALE
    other_poles, other_zeros, _ = remaining(result.x)
    poles = np.concatenate(
        [[1.0], polynomial_roots(_slow_factor(pole_sum, product)), polynomial_roots(other_poles)]
    )
    zeros = np.concatenate([polynomial_roots(_slow_factor(zero_sum, product)), polynomial_roots(other_zeros)])
    delay = lead + len(zeros) - len(poles)
    block = LinearBlock(zeros, poles, float(other_zeros[0]), delay)
    block.check_stable()
    displacement = np.concatenate(box.displacement(*block.coefficients()))
    if np.abs(displacement).max() > 1:
        raise InputError("rounding box: its nearest representative lies outside; relax the limit")
    return block


def _slow_factor(total: float, product: float) -> FloatArray:
    """z^2 + ... with roots r1, r2 for total = (1 - r1) + (1 - r2) and product = (1 - r1)(1 - r2)."""
    return np.array([1.0, total - 2.0, 1.0 - total + product])


def _product_matrix(factor: FloatArray, columns: int) -> FloatArray:
    """The matrix (columns + len(factor) - 1, columns) that multiplies a polynomial by `factor`."""
    matrix = np.zeros((columns + len(factor) - 1, columns))
    for column in range(columns):
        matrix[column : column + len(factor), column] = factor
    return matrix


def _weighted_least_squares(
    matrix: FloatArray, target: FloatArray, width: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solution and misfit of matrix x = target in units of `width`."""
    least_squares = np.linalg.lstsq(matrix / width[:, None], target / width, rcond=None)
    solution = np.asarray(least_squares[0], dtype=np.float64)
    return solution, (matrix @ solution - target) / width
