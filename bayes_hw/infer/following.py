"""Sampling the dominant parameters alone, with everything else of G following them.

Let d be the dominant parameters (limits, dead zone, velocity gain, modes, noise) and o the rest: weights and
other roots. Where the posterior is normal, o given d is normal about a straight line, and the marginal of d
is the density along it:

    o(d) = o_0 + S_od S_dd^-1 (d - d_0),    p(d) = p(d, o(d)) / N(o(d); o(d), S_oo - S_od S_dd^-1 S_do),

S the covariance at the mode (d_0, o_0); the denominator does not depend on d. So walkers move in d only, and
each of their states is completed by a draw of o. In the coordinates of `bayes_hw.infer.centred_weights`
weights follow the poles as least squares has them, whose precision the Jacobian counts. What is not normal is
put right by the exact posterior: completed draws become states of a chain on it (`reweighted`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.infer.convergence import assess
from bayes_hw.infer.laplace import CoordinateMap, Laplace, LogDensity
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.infer.reweighting import Reweighting, reweighted
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import StartingPoint
from bayes_hw.progress import Progress

DOMINANT = re.compile(r"saturation\.|dead_zone\.|velocity_gain|mode\d+\.(frequency_hz|damping_ratio)|noise\.")
"""How the names of the dominant parameters begin."""


@dataclass(frozen=True, eq=False)
class Following:
    """Where the `others` (rows,) of a Laplace approximation of one mode lie given its `dominant` rows.

    `slopes` (others, dominant) are those of the line, `factor` (others, others) is the lower Cholesky factor
    of the covariance about it.
    """

    laplace: Laplace
    dominant: IntArray
    others: IntArray
    slopes: FloatArray
    factor: FloatArray

    @classmethod
    def of(cls, laplace: Laplace, names: Sequence[str]) -> Following:
        """Of the first mode of `laplace`, whose coordinates have these names."""
        leading = np.array([DOMINANT.match(name) is not None for name in names])
        dominant, others = np.flatnonzero(leading), np.flatnonzero(~leading)
        order, count = np.concatenate([dominant, others]), len(dominant)
        _, covariance = laplace.modes[0]
        factor = np.linalg.cholesky(covariance[np.ix_(order, order)])
        slopes = np.linalg.solve(factor[:count, :count].T, factor[count:, :count].T).T
        return cls(laplace, dominant, others, slopes, factor[count:, count:])

    @property
    def mode(self) -> FloatArray:
        """The dominant parameters at the mode (dominant,)."""
        return self.laplace.modes[0][0][self.dominant]

    @property
    def covariance(self) -> FloatArray:
        """Their marginal covariance (dominant, dominant)."""
        return self.laplace.modes[0][1][np.ix_(self.dominant, self.dominant)]

    def completed(self, dominant: FloatArray, aside: FloatArray | None = None) -> FloatArray:
        """Points (points, parameters) with the given dominant coordinates (points, dominant), `aside`
        (points, others) standard deviations off the line."""
        centre = self.laplace.modes[0][0]
        points = np.empty((len(dominant), len(centre)))
        points[:, self.dominant] = dominant
        points[:, self.others] = centre[self.others] + (dominant - self.mode) @ self.slopes.T
        if aside is not None:
            points[:, self.others] += aside @ self.factor.T
        return points


class DensityAlong:
    """A log-density as a function of the dominant coordinates, the others on their line."""

    def __init__(self, density: LogDensity, following: Following) -> None:
        self.density = density
        self.following = following

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.density.names[row] for row in self.following.dominant)

    @property
    def non_finite(self) -> int:
        return self.density.non_finite

    @non_finite.setter
    def non_finite(self, count: int) -> None:
        self.density.non_finite = count

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
    """Sample the dominant parameters from `origin` on, draw the others about their line in the coordinates
    that `maps` lead to, and decide on the draws by `target`; None where nothing follows, and where the
    posterior has several modes."""

    def laplace() -> Laplace:
        own = LogPosterior(target.axis, target.noise, target.records, target.power)
        found = Laplace([(origin.coordinates, origin.covariance), *origin.others], [own])
        for mapping in maps:
            found = found.carried(mapping)
        return found

    whole = laplace().separated()
    following = Following.of(whole, target.names)
    if len(whole.modes) > 1 or not len(following.others):
        return None
    sampler_rng, aside_rng, weight_rng = rng.spawn(3)
    sampling = sample(
        lambda: DensityAlong(laplace().densities[0], following),
        following.mode,
        following.covariance,
        sampler_rng,
        settings=settings,
        straightening=Reparameterisation.of(
            [target.parameters[row] for row in following.dominant], target.records
        ),
        jobs=jobs,
        progress=progress,
    )
    with progress.stage("the other roots about the dominant parameters"):
        flat = sampling.chain.reshape(-1, len(following.dominant))
        aside = aside_rng.standard_normal((len(flat), len(following.others)))
        points, log_jacobian = whole.to_plain(following.completed(flat, aside))
        density = sampling.log_probability.ravel() - 0.5 * np.sum(aside**2, axis=1) - log_jacobian
        shape = sampling.log_probability.shape
        chain = points.reshape(*shape, -1)
        states, heights, judged = reweighted(
            chain, density.reshape(shape), target, weight_rng, "following_roots", settings.target_ess
        )
        convergence = assess(states, target.names, np.full(len(states), judged.acceptance))
    convergence = replace(convergence, problems=(*sampling.convergence.problems, *convergence.problems))
    return replace(sampling, chain=states, log_probability=heights, convergence=convergence), judged
