"""The pilot of a sampler: in which coordinates and from which density proposals are drawn.

First a Laplace approximation is refitted and bent by importance sampling in rounds, in the parameters'
coordinates and in straight ones: some ten thousand evaluations say what share of its independence proposals
would be accepted. Where that is good enough, walkers start from an overdispersed cloud and only settle.
Otherwise, and where a settled walker sits in a place that the approximation overlooks, ensembles explore with
mixed moves, and t mixtures are refitted to what they found.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy import optimize, special

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.checkpoint import Plan
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.mixture import (
    FITTED_INFLATION,
    TAILS,
    StudentTMixture,
    defended,
    fit_student_t_mixture,
    refitted,
    several_laplace,
)
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.infer.straightening import Straightening
from bayes_hw.progress import Progress

VALLEY = 2.0
"""Two modes are two where the log-density between them falls this far below the lower one."""
PATH_POINTS = 17
PILOT_STEPS = 90
SETTLING_STEPS = 20
START_INFLATION = 4.0
HOPELESS = 15.0
"""Log-density a dimension below the best start at which a start is given up."""
SMALLEST_START = 1e-6
PILOT_COMPONENTS = (1, 4)
PILOT_THINNING = 10
"""Steps between points of a walker that a bend is fitted to: it would take close ones for many."""
TRIAL_PROPOSALS = 2048

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
ENOUGH = 0.3
"""Expected acceptance of independence proposals from which no exploring pilot is needed."""
GOOD = 0.7
"""Expected acceptance at which other coordinates are not tried."""
OVERLOOKED = 4.0
"""A walker whose log p / q exceeds the mean of the trial draws by more was overlooked by the pilot."""
OVERLOOKED_SHARE = 0.0007
"""So many overlooked walkers are more than a thin tail; a single one is where it is by FAR_OVERLOOKED."""
FAR_OVERLOOKED = 5.0


class LogDensity(Protocol):
    """A vectorised log-density that counts what it could not evaluate."""

    non_finite: int

    @property
    def names(self) -> tuple[str, ...]: ...

    def __call__(self, coordinates: FloatArray) -> FloatArray: ...


class StraightDensity:
    """A log-density as a function of straight coordinates, Jacobian included."""

    def __init__(self, density: LogDensity, straightening: Straightening) -> None:
        self.density = density
        self.straightening = straightening

    @property
    def names(self) -> tuple[str, ...]:
        return self.density.names

    @property
    def non_finite(self) -> int:
        return self.density.non_finite

    @non_finite.setter
    def non_finite(self, count: int) -> None:
        self.density.non_finite = count

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        plain, log_jacobian = self.straightening.to_plain(coordinates)
        log_density = self.density(plain)
        return np.where(np.isfinite(log_density), log_density + log_jacobian, -np.inf)


@dataclass(frozen=True, eq=False)
class Laplace:
    """Approximate modes (parameters,) with their covariances, the best first, and the density of every
    ensemble, all in the same coordinates."""

    modes: Sequence[tuple[FloatArray, FloatArray]]
    densities: Sequence[LogDensity]
    straight: bool = False

    @property
    def dimension(self) -> int:
        return len(self.modes[0][0])

    def proposal(self, inflation: float = 1.0) -> StudentTMixture:
        """A t component at every mode, its scale matrix `inflation` times the covariance."""
        return several_laplace(self.modes, inflation)

    def separated(self) -> Laplace:
        """Without the modes that no valley parts from a better one: two places on one ridge."""
        density, kept = self.densities[0], [self.modes[0]]
        shares = np.linspace(0.0, 1.0, PATH_POINTS)[:, None]
        for mode, covariance in self.modes[1:]:
            heights = [density(one + shares * (mode - one)) for one, _ in kept]
            if all(np.min(h) < min(h[0], h[-1]) - VALLEY for h in heights):
                kept.append((mode, covariance))
        return replace(self, modes=kept)

    def straightened(self, straightening: Straightening) -> Laplace:
        """The same in straight coordinates."""
        return Laplace(
            [
                (straightening.from_plain(mode), straightening.covariance_from_plain(mode, covariance))
                for mode, covariance in self.modes
            ],
            [StraightDensity(density, straightening) for density in self.densities],
            True,
        )


def run_pilot(
    choices: Sequence[Laplace],
    walkers: int,
    rng: np.random.Generator,
    ensemble_rngs: Sequence[np.random.Generator],
    pool: ThreadPoolExecutor,
    progress: Progress,
) -> tuple[Plan, list[EnsembleState]]:
    """The plan, and the ensembles of `walkers` each once they have forgotten their starts.

    `choices` are Laplace approximations of one density in different coordinates. Raises InputError when the
    density is zero all around the mode.
    """
    dimension = choices[0].dimension
    if walkers < 2 * dimension:
        raise InputError(f"--walkers {walkers}: {dimension} parameters need {2 * dimension} or more")
    with progress.task("pilot", 4) as task:
        tried: list[tuple[Laplace, _Trial]] = []
        for choice in choices:
            separated = choice.separated()
            tried.append((separated, _importance_plan(separated, rng)))
            if tried[-1][1].plan.expected_acceptance >= GOOD:
                break
        laplace, trial = max(tried, key=lambda one: one[1].plan.expected_acceptance)
        task.reach(1, f"independence proposals accepted: {trial.plan.expected_acceptance:.0%}")
        states = [
            _possible_start(laplace, density, walkers, ensemble_rng)
            for density, ensemble_rng in zip(laplace.densities, ensemble_rngs, strict=True)
        ]
        plan = trial.plan
        candidates = [trial, *trial.heavier]
        if plan.expected_acceptance >= ENOUGH:
            (chain, log_probability), settled = _steps(
                laplace, states, candidates[-1].plan, SETTLING_STEPS, pool
            )
            last = chain[:, SETTLING_STEPS // 2 :].reshape(-1, dimension)
            log_last = log_probability[:, SETTLING_STEPS // 2 :].ravel()
            for candidate in candidates:
                if not _overlooked(last, log_last, candidate):
                    task.reach(4)
                    return candidate.plan, settled
        plan = replace(plan, proposal=laplace.proposal(1.2), independence_weight=0.5)
        for done in (2, 3):
            (chain, log_probability), states = _steps(laplace, states, plan, PILOT_STEPS, pool)
            recent, log_recent = chain[:, PILOT_STEPS // 3 :], log_probability[:, PILOT_STEPS // 3 :]
            plan = _best_mixture(recent, log_recent, laplace, candidates[-1].plan.proposal, rng)
            task.reach(done, f"independence proposals accepted: {plan.expected_acceptance:.0%}")
        _, states = _steps(laplace, states, plan, SETTLING_STEPS, pool)
        task.reach(4)
    return plan, states


@dataclass(frozen=True, eq=False)
class _Trial:
    """A plan, the logarithm of the mean p / q of the draws that it was judged by, and where its proposal has
    light tails, one with heavier tails by which walkers come in from starts far out."""

    plan: Plan
    log_mean_weight: float
    heavier: tuple[_Trial, ...] = ()


def _importance_plan(laplace: Laplace, rng: np.random.Generator) -> _Trial:
    """The best of the last of a few t proposals, each fitted to the weighted draws of the one before; the
    very last one, judged by the draws that it was fitted to, also with lighter tails.

    The first ones, narrow yet, know too little of the tails to be judged by their own draws.
    """
    pairs = max(laplace.dimension * (laplace.dimension + 1) // 2, FEWEST_PAIRS * laplace.dimension)
    proposal = laplace.proposal()
    trials: list[_Trial] = []
    as_they_are = 0
    for _ in range(MOST_ROUNDS):
        x = proposal.sample((DRAWS if trials else FIRST_DRAWS) * pairs, rng)
        log_density, log_q = laplace.densities[0](x), proposal.log_density(x)
        log_weights = log_density - log_q
        trials.append(_judged(proposal, log_weights, np.zeros(len(x)), laplace.straight))
        possible = np.isfinite(log_weights)
        if np.count_nonzero(possible) <= LEAST_SIZE * pairs:
            break
        exponent = flattening(log_weights[possible], LEAST_SIZE * pairs)
        weights = special.softmax(exponent * log_weights[possible])
        proposal = refitted(proposal, x[possible], weights, bent=len(trials) > 1)
        as_they_are += exponent == 1.0
        if as_they_are == IMPORTANCE_ROUNDS:
            several = _with_several_tails(proposal, x, log_density, log_q, laplace.straight)
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
    fitted: StudentTMixture, x: FloatArray, log_density: FloatArray, log_q: FloatArray, straight: bool
) -> list[_Trial]:
    """The proposal `fitted` to draws x (draws, dimension) of a density log_q (draws,), and where it has one
    component the same with lighter tails, all judged by these draws; the heaviest first."""
    trials: list[_Trial] = []
    for degrees_of_freedom, inflation in TAILS if len(fitted.weights) == 1 else TAILS[:1]:
        tried = fitted.with_tails(degrees_of_freedom, inflation / FITTED_INFLATION)
        log_tried = tried.log_density(x)
        trial = _judged(tried, log_density - log_tried, log_tried - log_q, straight)
        trials.append(replace(trial, heavier=tuple(trials[:1])))
    return trials


def _most_accepted(trials: Sequence[_Trial]) -> _Trial:
    return max(trials, key=lambda trial: trial.plan.expected_acceptance)


def _judged(
    proposal: StudentTMixture, log_weights: FloatArray, log_masses: FloatArray, straight: bool
) -> _Trial:
    """A proposal judged by draws that stand for it with `log_masses` (draws,), log p / q `log_weights`."""
    largest = float(np.max(log_weights))
    if not np.isfinite(largest):
        return _Trial(Plan(proposal, independence_share(0.0), 0.0, straight), largest)
    masses = special.softmax(log_masses)
    weights = np.exp(log_weights - largest)
    acceptance = acceptance_from_weights(weights, masses)
    plan = Plan(proposal, independence_share(acceptance), acceptance, straight)
    return _Trial(plan, largest + float(np.log(masses @ weights)))


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


def _overlooked(points: FloatArray, log_density: FloatArray, trial: _Trial) -> bool:
    """Whether walkers that have settled go where the proposals hardly ever do."""
    log_weights = log_density - trial.plan.proposal.log_density(points)
    excess = log_weights - trial.log_mean_weight
    return bool(np.mean(excess > OVERLOOKED) > OVERLOOKED_SHARE or np.any(excess > FAR_OVERLOOKED))


def _steps(
    laplace: Laplace, states: Sequence[EnsembleState], plan: Plan, steps: int, pool: ThreadPoolExecutor
) -> tuple[tuple[FloatArray, FloatArray], list[EnsembleState]]:
    """Chain (ensembles, steps, walkers, parameters) and log-density of some steps, and the states after."""
    moves = weighted_moves(plan.proposal, plan.independence_weight)
    futures = [
        pool.submit(advance, state, density, moves, steps)
        for state, density in zip(states, laplace.densities, strict=True)
    ]
    results = [future.result() for future in futures]
    chain = np.stack([result[0] for result in results])
    return (chain, np.stack([result[1] for result in results])), [result[3] for result in results]


def _possible_start(
    laplace: Laplace, density: LogDensity, walkers: int, rng: np.random.Generator
) -> EnsembleState:
    """Draws from an overdispersed cloud about every mode that are not hopeless; the clouds shrink while too
    few of them are kept.

    A draw is hopeless when its density is zero, or so far below the best draw's that an overdispersed point
    of the posterior would not be: such a walker climbs the nearest side peak, however small, and stays.

    Raises InputError when the density is zero at the mode itself and all around it.
    """
    kept = np.empty((0, laplace.dimension))
    shrink, best = 1.0, -np.inf
    while len(kept) < walkers:
        if shrink < SMALLEST_START:
            raise InputError(
                "sampling: no parameters near the least-squares estimate are possible; "
                "give a model closer to the data, its modes in order of frequency"
            )
        drawn = laplace.proposal(START_INFLATION * shrink**2).sample(2 * walkers, rng)
        log_density = density(drawn)
        best = max(best, float(np.max(log_density)))
        hopeful = np.isfinite(log_density) & (log_density > best - HOPELESS * laplace.dimension)
        kept = np.concatenate([kept, drawn[hopeful]])
        shrink *= 0.8
    return start_ensemble(kept[:walkers], density, int(rng.integers(2**63)))


def _best_mixture(
    chain: FloatArray,
    log_probability: FloatArray,
    laplace: Laplace,
    fitted: StudentTMixture,
    rng: np.random.Generator,
) -> Plan:
    """Fit mixtures to the pilot's chain (ensembles, steps, walkers, parameters), one component of them also
    bent, and keep the one whose proposals would be accepted most; that `fitted` by importance sampling is one
    of them. All have a wide component about the points beside theirs.

    The mean acceptance of independence proposals is E min(1, w'/w) with w = p/q at points of the chain and
    w' at fresh draws of q: points of ensembles that the mixture was not fitted to, where there are several.
    """
    density = laplace.densities[0]
    used, judges = (chain[::2], slice(1, None, 2)) if len(chain) > 1 else (chain, slice(None))
    known = used.reshape(-1, laplace.dimension)
    chosen = rng.choice(len(known), size=min(len(known), 4 * TRIAL_PROPOSALS), replace=False)
    found = [fit_student_t_mixture(known[chosen], components, rng) for components in PILOT_COMPONENTS]
    apart = used[:, ::PILOT_THINNING].reshape(-1, laplace.dimension)
    found.append(refitted(found[0], apart, np.full(len(apart), 1 / len(apart)), bent=True))
    points, log_density = chain[judges].reshape(-1, laplace.dimension), log_probability[judges].ravel()
    judging = rng.choice(len(points), size=min(len(points), TRIAL_PROPOSALS), replace=False)
    plans = []
    for mixture in (fitted, *found):
        proposal = defended(mixture, known[chosen])
        trial = proposal.sample(TRIAL_PROPOSALS, rng)
        at_trial = density(trial) - proposal.log_density(trial)
        at_points = log_density[judging] - proposal.log_density(points[judging])
        difference = rng.permutation(at_trial)[: len(at_points)] - at_points
        acceptance = float(np.mean(np.exp(np.minimum(difference, 0))))
        share = min(independence_share(acceptance), 0.5)
        plans.append(Plan(proposal, share, acceptance, laplace.straight))
    return max(plans, key=lambda plan: plan.expected_acceptance)


def independence_share(acceptance: float) -> float:
    """Share of independence proposals among the moves, given their mean acceptance.

    An independence chain's autocorrelation time is about 2 / acceptance - 1 steps, that of differential
    evolution some 4 steps a dimension: the former pays above a few per cent. Differential evolution keeps
    half as insurance, since where the proposal is too thin, in the far tails, it alone moves the walkers;
    only where most proposals are accepted, and so no tail is thin, down to a twentieth.
    """
    mostly = np.clip(2 * acceptance - 0.6, 0.0, 0.4) + np.clip(acceptance - 0.7, 0.0, 0.05)
    return float(np.clip(2.5 * acceptance, 0.1, 0.5) + mostly)
