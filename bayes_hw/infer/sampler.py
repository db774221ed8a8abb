"""Sampling a log-density with several emcee ensembles until they agree."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.checkpoint import Block, Checkpoint, Plan
from bayes_hw.infer.convergence import Convergence, assess
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.mixture import StudentTMixture, defended, fit_student_t_mixture, laplace_proposal
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.progress import Progress

PILOT_STEPS = 90
SETTLING_STEPS = 25
START_INFLATION = 4.0
HOPELESS = 15.0
"""Log-density a dimension below the best start at which a start is given up."""
SMALLEST_START = 1e-6
MIN_STEPS = 100
LOOK_AGAIN = 0.3
"""Convergence is looked at again when the chain has grown by this share."""
PILOT_COMPONENTS = (1, 4)
TRIAL_PROPOSALS = 2048


class LogDensity(Protocol):
    """A vectorised log-density that counts what it could not evaluate."""

    non_finite: int

    @property
    def names(self) -> tuple[str, ...]: ...

    def __call__(self, coordinates: FloatArray) -> FloatArray: ...


@dataclass(frozen=True)
class SamplerSettings:
    """How long to sample: stop as soon as every parameter has converged with `target_ess` effective samples,
    at the latest after `max_steps` steps of every walker. Steps are taken in blocks of `block`."""

    ensembles: int = 4
    walkers: int | None = None
    block: int = 25
    max_steps: int = 5000
    target_ess: float = 1000.0

    def walkers_for(self, dimension: int) -> int:
        """Walkers of one ensemble: whole lanes of the kernel in either half, over twice the dimension."""
        return self.walkers or max(128, 64 * -(-5 * dimension // 128))


@dataclass(frozen=True, eq=False)
class Sampling:
    """What the sampler found: chain (ensembles, steps, walkers, parameters) in coordinates, its log-density
    without the last axis, acceptance (ensembles,), and how it got there."""

    chain: FloatArray
    log_probability: FloatArray
    acceptance: FloatArray
    convergence: Convergence
    plan: Plan
    non_finite: int
    seconds: float


def sample(
    make_log_density: Callable[[], LogDensity],
    mode: FloatArray,
    covariance: FloatArray,
    rng: np.random.Generator,
    *,
    settings: SamplerSettings | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
    resume: bool = False,
) -> Sampling:
    """Sample a density given its approximate mode (parameters,) and covariance, in coordinates.

    A pilot from overdispersed starts (a t distribution of twice the Laplace width) runs independence
    proposals and differential evolution side by side; t mixtures refitted to it are tried, and the better
    one's acceptance decides the share of independence proposals. Then the proposal is frozen, the pilot is
    thrown away, and the ensembles run until they agree. `make_log_density` gives every ensemble a density of
    its own, so that they can run in `jobs` threads; the numbers do not depend on `jobs`.
    """
    settings = settings or SamplerSettings()
    progress = progress or Progress(quiet=True)
    begin = time.perf_counter()
    densities = [make_log_density() for _ in range(settings.ensembles)]
    names = densities[0].names
    pilot_rng, *ensemble_rngs = rng.spawn(1 + settings.ensembles)
    stored = checkpoint.load() if checkpoint is not None and resume else None
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        if stored is None:
            if checkpoint is not None:
                checkpoint.clear()
            plan, states = _pilot(
                densities, mode, covariance, pilot_rng, ensemble_rngs, settings, pool, progress
            )
            blocks: list[Block] = []
            if checkpoint is not None:
                checkpoint.save_plan(plan, states)
        else:
            plan, blocks, states = stored
        moves = weighted_moves(plan.proposal, plan.independence_weight)
        with progress.task("sampling", settings.max_steps) as task:
            while True:
                steps = len(blocks) * settings.block
                if steps >= settings.max_steps or _is_look(steps, settings.block):
                    chain, acceptance = _joined(blocks)
                    convergence = assess(chain, names, acceptance)
                    smallest = min(convergence.ess_bulk.min(), convergence.ess_tail.min())
                    task.reach(
                        steps,
                        f"R-hat {convergence.r_hat.max():.3f}, effective samples {smallest:.0f}",
                    )
                    enough = convergence.converged and smallest >= settings.target_ess
                    if enough or steps >= settings.max_steps:
                        break
                block, states = _block(densities, states, moves, settings.block, pool)
                blocks.append(block)
                if checkpoint is not None:
                    checkpoint.save_block(len(blocks), block, states)
    return Sampling(
        chain,
        np.concatenate([block.log_probability for block in blocks], axis=1),
        acceptance,
        convergence,
        plan,
        sum(block.non_finite for block in blocks),
        time.perf_counter() - begin,
    )


def _is_look(steps: int, block: int) -> bool:
    """Whether convergence is looked at after `steps` steps; the same in a run that was interrupted."""
    look = block * -(-MIN_STEPS // block)
    while look < steps:
        look += block * max(1, -(-int(LOOK_AGAIN * look) // block))
    return look == steps


def _joined(blocks: list[Block]) -> tuple[FloatArray, FloatArray]:
    chain = np.concatenate([block.chain for block in blocks], axis=1)
    return chain, np.mean([block.acceptance for block in blocks], axis=0)


def _block(
    densities: list[LogDensity],
    states: list[EnsembleState],
    moves: list[tuple[object, float]],
    steps: int,
    pool: ThreadPoolExecutor,
) -> tuple[Block, list[EnsembleState]]:
    before = sum(density.non_finite for density in densities)
    futures = [
        pool.submit(advance, state, density, moves, steps)
        for state, density in zip(states, densities, strict=True)
    ]
    results = [future.result() for future in futures]
    block = Block(
        np.stack([chain for chain, _, _, _ in results]),
        np.stack([log_probability for _, log_probability, _, _ in results]),
        np.array([accepted for _, _, accepted, _ in results]),
        sum(density.non_finite for density in densities) - before,
    )
    return block, [state for _, _, _, state in results]


def _pilot(
    densities: list[LogDensity],
    mode: FloatArray,
    covariance: FloatArray,
    rng: np.random.Generator,
    ensemble_rngs: list[np.random.Generator],
    settings: SamplerSettings,
    pool: ThreadPoolExecutor,
    progress: Progress,
) -> tuple[Plan, list[EnsembleState]]:
    """Overdispersed starts, a mixed pilot, a refit of the proposal, and a few steps to forget the pilot."""
    walkers = settings.walkers_for(len(mode))
    if walkers < 2 * len(mode):
        raise InputError(f"--walkers {walkers}: {len(mode)} parameters need {2 * len(mode)} or more")
    wide = laplace_proposal(mode, covariance, START_INFLATION)
    states = [
        _possible_start(wide, mode, density, walkers, ensemble_rng)
        for density, ensemble_rng in zip(densities, ensemble_rngs, strict=True)
    ]
    moves = weighted_moves(laplace_proposal(mode, covariance, 1.2), 0.5)
    with progress.task("pilot", 3) as task:
        for done in range(2):
            block, states = _block(densities, states, moves, PILOT_STEPS, pool)
            recent = block.chain[:, PILOT_STEPS // 3 :].reshape(-1, len(mode))
            log_recent = block.log_probability[:, PILOT_STEPS // 3 :].ravel()
            plan = _best_plan(recent, log_recent, densities[0], rng)
            moves = weighted_moves(plan.proposal, plan.independence_weight)
            task.reach(done + 1, f"independence proposals accepted: {plan.expected_acceptance:.0%}")
        _, states = _block(densities, states, moves, SETTLING_STEPS, pool)
        task.reach(3)
    return plan, states


def _possible_start(
    wide: StudentTMixture,
    mode: FloatArray,
    density: LogDensity,
    walkers: int,
    rng: np.random.Generator,
) -> EnsembleState:
    """Draws from `wide` that are not hopeless; the width shrinks while too few of them are kept.

    A draw is hopeless when its density is zero, or so far below the best draw's that an overdispersed point
    of the posterior would not be: such a walker climbs the nearest side peak, however small, and stays.

    Raises InputError when the density is zero at the mode itself and all around it.
    """
    kept = np.empty((0, len(mode)))
    shrink, best = 1.0, -np.inf
    while len(kept) < walkers:
        if shrink < SMALLEST_START:
            raise InputError(
                "sampling: no parameters near the least-squares estimate are possible; "
                "give a model closer to the data, its modes in order of frequency"
            )
        drawn = mode + (wide.sample(2 * walkers, rng) - mode) * shrink
        log_density = density(drawn)
        best = max(best, float(np.max(log_density)))
        hopeful = np.isfinite(log_density) & (log_density > best - HOPELESS * len(mode))
        kept = np.concatenate([kept, drawn[hopeful]])
        shrink *= 0.8
    return start_ensemble(kept[:walkers], density, int(rng.integers(2**63)))


def _best_plan(
    points: FloatArray, log_density: FloatArray, density: LogDensity, rng: np.random.Generator
) -> Plan:
    """Fit mixtures to the pilot's points and keep the one whose proposals would be accepted most.

    The mean acceptance of independence proposals is E min(1, w'/w) with w = p/q at points of the chain and
    w' at fresh draws of q.
    """
    chosen = rng.choice(len(points), size=min(len(points), 4 * TRIAL_PROPOSALS), replace=False)
    plans = []
    for components in PILOT_COMPONENTS:
        proposal = defended(fit_student_t_mixture(points[chosen], components, rng), points[chosen])
        trial = proposal.sample(TRIAL_PROPOSALS, rng)
        at_trial = density(trial) - proposal.log_density(trial)
        at_points = (log_density[chosen] - proposal.log_density(points[chosen]))[:TRIAL_PROPOSALS]
        difference = rng.permutation(at_trial)[: len(at_points)] - at_points
        acceptance = float(np.mean(np.exp(np.minimum(difference, 0))))
        plans.append(Plan(proposal, independence_share(acceptance), acceptance))
    return max(plans, key=lambda plan: plan.expected_acceptance)


def independence_share(acceptance: float) -> float:
    """Share of independence proposals among the moves, given their mean acceptance.

    An independence chain's autocorrelation time is about 2 / acceptance - 1 steps, that of differential
    evolution some 4 steps a dimension: the former pays above a few per cent. Differential evolution keeps at
    least half as insurance: where the proposal is too thin, in the far tails, it alone moves the walkers.
    """
    return float(np.clip(2.5 * acceptance, 0.1, 0.5))
