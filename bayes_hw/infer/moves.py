"""Moves for emcee."""

from __future__ import annotations

import numpy as np
from emcee.moves import DEMove, MHMove, Move

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.mixture import StudentTMixture


class IndependenceMove(MHMove):  # type: ignore[misc]
    """Metropolis-Hastings with proposals that do not depend on where the walker is.

    x' is drawn from the proposal density q, and accepted with min(1, p(x') q(x) / (p(x) q(x'))) (Tierney,
    doi 10.1214/aos/1176325750). Its autocorrelation time is near one where q resembles p, but a point where
    p / q is large holds its walker: use it beside a move that explores locally.
    """

    def __init__(self, proposal: StudentTMixture) -> None:
        self.proposal = proposal
        super().__init__(self._propose, ndim=proposal.dimension)

    def _propose(self, x: FloatArray, random: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        proposed = self.proposal.sample(len(x), random)
        return proposed, self.proposal.log_density(x) - self.proposal.log_density(proposed)


def weighted_moves(proposal: StudentTMixture, independence_weight: float) -> list[tuple[Move, float]]:
    """Independence proposals with the given weight; differential evolution, a tenth of it with full-length
    jumps between modes, for the rest (ter Braak, doi 10.1007/s11222-006-8769-1)."""
    local = 1 - independence_weight
    return [
        (IndependenceMove(proposal), independence_weight),
        (DEMove(), 0.9 * local),
        (DEMove(sigma=1e-5, gamma0=1.0), 0.1 * local),
    ]
