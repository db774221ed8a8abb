"""The pilot of a sampler: in which coordinates and from which density proposals are drawn.

First a Laplace approximation is refitted and bent by importance sampling in rounds, in the parameters'
coordinates and in straight ones: some ten thousand evaluations say what share of its independence proposals
would be accepted; in coordinates that cost more only where those will not do. Where that is good enough,
walkers start from an overdispersed cloud and only settle. Otherwise, and where a settled walker sits in a
place that the approximation overlooks, ensembles explore with mixed moves, and t mixtures are refitted to
what they found.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.checkpoint import Plan
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.importance import Trial, importance_trial, independence_share
from bayes_hw.infer.laplace import Laplace, LogDensity
from bayes_hw.infer.mixture import StudentTMixture, defended, fit_student_t_mixture, refitted
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.progress import Progress

PILOT_STEPS = 90
MANY = 12
"""Parameters beyond which walkers need longer to spread, and a bend more points: the square as long."""
SETTLING_STEPS = 20
START_INFLATION = 4.0
HOPELESS = 15.0
"""Log-density a dimension below the best start at which a start is given up."""
SMALLEST_START = 1e-6
PILOT_COMPONENTS = (1, 4)
PILOT_THINNING = 10
"""Steps between points of a walker that a bend is fitted to: it would take close ones for many."""
TRIAL_PROPOSALS = 2048

ENOUGH = 0.3
"""Expected acceptance of independence proposals from which no exploring pilot is needed, nor coordinates that
cost more."""
GOOD = 0.5
"""Expected acceptance at which other coordinates are not tried."""
OVERLOOKED = 4.0
"""A walker whose log p / q exceeds the mean of the trial draws by more was overlooked by the pilot."""
OVERLOOKED_SHARE = 0.0007
"""So many overlooked walkers are more than a thin tail; a single one is where it is by FAR_OVERLOOKED."""
FAR_OVERLOOKED = 5.0


def run_pilot(
    choices: Sequence[Sequence[Laplace]],
    walkers: int,
    rng: np.random.Generator,
    ensemble_rngs: Sequence[np.random.Generator],
    pool: ThreadPoolExecutor,
    progress: Progress,
) -> tuple[Plan, list[EnsembleState]]:
    """The plan, and the ensembles of `walkers` each once they have forgotten their starts.

    `choices` are Laplace approximations of one density in different coordinates, those of each group as
    costly as each other and less so than those of the next; where none will do the best of the last group is
    taken. Raises InputError when the density is zero all around the mode.
    """
    dimension = choices[0][0].dimension
    if walkers < 2 * dimension:
        raise InputError(f"--walkers {walkers}: {dimension} parameters need {2 * dimension} or more")
    with progress.task("pilot", 4) as task:
        for group in choices:
            tried: list[tuple[Laplace, Trial]] = []
            for choice in group:
                separated = choice.separated()
                tried.append((separated, importance_trial(separated, rng)))
                if tried[-1][1].plan.expected_acceptance >= GOOD:
                    break
            laplace, trial = max(tried, key=lambda one: one[1].plan.expected_acceptance)
            if trial.plan.expected_acceptance >= ENOUGH:
                break
        task.reach(1, f"independence proposals accepted: {trial.plan.expected_acceptance:.0%}")
        states = [
            _possible_start(laplace, density, walkers, ensemble_rng)
            for density, ensemble_rng in zip(laplace.densities, ensemble_rngs, strict=True)
        ]
        plan = trial.plan
        candidates = [trial, *trial.heavier]
        if plan.expected_acceptance >= ENOUGH:
            chain, log_probability, settled = _settled(laplace, states, candidates[-1].plan, pool)
            last = chain[:, SETTLING_STEPS // 2 :].reshape(-1, dimension)
            log_last = log_probability[:, SETTLING_STEPS // 2 :].ravel()
            for candidate in candidates:
                if not _overlooked(last, log_last, candidate):
                    task.reach(4)
                    return candidate.plan, settled
        plan = replace(plan, proposal=candidates[-1].plan.proposal, independence_weight=0.5)
        steps = round(PILOT_STEPS * max(1.0, (dimension / MANY) ** 2))
        for done in (2, 3):
            (chain, log_probability), states = _steps(laplace, states, plan, steps, pool)
            recent, log_recent = chain[:, steps // 3 :], log_probability[:, steps // 3 :]
            plan = _best_mixture(recent, log_recent, laplace, candidates[-1].plan.proposal, rng)
            task.reach(done, f"independence proposals accepted: {plan.expected_acceptance:.0%}")
        _, _, states = _settled(laplace, states, plan, pool)
        task.reach(4)
    return plan, states


def _overlooked(points: FloatArray, log_density: FloatArray, trial: Trial) -> bool:
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


def _settled(
    laplace: Laplace, states: Sequence[EnsembleState], plan: Plan, pool: ThreadPoolExecutor
) -> tuple[FloatArray, FloatArray, list[EnsembleState]]:
    """Chain and log-density of the last steps before sampling, as `_steps`, and the states without stuck."""
    (chain, log_probability), after = _steps(laplace, states, plan, SETTLING_STEPS, pool)
    each = zip(chain, log_probability, after, strict=True)
    return chain, log_probability, [without_strays(*ensemble) for ensemble in each]


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
        plans.append(Plan(proposal, share, acceptance, laplace.choice))
    return max(plans, key=lambda plan: plan.expected_acceptance)


def without_strays(chain: FloatArray, log_density: FloatArray, state: EnsembleState) -> EnsembleState:
    """The ensemble `state` after settling steps, stuck put where other walkers are.

    A stray did not move in all of `chain` (steps, walkers, parameters), and its `log_density` (steps,
    walkers) is below everything that the walkers that moved went through. What holds it is narrower than the
    posterior and lower: it has no weight, but a walker would not leave it by itself. A narrow peak that is
    higher may have weight and keeps its walkers, for the convergence tests to find.
    """
    stuck = np.all(chain == chain[0], axis=(0, 2))
    if stuck.all() or not stuck.any():
        return state
    stuck = np.flatnonzero(stuck & (state.log_probability < np.min(log_density[:, ~stuck])))
    moving = np.flatnonzero(~stuck)
    coordinates, log_probability = state.coordinates.copy(), state.log_probability.copy()
    hosts = moving[np.arange(len(stuck)) % len(moving)]
    coordinates[stuck], log_probability[stuck] = coordinates[hosts], log_probability[hosts]
    return replace(state, coordinates=coordinates, log_probability=log_probability)
