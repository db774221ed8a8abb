"""Moves for emcee."""

from __future__ import annotations

from typing import Any

import numpy as np
from emcee import State
from emcee.moves import MHMove, Move

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.mixture import StudentTMixture
from bayes_hw.infer.triangular_map import Bend

DEFAULT_STRETCH = 2.38
OPPOSITE_CORRELATION = -0.5
OPPOSITE_SHARE = 0.9
OPPOSITE_SHARE_OF_SEVERAL = 0.3
"""Of the proposals from a density of one component, or of several between which they hardly ever go."""


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


class OppositeMove(MHMove):  # type: ignore[misc]
    """Metropolis-Hastings with proposals on the other side of the proposal density's centre.

    x' is drawn from x in detailed balance with the density q (`StudentTMixture.opposite`), so it is accepted
    as an independence proposal is, with min(1, p(x') q(x) / (p(x) q(x'))). Successive draws are then
    negatively correlated, which makes means more precise than independent draws would. It hardly ever goes
    from one component to another: use it beside independence proposals.
    """

    def __init__(self, proposal: StudentTMixture, correlation: float = OPPOSITE_CORRELATION) -> None:
        self.proposal = proposal
        self.correlation = correlation
        super().__init__(self._propose, ndim=proposal.dimension)

    def _propose(self, x: FloatArray, random: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        proposed, log_density = self.proposal.opposite(x, self.correlation, random)
        return proposed, log_density - self.proposal.log_density(proposed)


class DifferentialEvolutionMove(Move):  # type: ignore[misc]
    """x' = x + gamma (x_a - x_b) with a and b two other walkers (ter Braak, doi 10.1007/s11222-006-8769-1).

    The walkers move in two halves, each by differences of the other half, gamma = `stretch` (1 + 1e-5 z) with
    z standard normal, by default 2.38 / sqrt(2 d) as there. emcee's own move of this kind lists all pairs of
    walkers and decides one walker after the other, which costs more here than the density itself.

    With a `bend` the differences are those of the straight points (Parno and Marzouk,
    doi 10.1137/17M1134640): along a curved ridge nearly all others lead off it. A map of unit Jacobian leaves
    the proposals as symmetric as they were.
    """

    def __init__(
        self, stretch: float | None = None, *, randomize_split: bool = True, bend: Bend | None = None
    ) -> None:
        self.stretch = stretch
        self.randomize_split = randomize_split
        self.bend = bend

    def propose(self, model: Any, state: State) -> tuple[State, np.ndarray]:
        """One step of all walkers: emcee's interface."""
        walkers = len(state.coords)
        random = model.random
        half = np.arange(walkers) % 2
        if self.randomize_split:
            random.shuffle(half)
        accepted = np.zeros(walkers, dtype=np.bool_)
        for side in (0, 1):
            moving, others = np.flatnonzero(half == side), np.flatnonzero(half != side)
            proposed = self._proposed(state.coords[moving], state.coords[others], random)
            log_prob, _ = model.compute_log_prob_fn(proposed)
            taken = np.log(random.random_sample(len(moving))) < log_prob - state.log_prob[moving]
            kept = moving[taken]
            state.coords[kept], state.log_prob[kept] = proposed[taken], log_prob[taken]
            accepted[kept] = True
        return state, accepted

    def _proposed(self, x: FloatArray, others: FloatArray, random: np.random.RandomState) -> FloatArray:
        count, dimension = x.shape
        first = random.randint(len(others), size=count)
        second = (first + random.randint(1, len(others), size=count)) % len(others)
        stretch = DEFAULT_STRETCH / np.sqrt(2 * dimension) if self.stretch is None else self.stretch
        gamma = stretch * (1 + 1e-5 * random.standard_normal((count, 1)))
        if self.bend is None:
            return x + gamma * (others[first] - others[second])
        straight = self.bend.undo(others)
        return self.bend.apply(self.bend.undo(x) + gamma * (straight[first] - straight[second]))


def weighted_moves(
    proposal: StudentTMixture, independence_weight: float, *, opposite: bool = False
) -> list[tuple[Move, float]]:
    """Proposals from a density with the given weight; for the rest differential evolution along its bend, a
    tenth of it with full-length jumps between modes.

    With `opposite` most of the former are drawn on the side opposite to the walker: not while walkers forget
    their starts, since from far out they would go as far on the other side.
    """
    local = 1 - independence_weight
    share = 0.0
    if opposite:
        share = OPPOSITE_SHARE if len(proposal.weights) == 1 else OPPOSITE_SHARE_OF_SEVERAL
    return [
        (IndependenceMove(proposal), (1 - share) * independence_weight),
        (OppositeMove(proposal), share * independence_weight),
        (DifferentialEvolutionMove(bend=proposal.bend), 0.9 * local),
        (DifferentialEvolutionMove(stretch=1.0), 0.1 * local),
    ]
