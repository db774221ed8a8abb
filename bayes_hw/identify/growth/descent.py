"""Levenberg-Marquardt descent of a response on coloured noise, the noise estimated again on the way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeGuard

import numpy as np
from scipy import linalg

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.levels import WHITE, free_levels, levelled, with_level_rows
from bayes_hw.identify.holes import mask_of, measured_count
from bayes_hw.identify.noise import MAX_ORDER
from bayes_hw.time_budget import time_is_up

FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-9, 1e7
STEPS_BETWEEN_NOISE = 3
"""Accepted steps after which the noise is estimated again."""

SMALL_GAIN_NATS = 1.0
"""A step that gains less has the noise estimated again at once."""

CONVERGED_NATS = 0.02
"""A descent ends when a step with fresh noise gains less log-likelihood than this."""

MOST_CUT = 0.5
"""Share of a coordinate's step that its bounds may take off before it is held and the others go alone."""

LARGEST_DERIVATIVE = 1e140
"""The squares of larger ones are not finite: a trial on its way out of any sense."""


class Response(Protocol):
    """What a descent needs: residuals, NaN where nothing was measured, their derivatives, and which
    coordinates mean something. `masks` say what was measured of every record, None where all was;
    `level_shapes` what a free level adds to its residuals (see `levels`)."""

    @property
    def masks(self) -> Sequence[BoolArray] | None: ...

    @property
    def level_shapes(self) -> Sequence[FloatArray]: ...

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]: ...

    def linearise(
        self, coordinates: FloatArray, overlap: int
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]: ...

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray: ...


class PriorResponse(Protocol):
    """A response some of whose coordinates have a normal prior about zero."""

    def prior_precision(self) -> FloatArray:
        """Inverse variances (size,); zero where nothing is known."""
        ...


class NoiseResponse(Protocol):
    """A response that says what its noise is like."""

    def noise_of(self, residuals: Sequence[FloatArray], most: int, previous: Whitener | None) -> Whitener:
        """The noise of residuals, of order up to `most` where it is a free autoregression; `previous` is what
        was found before."""
        ...


def _has_prior(response: object) -> TypeGuard[PriorResponse]:
    return hasattr(response, "prior_precision")


def _says_its_noise(response: object) -> TypeGuard[NoiseResponse]:
    return hasattr(response, "noise_of")


@dataclass(frozen=True, eq=False)
class Point:
    """Where a descent stands: coordinates (size,), residuals of every record less its level where that is
    free (NaN where nothing was measured, see `masks`), noise, log-likelihood (and log-prior, up to its
    constant, where the response has one). The noise is estimated with orders up to `most_noise`."""

    coordinates: FloatArray
    residuals: tuple[FloatArray, ...]
    whitener: Whitener
    log_likelihood: float
    converged: bool = False
    masks: Sequence[BoolArray] | None = None
    most_noise: int = MAX_ORDER

    @property
    def samples(self) -> int:
        """That were measured."""
        return measured_count(self.residuals, self.masks)

    @property
    def known(self) -> tuple[FloatArray, ...]:
        """The residuals of what was measured, without holes."""
        if self.masks is None:
            return self.residuals
        return tuple(e[mask] for e, mask in zip(self.residuals, self.masks, strict=True))

    @property
    def sum_of_squares(self) -> float:
        """Of the innovations."""
        return self.whitener.sum_of_squares(self.residuals, self.masks)

    def variance_by(self, factor: FloatArray) -> float:
        """Square of the unit in which a `triangular_factor` (size + 1, size + 1) here states precision: the
        innovations' variance, over what one of them tells of a parameter."""
        return float(np.sum(factor[:, -1] ** 2)) / self.samples / self.whitener.information

    @property
    def rms(self) -> float:
        """Root mean square residual, output units."""
        return float(np.sqrt(sum(float(e @ e) for e in self.known) / self.samples))


def evaluate(
    response: Response,
    coordinates: FloatArray,
    whitener: Whitener | None = None,
    most_noise: int = MAX_ORDER,
) -> Point:
    """The point at `coordinates`, its noise estimated there unless given."""
    residuals = residuals_at(response, coordinates, whitener or WHITE)
    masks = response.masks
    if whitener is None:
        whitener = _fresh_noise(response, residuals, most_noise)
        residuals = levelled(residuals, response.level_shapes, whitener, masks)
    likelihood = whitener.log_likelihood(residuals, masks) + log_prior(response, coordinates)
    return Point(coordinates, residuals, whitener, likelihood, masks=masks, most_noise=most_noise)


def residuals_at(response: Response, coordinates: FloatArray, whitener: Whitener) -> tuple[FloatArray, ...]:
    """Residuals of every record less what a free level explains of them under that noise."""
    return levelled(response.residuals(coordinates), response.level_shapes, whitener, response.masks)


def _fresh_noise(
    response: Response, residuals: Sequence[FloatArray], most: int, previous: Whitener | None = None
) -> Whitener:
    if _says_its_noise(response):
        return response.noise_of(residuals, most, previous)
    return Whitener.of_residuals(residuals, most)


def prior_precision(response: Response, coordinates: FloatArray) -> FloatArray:
    """Inverse variances (size,) of the coordinates' priors; zero where nothing is known."""
    return response.prior_precision() if _has_prior(response) else np.zeros(len(coordinates))


def log_prior(response: Response, coordinates: FloatArray) -> float:
    """Up to its constant; zero without one."""
    return -0.5 * float(np.sum(prior_precision(response, coordinates) * coordinates**2))


def innovations(point: Point, residuals: Sequence[FloatArray] | None = None) -> list[FloatArray]:
    """Innovations of every record under a point's noise, of its own or of other residuals, of the samples
    that were measured."""
    found = whitened(point, point.residuals if residuals is None else residuals)
    if point.masks is None:
        return found
    return [white[measured] for white, measured in zip(found, point.masks, strict=True)]


def whitened(point: Point, residuals: Sequence[FloatArray]) -> list[FloatArray]:
    """Innovations of every sample (samples,) of every record under a point's noise, zero where nothing was
    measured."""
    masks = (mask_of(point.masks, number) for number in range(len(residuals)))
    return [point.whitener.apply(e[None, :], 0, mask)[0] for e, mask in zip(residuals, masks, strict=True)]


def whitened_blocks(response: Response, coordinates: FloatArray, whitener: Whitener) -> Iterator[FloatArray]:
    """Innovations (levels + size + 1, samples) of derivatives and, as the last row, residual, parts of all
    records in turn; in front a row for every free level."""
    blocks = response.linearise(coordinates, whitener.order)
    for rows, first, measured in with_level_rows(blocks, response.level_shapes):
        yield whitener.apply(rows, first, measured)


def counted_blocks(response: Response, coordinates: FloatArray, whitener: Whitener) -> Iterator[FloatArray]:
    """`whitened_blocks`, every sample by how much it counts: as much as any other where noise is normal."""
    for block in whitened_blocks(response, coordinates, whitener):
        yield block * np.sqrt(whitener.counted(block[-1])) if whitener.has_heavy_tails else block


def triangular_factor(response: Response, point: Point) -> FloatArray:
    """R (size + 1, size + 1) of the whitened derivatives and residual less what free levels explain of them,
    without holding all of them."""
    factor: FloatArray | None = None
    for block in counted_blocks(response, point.coordinates, point.whitener):
        stacked = block.T if factor is None else np.concatenate([factor, block.T])
        if not np.isfinite(stacked).all() or np.abs(stacked).max(initial=0.0) > LARGEST_DERIVATIVE:
            raise FloatingPointError("derivatives are not finite, or their squares are not")
        factor = linalg.qr(stacked, mode="r", overwrite_a=True, check_finite=False)[0][: len(block)]
    assert factor is not None
    levels = len(free_levels(response.level_shapes))
    factor = factor[levels:, levels:]
    if _has_prior(response):
        root = np.sqrt(response.prior_precision() * (np.sum(factor[:, -1] ** 2) / point.samples))
        known = np.column_stack([np.diag(root), -root * point.coordinates])[root > 0]
        stacked = np.concatenate([factor, known])
        factor = linalg.qr(stacked, mode="r", overwrite_a=True, check_finite=False)[0][: factor.shape[1]]
    return factor


def normal_matrix(response: Response, point: Point) -> FloatArray:
    """R'R (size + 1, size + 1) of `triangular_factor`'s R, without holding all derivatives.

    It loses half of R's digits, which a step damped by LEAST_DAMPING or more does not need.
    """
    found: FloatArray | None = None
    for block in counted_blocks(response, point.coordinates, point.whitener):
        with np.errstate(all="ignore"):
            products = block @ block.T
        found = products if found is None else found + products
    assert found is not None
    if not np.isfinite(found).all():
        raise FloatingPointError("derivatives are not finite, or their squares are not")
    if levels := len(free_levels(response.level_shapes)):
        # A level is seen in its own record alone.
        across = found[:levels, levels:]
        found = found[levels:, levels:] - across.T @ (across / np.diag(found)[:levels, None])
    if _has_prior(response):
        known = response.prior_precision() * (found[-1, -1] / point.samples)
        towards = np.column_stack([np.eye(len(known)), -point.coordinates])
        found += towards.T @ (known[:, None] * towards)
    return found


def descend(response: Response, start: Point, steps: int, order: int | None = None) -> Point:
    """At most `steps` accepted steps from `start`, none once time is up; the noise is that of the residuals
    at the end.

    On the way the noise is of `order` where that is given: under white noise (order 0) what is slow is not
    explained by the noise. Marquardt's scaling by column norms; the damping falls by 10 on success and grows
    by 4 on failure.
    """
    if time_is_up():
        return start
    point, damping, accepted, fresh, converged, stuck = start, FIRST_DAMPING, 0, False, False, False
    if order is not None:
        point = _with_fresh_noise(response, point, order)
    reference = point.log_likelihood
    while accepted < steps and not converged and not time_is_up():
        moved = _step(response, point, damping)
        stuck = moved is None
        if moved is None:
            break
        gained = moved[0].log_likelihood - point.log_likelihood
        point, damping = moved
        accepted += 1
        fresh = accepted % STEPS_BETWEEN_NOISE == 0 or gained < SMALL_GAIN_NATS
        if fresh:
            point = _with_fresh_noise(response, point, order)
            converged = point.log_likelihood - reference < CONVERGED_NATS
            reference = point.log_likelihood
    if not fresh or order is not None:
        point = _with_fresh_noise(response, point)
    return replace(point, converged=(converged or stuck) and order is None)


def _with_fresh_noise(response: Response, point: Point, order: int | None = None) -> Point:
    if order is not None:
        whitener = Whitener.of_residuals(point.residuals, point.most_noise, order)
    else:
        whitener = _fresh_noise(response, point.residuals, point.most_noise, point.whitener)
    residuals = levelled(point.residuals, response.level_shapes, whitener, point.masks)
    reached = whitener.log_likelihood(residuals, point.masks) + log_prior(response, point.coordinates)
    return replace(point, residuals=residuals, whitener=whitener, log_likelihood=reached, converged=False)


def _step(response: Response, point: Point, damping: float) -> tuple[Point, float] | None:
    """The next point and its damping, or None where no step gains, or none promises as much as ends a
    descent."""
    try:
        products = normal_matrix(response, point)
    except FloatingPointError:
        return None
    norms = np.sqrt(np.diag(products)[:-1])
    norms[norms == 0] = 1.0
    scaled, target = products[:-1, :-1] / np.outer(norms, norms), products[:-1, -1] / norms
    while damping < LARGEST_DAMPING:
        try:
            step, promised = _solved(scaled, target, damping)
        except linalg.LinAlgError:
            damping *= 4
            continue
        share = min(promised / products[-1, -1], 1 - 1e-12)
        if -0.5 * point.samples * np.log1p(-share) < CONVERGED_NATS:
            return None
        step /= norms
        coordinates = response.admissible(point.coordinates + step, point.coordinates)
        moved = _moved(response, point, coordinates)
        cut = np.abs(coordinates - point.coordinates - step) > MOST_CUT * np.abs(step)
        if moved is None and cut.any() and not cut.all():
            # What hardly acts goes as far as it may: without it the others' step may gain.
            step[cut], free = 0.0, np.ix_(~cut, ~cut)
            step[~cut] = _solved(scaled[free], target[~cut], damping)[0] / norms[~cut]
            coordinates = response.admissible(point.coordinates + step, point.coordinates)
            moved = _moved(response, point, coordinates)
        if moved is not None:
            return moved, max(damping / 10, LEAST_DAMPING)
        damping *= 4
    return None


def _solved(matrix: FloatArray, target: FloatArray, damping: float) -> tuple[FloatArray, float]:
    """The damped step (size,) and how much the sum of squares would fall if all were linear."""
    factor = linalg.cho_factor(matrix + damping * np.eye(len(target)), check_finite=False)
    solution = linalg.cho_solve(factor, target, check_finite=False)
    return solution, float(solution @ (2 * target - matrix @ solution))


def _moved(response: Response, point: Point, coordinates: FloatArray) -> Point | None:
    """The point at other coordinates under the same noise, or None where it is no likelier."""
    with np.errstate(all="ignore"):
        residuals = residuals_at(response, coordinates, point.whitener)
        tried = replace(point, coordinates=coordinates, residuals=residuals, converged=False)
        if not all(np.isfinite(e).all() for e in tried.known):
            return None
        reached = point.whitener.log_likelihood(residuals, point.masks) + log_prior(response, coordinates)
    return replace(tried, log_likelihood=reached) if reached > point.log_likelihood else None
