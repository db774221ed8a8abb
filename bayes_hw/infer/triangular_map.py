"""A triangular transport map, quadratic and volume-preserving, from a straight cloud to curved ridges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled

REACH = 4.0
"""Standard deviations beyond which a coordinate bends the others no further: tails stay where they are."""
RIDGE = 0.2
"""Of the share of coefficients in effective points, by which fitted coefficients are drawn to zero."""


@dataclass(frozen=True, eq=False)
class Bend:
    """x = centre + axes z, z_k = y_k + sum_(i <= j < k) c_kij (clip(z_i) clip(z_j) - m_ij), y being straight.

    A coordinate is moved by those before it alone: a triangular map of unit Jacobian. Its inverse, which is
    quadratic in z, is fitted by regressions (Marzouk et al., doi 10.1007/978-3-319-12385-1_23). `centre`
    (dimension,); `axes` (dimension, dimension), columns along which the cloud is white, each a standard
    deviation long; `coefficients` (dimension, pairs) c_kij in the order of j, then i; `offsets` (dimension,)
    the sums of c_kij m_ij. clip() is to +- REACH.
    """

    centre: FloatArray
    axes: FloatArray
    coefficients: FloatArray
    offsets: FloatArray

    def __post_init__(self) -> None:
        for name, array in vars(self).items():
            object.__setattr__(self, name, np.ascontiguousarray(array))

    def apply(self, straight: FloatArray) -> FloatArray:
        """x of straight points centre + axes y (points, dimension)."""
        return self._moved(straight, 1.0)

    def undo(self, points: FloatArray) -> FloatArray:
        """The straight points of which `apply` makes x (points, dimension)."""
        return self._moved(points, -1.0)

    def _moved(self, points: FloatArray, sign: float) -> FloatArray:
        z = np.ascontiguousarray(np.linalg.solve(self.axes, (points - self.centre).T).T)
        moved = np.empty_like(z)
        _move(z, self.coefficients, self.offsets, sign, moved)
        return self.centre + moved @ self.axes.T

    @classmethod
    def fitted(cls, points: FloatArray, weights: FloatArray) -> Bend:
        """The bend of weighted points (points, dimension), weights (points,) of sum one.

        Of axes tried, those along which straight points fill the least volume.
        """
        centre = weights @ points
        centred = points - centre
        covariance = (centred.T * weights) @ centred
        tried = [
            cls._along(axes, centre, centred, weights)
            for axes in (_principal_axes(covariance), _skewed_axes(covariance, centred, weights))
        ]
        return min(tried, key=lambda found: found[1])[0]

    @classmethod
    def _along(
        cls, axes: FloatArray, centre: FloatArray, centred: FloatArray, weights: FloatArray
    ) -> tuple[Bend, float]:
        """The bend along given axes, and the log-determinant of the straight points' covariance."""
        z = np.linalg.solve(axes, centred.T).T
        near = np.clip(z, -REACH, REACH)
        last, first = np.tril_indices(z.shape[1])
        products = near[:, first] * near[:, last]
        means = weights @ products
        products -= means
        weighted = products.T * weights
        gram, slopes = weighted @ products, weighted @ z
        ridge = RIDGE * np.sum(weights**2) * np.mean(np.diag(gram))
        coefficients = np.zeros((z.shape[1], len(means)))
        for k in range(1, z.shape[1]):
            pairs = k * (k + 1) // 2
            coefficients[k, :pairs] = linalg.solve(
                gram[:pairs, :pairs] + pairs * ridge * np.eye(pairs), slopes[:pairs, k], assume_a="pos"
            )
        straight = z - products @ coefficients.T
        log_volume = np.linalg.slogdet((straight.T * weights) @ straight)[1]
        return cls(centre, axes, coefficients, coefficients @ means), float(log_volume)


def _principal_axes(covariance: FloatArray) -> FloatArray:
    """Those of the correlation matrix, the longest first: along a ridge the others bend."""
    scales = np.sqrt(np.diag(covariance))
    variances, vectors = linalg.eigh(covariance / np.outer(scales, scales))
    return np.asarray(scales[:, None] * vectors[:, ::-1] * np.sqrt(variances[::-1]))


def _skewed_axes(covariance: FloatArray, centred: FloatArray, weights: FloatArray) -> FloatArray:
    """Eigenvectors of sum_kl T_kil T_kjl with the third moments T_kij = E z_k z_i z_j of white coordinates,
    those whose squares explain most of the variance across them first."""
    factor = linalg.cholesky(covariance, lower=True)
    z = linalg.solve_triangular(factor, centred.T, lower=True).T
    third = np.einsum("nk,ni,nj->kij", z * weights[:, None], z, z, optimize=True)
    _, vectors = linalg.eigh(np.einsum("kil,kjl->ij", third, third))
    along = z @ vectors
    squares = along**2 - 1
    slopes = (squares.T * weights) @ along
    np.fill_diagonal(slopes, 0.0)
    explained = np.sum(slopes**2, axis=1) / (weights @ squares**2)
    return np.asarray(factor @ vectors[:, np.argsort(-explained)])


@compiled(nogil=True)
def _move(z, coefficients, offsets, sign, moved):  # type: ignore[no-untyped-def]
    """y of z where `sign` is -1, z of y where it is 1: then the coordinates before k are those moved."""
    bent = moved if sign > 0 else z
    near = np.empty(z.shape[1])
    for n in range(z.shape[0]):
        for k in range(z.shape[1]):
            shift, pair = -offsets[k], 0
            for j in range(k):
                for i in range(j + 1):
                    shift += coefficients[k, pair] * near[i] * near[j]
                    pair += 1
            moved[n, k] = z[n, k] + sign * shift
            near[k] = min(max(bent[n, k], -REACH), REACH)
