"""Sampling limits, dead zone, poles and noise alone, with the weights of G's poles following them.

The response is linear in the weights w of G's poles and in the states that records begin in, the following
parameters, so that given all others, the leading ones d, they are all but normal. Where the posterior is
normal, w given d is normal about a straight line, and the marginal of d is the density along it:

    w(d) = w_0 + S_wd S_dd^-1 (d - d_0),    p(d) = p(d, w(d)) / N(w(d); w(d), S_ww - S_wd S_dd^-1 S_dw),

S the covariance at the mode (d_0, w_0); the denominator does not depend on d. So walkers move in d only, and
each of their states is completed by a draw of w. In the coordinates of `bayes_hw.infer.centred_weights` the
weights go where least squares has them, whose precision the Jacobian counts: what is left of the bend is
little. Importance weights put it right (`reweighted`), so that the posterior is that of everything.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.infer.convergence import assess
from bayes_hw.infer.laplace import CoordinateMap, Laplace, LogDensity, Through
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.infer.reweighting import Reweighting, reweighted
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import StartingPoint
from bayes_hw.progress import Progress

FOLLOWING = re.compile(r"\.(weight\d*|cosine|sine)$|^direct$|^start\d+\.")
"""What the names of the following parameters match."""


@dataclass(frozen=True, eq=False)
class Following:
    """Where the `following` rows of a Laplace approximation of one mode lie given its `leading` rows.

    `slopes` (following, leading) are those of the line, `factor` (following, following) is the lower Cholesky
    factor of the covariance about it.
    """

    laplace: Laplace
    leading: IntArray
    following: IntArray
    slopes: FloatArray
    factor: FloatArray

    @classmethod
    def of(cls, laplace: Laplace, names: Sequence[str]) -> Following:
        """Of the first mode of `laplace`, whose coordinates have these names."""
        follows = np.array([FOLLOWING.search(name) is not None for name in names])
        leading, following = np.flatnonzero(~follows), np.flatnonzero(follows)
        order, count = np.concatenate([leading, following]), len(leading)
        _, covariance = laplace.modes[0]
        factor = np.linalg.cholesky(covariance[np.ix_(order, order)])
        slopes = np.linalg.solve(factor[:count, :count].T, factor[count:, :count].T).T
        return cls(laplace, leading, following, slopes, factor[count:, count:])

    @property
    def mode(self) -> FloatArray:
        """The leading parameters at the mode (leading,)."""
        return self.laplace.modes[0][0][self.leading]

    @property
    def covariance(self) -> FloatArray:
        """Their marginal covariance (leading, leading)."""
        return self.laplace.modes[0][1][np.ix_(self.leading, self.leading)]

    def completed(self, leading: FloatArray, aside: FloatArray | None = None) -> FloatArray:
        """Points (points, parameters) with the given leading coordinates (points, leading), `aside`
        (points, following) standard deviations off the line."""
        centre = self.laplace.modes[0][0]
        points = np.empty((len(leading), len(centre)))
        points[:, self.leading] = leading
        points[:, self.following] = centre[self.following] + (leading - self.mode) @ self.slopes.T
        if aside is not None:
            points[:, self.following] += aside @ self.factor.T
        return points


class DensityAlong(Through):
    """A log-density as a function of the leading coordinates, the others on their line."""

    def __init__(self, density: LogDensity, following: Following) -> None:
        super().__init__(density)
        self.following = following

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.density.names[row] for row in self.following.leading)

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        return self.density(self.following.completed(coordinates))


def sample_followed(
    target: LogPosterior,
    origin: StartingPoint,
    maps: Sequence[CoordinateMap],
    rng: np.random.Generator,
    *,
    settings: SamplerSettings,
    jobs: int,
    progress: Progress,
) -> tuple[Sampling, Reweighting] | None:
    """Sample the leading parameters from `origin` on, draw the others about their line in the coordinates
    that `maps` lead to, and weigh the draws by `target`.

    None where nothing follows, where the posterior has several modes, where the weights do not hold, and
    where not every parameter has converged.
    """

    def laplace() -> Laplace:
        own = LogPosterior(target.axis, target.noise, target.records, target.power)
        found = Laplace([(origin.coordinates, origin.covariance), *origin.others], [own])
        for mapping in maps:
            found = found.carried(mapping)
        return found

    whole = laplace().separated()
    following = Following.of(whole, target.names)
    if len(whole.modes) > 1 or not len(following.following):
        return None
    sampler_rng, aside_rng, weight_rng = rng.spawn(3)
    sampling = sample(
        lambda: DensityAlong(laplace().densities[0], following),
        following.mode,
        following.covariance,
        sampler_rng,
        settings=settings,
        reparameterisation=Reparameterisation.of(
            [target.parameters[row] for row in following.leading], target.records
        ),
        jobs=jobs,
        progress=progress,
    )
    with progress.stage("weights of the poles about the line"):
        flat = sampling.chain.reshape(-1, len(following.leading))
        aside = aside_rng.standard_normal((len(flat), len(following.following)))
        points, log_jacobian = whole.to_plain(following.completed(flat, aside))
        shape = sampling.log_probability.shape
        density = sampling.log_probability.ravel() - 0.5 * np.sum(aside**2, axis=1) - log_jacobian
        states, heights, judged = reweighted(
            "following_weights", points.reshape(*shape, -1), density.reshape(shape), target, weight_rng
        )
        convergence = assess(states, target.names, sampling.acceptance)
    if not (judged.holds and sampling.convergence.converged and convergence.converged):
        return None
    return replace(sampling, chain=states, log_probability=heights, convergence=convergence), judged
