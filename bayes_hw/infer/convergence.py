"""When a set of ensembles has converged.

The walkers of one ensemble are not independent chains; the ensembles are. Between-ensemble agreement is
nested R-hat (Margossian et al., doi 10.1214/24-BA1453) with the ensembles as superchains; effective sample
sizes come from emcee's autocorrelation time, of the values for the bulk and of the indicators of the 5 % and
95 % quantiles for the tails.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from arviz_stats.base import array_stats

from bayes_hw.arrays import FloatArray

R_HAT_LIMIT = 1.01
R_HAT_STEPS = 250
R_HAT_WALKERS = 64
"""Longer chains are thinned evenly to at most so many steps, and larger ensembles to so many walkers, for
nested R-hat and the quantiles of the tails: sorting all values would cost more than drawing them."""
SHORT_WINDOW = 64
"""Lagged products are summed one lag after the other up to this lag, by Fourier transform beyond it."""
ESS_LIMIT = 400.0
TIMES_TAU = 5.0
"""Steps per autocorrelation time below which that time is not to be believed: the window of its sum."""
WINDOW = 5.0
MIN_TAU = 0.05
STUCK_ACCEPTANCE = 0.01
STUCK_DISTANCE = 4.0


@dataclass(frozen=True, eq=False)
class Convergence:
    """Diagnostics of every parameter, arrays of shape (parameters,), and the verdict.

    `autocorrelation_time` is in steps, the mean over the ensembles. `problems` says in words why
    `converged` is False; it is empty otherwise.
    """

    r_hat: FloatArray
    ess_bulk: FloatArray
    ess_tail: FloatArray
    autocorrelation_time: FloatArray
    problems: tuple[str, ...]

    @property
    def converged(self) -> bool:
        return not self.problems


def autocorrelation_function(chain: FloatArray) -> FloatArray:
    """Autocorrelation (steps,) of a chain (steps, walkers): lagged products about the mean of all walkers,
    summed over the walkers, by Fourier transform. The common mean keeps short chains unbiased."""
    steps = len(chain)
    centred = chain - chain.mean()
    size = 2 ** int(np.ceil(np.log2(2 * steps)))
    spectrum = np.fft.rfft(centred, n=size, axis=0)
    products = np.fft.irfft(np.sum(np.abs(spectrum) ** 2, axis=1), n=size)[:steps]
    counts = steps - np.arange(steps)
    return (products / counts) / (products[0] / steps) if products[0] > 0 else np.ones(steps)


def autocorrelation_time(chain: FloatArray) -> float:
    """Integrated autocorrelation time in steps of a chain (steps, walkers), by emcee's estimator.

    Sokal's automatic window, the first one of 5 tau or more, on the pooled autocorrelation function; the
    whole chain where none is. Infinite for a chain that does not move.
    """
    if np.ptp(chain) == 0:
        return float("inf")
    short = _within_short_window(chain)
    if short is not None:
        return short
    taus = 2.0 * np.cumsum(autocorrelation_function(chain)) - 1.0
    outside = np.flatnonzero(np.arange(len(taus)) >= WINDOW * taus)
    window = int(outside[0]) if outside.size else len(taus) - 1
    return float(max(taus[window], MIN_TAU))


def _within_short_window(chain: FloatArray) -> float | None:
    """The autocorrelation time where its window is shorter than SHORT_WINDOW lags, else None."""
    steps, walkers = chain.shape
    flat = (chain - chain.mean()).ravel()
    power = float(flat @ flat) / steps
    tau = 1.0
    for lag in range(1, min(SHORT_WINDOW, steps)):
        if lag - 1 >= WINDOW * tau:
            return max(tau, MIN_TAU)
        products = float(flat[lag * walkers :] @ flat[: (steps - lag) * walkers])
        tau += 2 * products / ((steps - lag) * power)
    return None


def effective_sample_size(chains: FloatArray) -> float:
    """Steps x walkers / autocorrelation time, summed over chains (ensembles, steps, walkers)."""
    return float(np.sum(chains[0].size / np.array([autocorrelation_time(chain) for chain in chains])))


def nested_r_hat(chains: FloatArray) -> float:
    """Rank-normalised nested R-hat of chains (ensembles, steps, walkers), ensembles as superchains."""
    ensembles, steps, walkers = chains.shape
    if np.ptp(chains) == 0:
        return float("inf")
    thinned = chains[:, :: -(-steps // R_HAT_STEPS), :: -(-walkers // R_HAT_WALKERS)]
    flat = np.moveaxis(thinned, 1, 2).reshape(ensembles * thinned.shape[2], -1)
    identifiers = np.repeat(np.arange(ensembles), thinned.shape[2])
    return float(array_stats.rhat_nested(flat, superchain_ids=identifiers))


def r_hat_of_draws(draws: FloatArray) -> float:
    """Rank-normalised split R-hat of independent draws (samples,), quarters of them in the place of chains;
    one where they are all the same."""
    if np.ptp(draws) == 0:
        return 1.0
    return float(array_stats.rhat(draws[: len(draws) // 4 * 4].reshape(4, -1)))


def assess(
    chain: FloatArray,
    names: tuple[str, ...],
    acceptance: FloatArray,
    pool: Executor | None = None,
) -> Convergence:
    """Judge chains (ensembles, steps, walkers, parameters) with acceptance fractions (ensembles,).

    Parameters are looked at side by side in a `pool` of threads.
    """
    steps = chain.shape[1]
    columns = [chain[..., i] for i in range(chain.shape[-1])]
    found = list(map(_diagnostics, columns) if pool is None else pool.map(_diagnostics, columns))
    r_hat, bulk, tail, tau = np.array(found).T
    problems = _stuck(chain, acceptance)
    problems += _limits("nested R-hat", r_hat, R_HAT_LIMIT, names, above=True)
    problems += _limits("bulk effective sample size", bulk, ESS_LIMIT, names, above=False)
    problems += _limits("tail effective sample size", tail, ESS_LIMIT, names, above=False)
    longest = float(np.max(tau))
    if steps < TIMES_TAU * longest:
        problems.append(
            f"{steps} steps are fewer than {TIMES_TAU:.0f} autocorrelation times ({longest:.0f} steps each)"
        )
    return Convergence(r_hat, bulk, tail, tau, tuple(problems))


def _diagnostics(chains: FloatArray) -> tuple[float, float, float, float]:
    """Nested R-hat, effective samples of bulk and tail, and autocorrelation time of one parameter's chains
    (ensembles, steps, walkers)."""
    one = np.ascontiguousarray(chains)
    _, steps, walkers = one.shape
    taus = np.array([autocorrelation_time(part) for part in one])
    low, high = np.quantile(
        one[:, :: -(-steps // R_HAT_STEPS), :: -(-walkers // R_HAT_WALKERS)], [0.05, 0.95]
    )
    tail = min(
        effective_sample_size((one <= low).astype(np.float64)),
        effective_sample_size((one >= high).astype(np.float64)),
    )
    return nested_r_hat(one), float(np.sum(one[0].size / taus)), tail, float(np.mean(taus))


def _limits(
    label: str, values: FloatArray, limit: float, names: tuple[str, ...], *, above: bool
) -> list[str]:
    bad = ~(values < limit) if above else ~(values >= limit)
    if not np.any(bad):
        return []
    worst = int(np.argmax(values) if above else np.argmin(values))
    side = "above" if above else "below"
    return [
        f"{label} {values[worst]:.4g} of {names[worst]} is {side} {limit:g}"
        f" ({np.count_nonzero(bad)} of {len(values)} parameters)"
    ]


def _stuck(chain: FloatArray, acceptance: FloatArray) -> list[str]:
    """Name ensembles that do not move, or that sit away from all the others."""
    found = [
        f"ensemble {i + 1} is stuck: it accepts {fraction:.2%} of its proposals"
        for i, fraction in enumerate(acceptance)
        if fraction < STUCK_ACCEPTANCE
    ]
    means = chain.mean(axis=(1, 2))
    spreads = chain.std(axis=(1, 2)) + 1e-300
    for i in range(len(chain)):
        others = np.delete(np.arange(len(chain)), i)
        centre = np.median(means[others], axis=0)
        spread = np.median(spreads[others], axis=0)
        agree = np.all(np.abs(means[others] - centre) < spread)
        distance = float(np.max(np.abs(means[i] - centre) / spread))
        if agree and distance > STUCK_DISTANCE:
            found.append(
                f"ensemble {i + 1} is stuck: its mean lies {distance:.1f} standard deviations"
                " from that of all the others"
            )
    return found
