"""How fast are the likelihood and the sampler, beside what others would use?

All in one process pinned to one core, the candidates in turns: the compiled log-probability against numpy
with scipy.signal.lfilter and against the core's peak of multiply-adds, its growth with samples and walkers;
the sampler against emcee's default move on lfilter, nutpie with a compiled gradient and NumPyro (optional
extra "benchmark"); its scaling; posteriors that are not the twin's; and what too low an AR order does. Writes
report.html, report.pdf, results.json.
"""

from __future__ import annotations

import os
import platform
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from arviz_stats.base import array_stats
from calibration_summary import summarize_calibration
from gradient_rivals import numpyro_runner, nutpie_runner
from hard_axes import HARD_AXES, HARD_AXES_SEED, hard_axis
from pages.figures_performance import Scaling
from pages.performance_report import HardCase, OrderRow, Performance, Rival, performance_report
from performance_cases import (
    Case,
    axis_of_modes,
    case_of,
    first_call_seconds,
    fma_seconds,
    operations,
    peak_memory_mb,
    repeated,
    shortest_seconds,
    smallest_ess,
    twin_case,
)
from prior_calibration import CalibrationCase, calibrate_once, calibration_tasks
from rivals import NaivePosterior, StraightGradient, naive_chain
from study import start_study

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import autocorrelation_time
from bayes_hw.infer.ensemble import advance, start_ensemble
from bayes_hw.infer.moves import DifferentialEvolutionMove
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.threads import one_blas_thread

MANY_WALKERS = SamplerSettings(walkers=1024, max_steps=200, target_ess=1e9)
NAIVE_WALKERS = 32
LENGTHS = (600, 2400, 20_000, 200_000, 1_000_000)
NOISE = (0.6, 0.5)
"""Partial autocorrelations of the noise whose order is taken too low."""


def main() -> None:
    study = start_study("06_performance", __doc__)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=pin_to_one_core) as pool:
        found = pool.submit(measure, study.seed, study.quick).result()
    study.write_document(performance_report(found, study.origin()))
    summary = {
        "speed_up_over_lfilter": found.speed_up,
        "share_of_fma_peak": found.share_of_peak,
        "times_faster": {r.name: found.ratio(r) for r in found.samplers[1:] if r.rates},
    }
    study.write_results(summary | asdict(found))
    print(f"log-probability: {found.speed_up:.0f} times lfilter, {found.share_of_peak:.0%} of the FMA peak")
    for rival in found.samplers:
        rate = f"{rival.rate:.4g} effective samples/s, {found.ratio(rival):.4g} times" if rival.rates else ""
        print(f"{rival.name:14s} {rate or 'not installed'}")


def pin_to_one_core() -> None:
    """The last core that this process may use."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def measure(seed: int, quick: bool) -> Performance:
    """All measurements, in this process."""
    with one_blas_thread():
        return _measure(seed, quick)


def _measure(seed: int, quick: bool) -> Performance:
    rounds = 1 if quick else 3
    case, one_record = twin_case(seed), twin_case(seed, 1)
    kernel_ns, naive_ns, fma_ns, walkers_ns = likelihood_times(one_record, 2 if quick else 12)
    samples_ns, memory = growth(one_record, LENGTHS[: 2 if quick else None])
    default, default_seconds = case.sample(SamplerSettings(), seed)
    return Performance(
        kernel_ns=kernel_ns,
        naive_ns=naive_ns,
        fma_ns=fma_ns,
        operations=operations(one_record.target),
        walkers_ns=walkers_ns,
        samples_ns=samples_ns,
        memory_mb=memory,
        first_call_seconds=min(first_call_seconds() for _ in range(1 if quick else 3)),
        samplers=sampler_rates(case, rounds, quick),
        start_seconds=case.start_seconds,
        default_seconds=default_seconds,
        default_ess=float(default.convergence.ess_bulk.min()),
        default_tail_ess=float(default.convergence.ess_tail.min()),
        by_parameters=tuple(scaling(m, 1200, seed) for m in ((0, 2) if quick else (0, 1, 2, 3, 5, 7, 9))),
        by_samples=tuple(
            scaling(2, n, seed) for n in ((600, 1200) if quick else (600, 1200, 2400, 4800, 9600, 19_200))
        ),
        hard=tuple(hard_case(name, seed, quick) for name in HARD_AXES),
        true_order=len(NOISE),
        orders=too_low_orders(seed, 2 if quick else 24),
        rounds=rounds,
        machine=f"{processor()}, Python {platform.python_version()}",
    )


def likelihood_times(case: Case, repeats: int) -> tuple[float, float, float, dict[int, float]]:
    """Whole call and lfilter in ns a walker and sample, a multiply-add in ns, and the call by walkers."""
    samples = len(case.target.records[0])
    naive, clouds = NaivePosterior(case.target), {w: case.cloud(w, w) for w in (32, 64, 128, 256, 1024, 4096)}
    naive(clouds[32][0])
    for cloud in clouds.values():
        case.target(cloud)
    best = dict.fromkeys(clouds, np.inf)
    best_naive = best_fma = np.inf
    for _ in range(repeats):
        best_fma = min(best_fma, fma_seconds())
        for walkers, cloud in clouds.items():
            seconds = shortest_seconds(lambda cloud=cloud: case.target(cloud), 3)
            best[walkers] = min(best[walkers], seconds / walkers / samples)
        seconds = shortest_seconds(lambda: [naive(x) for x in clouds[32]], 3)
        best_naive = min(best_naive, seconds / 32 / samples)
    in_ns = {walkers: 1e9 * seconds for walkers, seconds in best.items()}
    return in_ns[1024], 1e9 * best_naive, 1e9 * best_fma, in_ns


def growth(case: Case, lengths: tuple[int, ...]) -> tuple[dict[int, float], dict[str, float]]:
    """Time of 64 walkers a walker and sample by samples, and the largest memory of the process."""
    cloud = case.cloud(64, 1)
    memory = {"the calls of a hundred walkers": peak_memory_mb()}
    case.target(case.cloud(4096, 2))
    memory["4,096 walkers of 2,400 samples"] = peak_memory_mb()
    found = {}
    for samples in lengths:
        target = repeated(case, samples)
        found[samples] = 1e9 * shortest_seconds(lambda target=target: target(cloud), 3) / 64 / samples
    memory[f"64 walkers of {lengths[-1]:,} samples"] = peak_memory_mb()
    return found, memory


def sampler_rates(case: Case, rounds: int, quick: bool) -> tuple[Rival, ...]:
    """Effective samples per CPU second of every sampler, one number a round, in turns."""
    gradient, straight = StraightGradient(case.target, case.reparameterisation), case.straight
    tune, draws, naive_steps = (100, 100, 200) if quick else (300, 2000, 2000)
    gradient_runs = {}
    for name, make, counts in (
        ("nutpie", nutpie_runner, (tune, draws)),
        ("NumPyro NUTS", numpyro_runner, (tune // 4, draws // 20)),
    ):
        try:
            gradient_runs[name] = make(gradient, straight, *counts)
            gradient_runs[name](0)
        except ImportError:
            continue
    own = SamplerSettings(walkers=256, max_steps=50, target_ess=1e9) if quick else MANY_WALKERS
    case.sample(SamplerSettings(max_steps=50), 0)
    rates: dict[str, list[float]] = {"bayes_hw": [], "naive": [], "nutpie": [], "NumPyro NUTS": []}
    for number in range(1, rounds + 1):
        found, seconds = case.sample(own, number)
        rates["bayes_hw"].append(smallest_ess(found.chain) / seconds)
        for name, run in gradient_runs.items():
            drawn, seconds = run(number)
            rates[name].append(smallest_bulk_ess(drawn) / seconds)
        rates["naive"].append(naive_rate(case, naive_steps, number))
    steps = f"{own.max_steps} steps of 4 ensembles of {own.walkers} walkers"
    return (
        Rival("bayes_hw", steps, tuple(rates["bayes_hw"])),
        Rival(
            "naive",
            f"numpy + lfilter, emcee's stretch move, {NAIVE_WALKERS} walkers, {naive_steps} steps",
            tuple(rates["naive"]),
            5000.0,
        ),
        Rival(
            "nutpie",
            f"compiled gradient, straight whitened coordinates, {tune} + {draws} draws",
            tuple(rates["nutpie"]),
            100.0,
        ),
        Rival(
            "NumPyro NUTS",
            f"JAX, the same coordinates, {tune // 4} + {draws // 20} draws",
            tuple(rates["NumPyro NUTS"]),
            1000.0,
        ),
    )


def smallest_bulk_ess(chains: FloatArray) -> float:
    """ArviZ's, of chains (chains, draws, parameters)."""
    return min(
        float(array_stats.ess(chains[..., i], chain_axis=0, draw_axis=1, method="bulk"))
        for i in range(chains.shape[-1])
    )


def naive_rate(case: Case, steps: int, seed: int) -> float:
    """emcee as it comes, started about the mode; the first tenth of its steps is dropped, not their time."""
    start = case.cloud(NAIVE_WALKERS, seed)
    begin = time.process_time()
    chain = naive_chain(case.target, start, steps, seed)
    seconds = time.process_time() - begin
    return smallest_ess(chain[None, steps // 10 :]) / seconds


def scaling(modes: int, samples: int, seed: int) -> Scaling:
    """The default sampler on an axis of so many modes."""
    model, record = axis_of_modes(modes, samples, seed)
    case = case_of(model, [record], seed)
    found, seconds = case.sample(SamplerSettings(), seed)
    rate = float(found.convergence.ess_bulk.min()) / seconds
    return Scaling(case.target.dimension, samples, rate, found.convergence.converged)


def hard_case(name: str, seed: int, quick: bool) -> HardCase:
    """The default sampler on one of HARD_AXES, and differential evolution alone beside it."""
    hard = hard_axis(name, np.random.default_rng(HARD_AXES_SEED), 600 if quick else 1200)
    case = case_of(hard.model, [hard.record], seed)
    found, seconds = case.sample(SamplerSettings(target_ess=1000 if quick else 4000, max_steps=2000), seed)
    flat = found.chain.reshape(-1, case.target.dimension)
    start = flat[np.random.default_rng(seed).choice(len(flat), 512, replace=False)]
    moves = [(DifferentialEvolutionMove(), 1.0)]
    steps = 150 if quick else 1500
    _, _, _, state = advance(start_ensemble(start, case.target, seed), case.target, moves, steps // 3)
    reference = advance(state, case.target, moves, steps)[0]
    z = [
        standard_difference(found.chain[..., i], reference[..., i], power)
        for i in range(case.target.dimension)
        for power in (1, 2)
    ]
    rate = float(found.convergence.ess_bulk.min()) / seconds
    return HardCase(name, rate, seconds, found.convergence.converged, float(np.max(np.abs(z))), len(z))


def standard_difference(chains: FloatArray, reference: FloatArray, power: int) -> float:
    """Difference of moments of (ensembles, steps, walkers) and (steps, walkers), in standard errors."""
    a, b = (chains - reference.mean()) ** power, (reference - reference.mean()) ** power
    size = sum(part.size / autocorrelation_time(part) for part in a)
    size_b = min(b.size / autocorrelation_time(b), 512)
    return float((a.mean() - b.mean()) / np.sqrt(a.var() / size + b.var() / size_b))


def too_low_orders(seed: int, replicates: int) -> tuple[OrderRow, ...]:
    """Coverage with the true AR order and with lower ones."""
    model, record = axis_of_modes(1, 600, seed)
    case = CalibrationCase(
        model,
        record.u,
        partial=NOISE,
        fixed_partial=True,
        prior_width=0.25,
        settings=SamplerSettings(ensembles=4, walkers=64, max_steps=400, target_ess=400.0),
    )
    rows = []
    for order in range(len(NOISE) + 1):
        one = replace(case, assumed_order=order)
        results = [calibrate_once(task) for task in calibration_tasks(one, replicates, seed)]
        summary = summarize_calibration(results, np.random.default_rng(seed))
        held = summary.axis_coverage()
        rows.append(OrderRow(order, replicates, held[0], held[2], summary.not_white))
    return tuple(rows)


def processor() -> str:
    """The name of the processor, where the system tells it."""
    path = Path("/proc/cpuinfo")
    names = [line for line in path.read_text().splitlines() if "model name" in line] if path.exists() else []
    return names[0].split(":")[1].strip() if names else platform.machine()


if __name__ == "__main__":
    main()
