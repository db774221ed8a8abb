"""Sampling a log-density with several emcee ensembles until they agree."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from emcee.moves import Move

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.checkpoint import Block, Checkpoint, Plan
from bayes_hw.infer.convergence import Convergence, assess
from bayes_hw.infer.ensemble import EnsembleState, advance
from bayes_hw.infer.laplace import CoordinateMap, Laplace, LogDensity
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.infer.pilot import run_pilot
from bayes_hw.progress import Progress

MIN_STEPS = 50
LOOK_AGAIN = 0.5
"""Convergence is looked at again when the chain has grown by this share."""
DRAWS_COUNT_AT_MOST = 2.0
"""Effective samples that a draw can count for: one, but for the error of the estimate."""


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
    others: Sequence[tuple[FloatArray, FloatArray]] = (),
    reparameterisation: CoordinateMap | None = None,
    maps: Sequence[Sequence[CoordinateMap]] = ((),),
    jobs: int = 1,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
    resume: bool = False,
) -> Sampling:
    """Sample a density given its approximate mode (parameters,) and covariance, in coordinates.

    `others` are further modes and their covariances.

    A pilot from overdispersed starts (a t distribution of twice the Laplace width) finds a density for
    independence proposals, whose acceptance decides their share beside differential evolution, and whether
    the walkers move in straight coordinates, where `reparameterisation` gives some: see
    `bayes_hw.infer.pilot`. Either way they do in the coordinates that `maps` lead to, one after the other;
    further such lines of maps, each costlier than the one before, are for what that does not straighten.
    Then the proposal is frozen, the pilot is thrown away, and the ensembles run until they agree, most of
    their proposals from then on at the side opposite to the walker. `make_log_density` gives every ensemble a
    density of its own, so that they can run in `jobs` threads; the numbers do not depend on `jobs`.
    """
    settings = settings or SamplerSettings()
    progress = progress or Progress(quiet=True)
    begin = time.perf_counter()
    densities = [make_log_density() for _ in range(settings.ensembles)]
    names = densities[0].names
    choices: list[list[Laplace]] = []
    for line in maps:
        choices.append([Laplace([(mode, covariance), *others], densities)])
        for mapping in line:
            choices[-1] = [choices[-1][0].carried(mapping)]
        if reparameterisation is not None:
            choices[-1].append(choices[-1][0].carried(reparameterisation))
    numbers = count()
    choices = [[replace(one, choice=next(numbers)) for one in group] for group in choices]
    pilot_rng, *ensemble_rngs = rng.spawn(1 + settings.ensembles)
    walkers = settings.walkers_for(len(mode))
    stored = checkpoint.load() if checkpoint is not None and resume else None
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        if stored is None:
            if checkpoint is not None:
                checkpoint.clear()
            plan, states = run_pilot(choices, walkers, pilot_rng, ensemble_rngs, pool, progress)
            blocks: list[Block] = []
            if checkpoint is not None:
                checkpoint.save_plan(plan, states)
        else:
            plan, blocks, states = stored
        moves = weighted_moves(plan.proposal, plan.independence_weight, opposite=True)
        chosen = [one for group in choices for one in group][plan.choice]
        with progress.task("sampling", settings.max_steps) as task:
            while True:
                steps = len(blocks) * settings.block
                draws = steps * settings.ensembles * walkers
                within_reach = DRAWS_COUNT_AT_MOST * draws >= settings.target_ess
                if steps >= settings.max_steps or (within_reach and _is_look(steps, settings.block)):
                    chain, acceptance = _joined(blocks)
                    convergence = assess(chain, names, acceptance, pool)
                    smallest = min(convergence.ess_bulk.min(), convergence.ess_tail.min())
                    task.reach(
                        steps,
                        f"R-hat {convergence.r_hat.max():.3f}, effective samples {smallest:.0f}",
                    )
                    enough = convergence.converged and smallest >= settings.target_ess
                    if enough or steps >= settings.max_steps:
                        break
                elif not within_reach:
                    task.reach(steps)
                block, states = _block(chosen, states, moves, settings.block, pool)
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
    chosen: Laplace,
    states: list[EnsembleState],
    moves: list[tuple[Move, float]],
    steps: int,
    pool: ThreadPoolExecutor,
) -> tuple[Block, list[EnsembleState]]:
    densities = chosen.densities
    before = sum(density.non_finite for density in densities)
    futures = [
        pool.submit(advance, state, density, moves, steps)
        for state, density in zip(states, densities, strict=True)
    ]
    results = [future.result() for future in futures]
    chain = np.stack([chain for chain, _, _, _ in results])
    log_probability = np.stack([log_probability for _, log_probability, _, _ in results])
    if chosen.maps:
        chain, log_jacobian = chosen.to_plain(chain)
        log_probability = log_probability - log_jacobian
    block = Block(
        chain,
        log_probability,
        np.array([accepted for _, _, accepted, _ in results]),
        sum(density.non_finite for density in densities) - before,
    )
    return block, [state for _, _, _, state in results]
