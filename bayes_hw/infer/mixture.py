"""Mixtures of multivariate Student t distributions: the shape of independence proposals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, special

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.triangular_map import Bend

DEGREES_OF_FREEDOM = 8.0
FITTED_DEGREES = 16.0
FITTED_INFLATION = 1.1
"""Of one component fitted to weighted draws: nearer to a normal density, a little wider than they are."""
TAILS = ((FITTED_DEGREES, FITTED_INFLATION), (32.0, 1.05), (200.0, 1.05))
"""Degrees of freedom and inflation to choose from by the draws that it was fitted to, the heaviest first."""
MINOR_INFLATION = 2.5
"""Of further components: few draws tell their shape, and a wide one costs little."""
FIT_TOLERANCE = 1e-6
FEWEST = 0.001
MINIMUM_SHARE = 0.1
"""Of a component in the mixture, however little of the posterior it holds: what it lacks there holds walkers
for long."""
DEFENSIVE_WEIGHT = 0.1
DEFENSIVE_INFLATION = 4.0


@dataclass(frozen=True, eq=False)
class StudentTMixture:
    """sum_j weight_j t(x; mean_j, scale_j, degrees_of_freedom), the first one bent where there is a `bend`.

    `weights` (components,), `means` (components, dimension), `factors` (components, dimension, dimension):
    lower Cholesky factors of the scale matrices. The arrays are kept contiguous: rounding depends on the
    order in memory, and a mixture read from a checkpoint must give the same numbers to the bit.
    """

    weights: FloatArray
    means: FloatArray
    factors: FloatArray
    degrees_of_freedom: float = DEGREES_OF_FREEDOM
    bend: Bend | None = None

    def __post_init__(self) -> None:
        for name in ("weights", "means", "factors"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name)))

    @property
    def dimension(self) -> int:
        return int(self.means.shape[1])

    def component_log_densities(self, x: FloatArray) -> FloatArray:
        """log(weight_j t_j(x)) of every component, shape (components, points), for x (points, dimension)."""
        nu, d = self.degrees_of_freedom, self.dimension
        constant = special.gammaln((nu + d) / 2) - special.gammaln(nu / 2) - 0.5 * d * np.log(nu * np.pi)
        rows = []
        for j, (weight, factor) in enumerate(zip(self.weights, self.factors, strict=True)):
            standard = self._standard(x, j)
            distance = np.einsum("ni,ni->n", standard, standard)
            log_determinant = np.sum(np.log(np.diag(factor)))
            rows.append(
                np.log(weight) + constant - log_determinant - 0.5 * (nu + d) * np.log1p(distance / nu)
            )
        return np.stack(rows)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log-density (points,) at x (points, dimension)."""
        return _log_sum(self.component_log_densities(x))

    def _bend_of(self, component: int) -> Bend | None:
        """What bends a component: the first one alone."""
        return self.bend if component == 0 else None

    def _standard(self, x: FloatArray, component: int) -> FloatArray:
        """x (points, dimension) unbent, less the component's mean and over its factor."""
        bend = self._bend_of(component)
        straight = x if bend is None else bend.undo(x)
        whitener = linalg.solve_triangular(self.factors[component], np.eye(self.dimension), lower=True)
        return np.asarray((straight - self.means[component]) @ whitener.T)

    def _placed(self, z: FloatArray, component: int) -> FloatArray:
        """The points (points, dimension) of which `_standard` makes z."""
        straight = self.means[component] + z @ self.factors[component].T
        bend = self._bend_of(component)
        return straight if bend is None else bend.apply(straight)

    def opposite(
        self, x: FloatArray, correlation: float, random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray]:
        """Draws (points, dimension) beside the means from x (points, dimension), and the log-density at x.

        With x the draws are in detailed balance with the mixture: a component j is drawn with its probability
        at x, there z = (x - mean_j) / factor_j is normal of a variance s drawn given z (a t distribution is a
        scale mixture of normals), and z' = c z + sqrt(1 - c^2) sqrt(s) e with e standard normal keeps that
        normal distribution for every `correlation` c from -1 to 1: overrelaxation where it is negative
        (Adler, doi 10.1103/PhysRevD.23.2901), an independent draw of the component where it is zero.
        """
        count, d = x.shape
        log_parts = self.component_log_densities(x)
        log_density = _log_sum(log_parts)
        up_to = np.cumsum(np.exp(log_parts - log_density), axis=0)
        component = np.sum(random.random_sample(count) * up_to[-1] > up_to[:-1], axis=0)
        chi_square = random.chisquare(self.degrees_of_freedom + d, size=count)
        normal = np.sqrt(1 - correlation**2) * random.standard_normal((count, d))
        drawn = np.empty_like(normal)
        for j in range(len(self.weights)):
            own = np.flatnonzero(component == j)
            z = self._standard(x[own], j)
            variance = (self.degrees_of_freedom + np.einsum("ni,ni->n", z, z)) / chi_square[own]
            drawn[own] = self._placed(correlation * z + np.sqrt(variance)[:, None] * normal[own], j)
        return drawn, log_density

    def with_tails(self, degrees_of_freedom: float, widening: float) -> StudentTMixture:
        """The same with other degrees of freedom, its scale matrices `widening` times as large."""
        return replace(self, degrees_of_freedom=degrees_of_freedom, factors=self.factors * np.sqrt(widening))

    def sample(self, count: int, random: np.random.RandomState | np.random.Generator) -> FloatArray:
        """`count` draws, shape (count, dimension)."""
        component = random.choice(len(self.weights), size=count, p=self.weights)
        normal = random.standard_normal((count, self.dimension))
        chi_square = random.chisquare(self.degrees_of_freedom, size=count)
        normal *= np.sqrt(self.degrees_of_freedom / chi_square)[:, None]
        drawn = np.empty_like(normal)
        for j in range(len(self.weights)):
            own = np.flatnonzero(component == j)
            drawn[own] = self._placed(normal[own], j)
        return drawn


def _log_sum(log_parts: FloatArray) -> FloatArray:
    """Logarithm (points,) of the sum of components (components, points)."""
    return log_parts[0] if len(log_parts) == 1 else np.asarray(special.logsumexp(log_parts, axis=0))


def laplace_proposal(mode: FloatArray, covariance: FloatArray, inflation: float = 1.0) -> StudentTMixture:
    """One component at the mode, its scale matrix `inflation` times the Laplace covariance."""
    factor = linalg.cholesky(covariance * inflation, lower=True)
    return StudentTMixture(np.ones(1), mode[None, :], factor[None, :, :])


def several_laplace(
    modes: Sequence[tuple[FloatArray, FloatArray]], inflation: float = 1.0
) -> StudentTMixture:
    """A component of equal weight for every mode and covariance."""
    parts = [laplace_proposal(mode, covariance, inflation) for mode, covariance in modes]
    return StudentTMixture(
        np.full(len(parts), 1 / len(parts)),
        np.concatenate([part.means for part in parts]),
        np.concatenate([part.factors for part in parts]),
    )


MOST_BENT = 24
"""Dimensions beyond which a bend, of a coefficient a pair and dimension, costs more than it gains."""


def refitted(
    mixture: StudentTMixture, points: FloatArray, weights: FloatArray, *, bent: bool
) -> StudentTMixture:
    """The components of `mixture` moved to the weighted points (weights of sum one) that each is nearest to.

    With `bent`, the heaviest one, which comes first, is bent as its points are, in MOST_BENT dimensions at
    most. A component with less than FEWEST of the weight, or with fewer effective points than a covariance
    takes (one more than there are dimensions), stays where it is.
    """
    log_parts = mixture.component_log_densities(points)
    membership = np.exp(log_parts - special.logsumexp(log_parts, axis=0)) * weights
    order = np.argsort(-membership.sum(axis=1))
    membership, means, factors = membership[order], mixture.means[order], mixture.factors[order]
    shares = np.maximum(membership.sum(axis=1), MINIMUM_SHARE)
    bent = bent and points.shape[1] <= MOST_BENT
    bend = Bend.fitted(points, membership[0] / membership[0].sum()) if bent else None
    for j, own in enumerate(membership):
        if own.sum() <= FEWEST:
            continue
        own_weights = own / own.sum()
        if 1 / np.sum(own_weights**2) > points.shape[1] + 1:
            straight = points if j > 0 or bend is None else bend.undo(points)
            means[j] = own_weights @ straight
            centred = straight - means[j]
            covariance = (centred.T * own_weights) @ centred
            inflation = FITTED_INFLATION if j == 0 else MINOR_INFLATION
            factors[j] = linalg.cholesky(covariance * inflation, lower=True)
    return StudentTMixture(shares / shares.sum(), means, factors, FITTED_DEGREES, bend)


def defended(mixture: StudentTMixture, points: FloatArray) -> StudentTMixture:
    """The mixture with a tenth of its weight moved to one wide component about all the points.

    A defensive component (Hesterberg, doi 10.1080/00401706.1995.10484303) keeps p / q bounded where the
    fitted ones are too narrow, so that no walker is held in a tail.
    """
    covariance = np.atleast_2d(np.cov(points.T)) * DEFENSIVE_INFLATION
    factor = np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))
    return StudentTMixture(
        np.append(mixture.weights * (1 - DEFENSIVE_WEIGHT), DEFENSIVE_WEIGHT),
        np.concatenate([mixture.means, points.mean(axis=0)[None]]),
        np.concatenate([mixture.factors, factor[None]]),
        mixture.degrees_of_freedom,
        mixture.bend,
    )


def fit_student_t_mixture(
    points: FloatArray, components: int, random: np.random.Generator, iterations: int = 60
) -> StudentTMixture:
    """Fit a mixture with fixed degrees of freedom to points (count, dimension).

    Expectation-maximisation with the t distribution as a scale mixture of normals (Peel and McLachlan,
    doi 10.1023/A:1008981510081), started from points of the set chosen far apart. A component that loses its
    support falls back to the covariance of all points.
    """
    count, d = points.shape
    nu = DEGREES_OF_FREEDOM
    pooled = np.cov(points.T).reshape(d, d)
    pooled = pooled + 1e-10 * np.diag(np.diag(pooled)) + 1e-300 * np.eye(d)
    whitener = linalg.cholesky(pooled, lower=True)
    standard = linalg.solve_triangular(whitener, (points - points.mean(axis=0)).T, lower=True).T
    centres = [int(random.integers(count))]
    nearest = np.full(count, np.inf)
    for _ in range(components - 1):
        nearest = np.minimum(nearest, np.sum((standard - standard[centres[-1]]) ** 2, axis=1))
        centres.append(int(random.choice(count, p=nearest / nearest.sum())))
    mixture = StudentTMixture(
        np.full(components, 1 / components),
        points[centres],
        np.repeat(whitener[None] / components ** (1 / d), components, axis=0),
    )
    previous = -np.inf
    for _ in range(iterations):
        log_parts = mixture.component_log_densities(points)
        log_density = np.asarray(special.logsumexp(log_parts, axis=0))
        if abs(log_density.mean() - previous) < FIT_TOLERANCE:
            break
        previous = float(log_density.mean())
        membership = np.exp(log_parts - log_density)
        weights = membership.sum(axis=1) + 1.0
        means, factors = [], []
        for j in range(components):
            residual = points - mixture.means[j]
            distance = np.sum(
                linalg.solve_triangular(mixture.factors[j], residual.T, lower=True) ** 2, axis=0
            )
            scaled = membership[j] * (nu + d) / (nu + distance)
            mean = scaled @ points / max(scaled.sum(), 1e-300)
            centred = points - mean
            prior_weight = float(d + 1)
            covariance = (centred.T * scaled) @ centred + prior_weight * pooled / components
            means.append(mean)
            factors.append(linalg.cholesky(covariance / (membership[j].sum() + prior_weight), lower=True))
        mixture = StudentTMixture(weights / weights.sum(), np.stack(means), np.stack(factors))
    return mixture
