"""Proposals fitted by importance sampling in rounds, and what share of them a chain would accept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, special

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.checkpoint import Plan
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.mixture import FITTED_INFLATION, MOST_BENT, TAILS, StudentTMixture, refitted

FIRST_DRAWS, DRAWS = 40, 90
"""Draws of the first round of importance sampling and of each later one, for every pair of parameters: a
bend has as many coefficients a parameter."""
FEWEST_PAIRS = 5
"""Pairs a parameter that are counted at least."""
IMPORTANCE_ROUNDS = 4
"""Rounds whose weights are used as they are; those before them are flattened."""
MOST_ROUNDS = 16
LEAST_SIZE = 3.0
"""Effective draws a pair that a proposal is fitted to: weights are flattened until so many are left."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A plan, the logarithm of the mean p / q of the draws that it was judged by, and where its proposal has
    light tails, one with heavier tails by which walkers come in from starts far out."""

    plan: Plan
    log_mean_weight: float
    heavier: tuple[Trial, ...] = ()


def importance_trial(laplace: Laplace, rng: np.random.Generator) -> Trial:
    """The best of the last of a few t proposals, each fitted to the weighted draws of the one before; the
    very last one, judged by the draws that it was fitted to, also with lighter tails.

    The first ones, narrow yet, know too little of the tails to be judged by their own draws.
    """
    bent = min(laplace.dimension, MOST_BENT)
    pairs = max(bent * (bent + 1) // 2, FEWEST_PAIRS * laplace.dimension)
    proposal = laplace.proposal()
    trials: list[Trial] = []
    as_they_are = 0
    for _ in range(MOST_ROUNDS):
        x = proposal.sample((DRAWS if trials else FIRST_DRAWS) * pairs, rng)
        log_density, log_q = laplace.densities[0](x), proposal.log_density(x)
        log_weights = log_density - log_q
        trials.append(_judged(proposal, log_weights, np.zeros(len(x)), laplace.choice))
        possible = np.isfinite(log_weights)
        if np.count_nonzero(possible) <= LEAST_SIZE * pairs:
            break
        exponent = flattening(log_weights[possible], LEAST_SIZE * pairs)
        weights = special.softmax(exponent * log_weights[possible])
        proposal = refitted(proposal, x[possible], weights, bent=len(trials) > 1)
        as_they_are += exponent == 1.0
        if as_they_are == IMPORTANCE_ROUNDS:
            several = _with_several_tails(proposal, x, log_density, log_q, laplace.choice)
            return _most_accepted([trials[-1], *several])
    return _most_accepted(trials[-2:])


def flattening(log_weights: FloatArray, size: float) -> float:
    """The largest power, at most one, of weights (draws,) that leaves `size` effective draws of more.

    Where a proposal misses the target by far, a few draws have all the weight; their powers lead there step
    by step (Koblents and Miguez, doi 10.1007/s11222-013-9440-2).
    """

    def excess(exponent: float) -> float:
        weights = special.softmax(exponent * log_weights)
        return float(1 / np.sum(weights**2) - size)

    return 1.0 if excess(1.0) >= 0 else float(optimize.brentq(excess, 0.0, 1.0))


def _with_several_tails(
    fitted: StudentTMixture, x: FloatArray, log_density: FloatArray, log_q: FloatArray, choice: int
) -> list[Trial]:
    """The proposal `fitted` to draws x (draws, dimension) of a density log_q (draws,), and where it has one
    component the same with lighter tails, all judged by these draws; the heaviest first."""
    trials: list[Trial] = []
    for degrees_of_freedom, inflation in TAILS if len(fitted.weights) == 1 else TAILS[:1]:
        tried = fitted.with_tails(degrees_of_freedom, inflation / FITTED_INFLATION)
        log_tried = tried.log_density(x)
        trial = _judged(tried, log_density - log_tried, log_tried - log_q, choice)
        trials.append(replace(trial, heavier=tuple(trials[:1])))
    return trials


def _most_accepted(trials: Sequence[Trial]) -> Trial:
    return max(trials, key=lambda trial: trial.plan.expected_acceptance)


def _judged(proposal: StudentTMixture, log_weights: FloatArray, log_masses: FloatArray, choice: int) -> Trial:
    """A proposal judged by draws that stand for it with `log_masses` (draws,), log p / q `log_weights`."""
    largest = float(np.max(log_weights))
    if not np.isfinite(largest):
        return Trial(Plan(proposal, independence_share(0.0), 0.0, choice), largest)
    masses = special.softmax(log_masses)
    weights = np.exp(log_weights - largest)
    acceptance = acceptance_from_weights(weights, masses)
    plan = Plan(proposal, independence_share(acceptance), acceptance, choice)
    return Trial(plan, largest + float(np.log(masses @ weights)))


def acceptance_from_weights(weights: FloatArray, masses: FloatArray) -> float:
    """Mean acceptance of independence proposals given w = p / q `weights` (draws,) at draws that stand for
    the proposal with `masses` (draws,) of sum one: equal ones where they are its own.

    E min(1, w' / w) with w' at a fresh draw and w at a draw of the target, which is a draw i of the proposal
    with probability proportional to m_i w_i: sum_ij m_i m_j min(w_i, w_j) / sum_i m_i w_i.
    """
    order = np.argsort(weights)
    w, m = weights[order], masses[order]
    above = m.sum() - np.cumsum(m)
    return float(np.sum(w * m * (2 * above + m)) / np.sum(w * m))


def independence_share(acceptance: float) -> float:
    """Share of independence proposals among the moves, given their mean acceptance.

    An independence chain's autocorrelation time is about 2 / acceptance - 1 steps, that of differential
    evolution some 4 steps a dimension: the former pays above a few per cent. Differential evolution keeps
    half as insurance, since where the proposal is too thin, in the far tails, it alone moves the walkers;
    only where most proposals are accepted, and so no tail is thin, down to a twentieth.
    """
    mostly = np.clip(2 * acceptance - 0.6, 0.0, 0.4) + np.clip(acceptance - 0.7, 0.0, 0.05)
    return float(np.clip(2.5 * acceptance, 0.1, 0.5) + mostly)
