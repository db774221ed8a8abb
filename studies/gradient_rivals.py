"""No-U-turn samplers of the same posterior: nutpie on a compiled gradient, NumPyro on JAX's own.

Both move in straight coordinates whitened by the Laplace approximation at the mode, their best: what is left
for their adaptation is a step size. Compilation is not counted.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rivals import FIRST_MODE, GAIN, HALF_WIDTH, LOWER, UPPER, StraightGradient, log_posterior_and_gradient

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.laplace import Laplace

Run = Callable[[int], tuple[FloatArray, float]]
"""From a seed to whitened draws (chains, draws, parameters) in coordinates, and the CPU seconds they took."""


def whitening(laplace: Laplace) -> tuple[FloatArray, FloatArray]:
    """Mode (parameters,) and lower factor of the covariance, in straight coordinates."""
    mode, covariance = laplace.modes[0]
    return mode, np.linalg.cholesky(covariance)


def nutpie_runner(gradient: StraightGradient, laplace: Laplace, tune: int, draws: int) -> Run:
    """nutpie, one chain. Raises ImportError where it is not installed."""
    import nutpie
    from nutpie.compiled_pyfunc import from_pyfunc

    mode, factor = whitening(laplace)
    arguments, dimension = gradient.arguments(), len(mode)

    def make_log_density() -> Callable[[FloatArray], tuple[float, FloatArray]]:
        slope = np.zeros(dimension)

        def log_density(z: FloatArray) -> tuple[float, FloatArray]:
            value = log_posterior_and_gradient(mode + factor @ z, *arguments, slope)
            return float(value), factor.T @ slope

        return log_density

    def make_expand(*_: object) -> Callable[[FloatArray], dict[str, FloatArray]]:
        return lambda z: {"z": np.array(z)}

    model = from_pyfunc(
        dimension,
        make_log_density,
        make_expand,
        [np.dtype(np.float64)],
        [(dimension,)],
        ["z"],
        make_initial_point_fn=lambda seed: np.random.default_rng(seed).standard_normal(dimension),
    )

    def run(seed: int) -> tuple[FloatArray, float]:
        begin = time.process_time()
        trace = nutpie.sample(
            model, draws=draws, tune=tune, chains=1, cores=1, seed=seed, save_warmup=False, progress_bar=False
        )
        seconds = time.process_time() - begin
        return mode + np.asarray(trace.posterior["z"]) @ factor.T, seconds

    return run


def numpyro_runner(gradient: StraightGradient, laplace: Laplace, tune: int, draws: int) -> Run:
    """NumPyro's NUTS, one chain. Raises ImportError where it is not installed."""
    import jax
    import jax.numpy as jnp
    from numpyro.infer import MCMC, NUTS

    jax.config.update("jax_enable_x64", True)
    mode, factor = whitening(laplace)
    log_density = jax_log_density(gradient)
    shift, scale = jnp.asarray(mode), jnp.asarray(factor)
    kernel = NUTS(potential_fn=lambda z: -log_density(shift + scale @ z))
    mcmc = MCMC(kernel, num_warmup=tune, num_samples=draws, num_chains=1, progress_bar=False)

    def run(seed: int) -> tuple[FloatArray, float]:
        start = jnp.asarray(np.random.default_rng(seed).standard_normal(len(mode)))
        begin = time.process_time()
        mcmc.run(jax.random.PRNGKey(seed), init_params=start)
        drawn = np.asarray(mcmc.get_samples(group_by_chain=True))
        return mode + drawn @ factor.T, time.process_time() - begin

    return run


def jax_log_density(gradient: StraightGradient) -> Callable[[Any], Any]:
    """The log-posterior of straight coordinates in JAX: one scan over the samples, modal form."""
    import jax
    import jax.numpy as jnp

    (u, y, first, real, zeros, n_modes, rate, priors, scale, low_grid, low, high_grid, high, mean_u) = (
        gradient.arguments()
    )
    starts = [*np.flatnonzero(first).tolist(), len(u)]
    low_at = low_grid[0] + low_grid[1] * np.arange(len(low))
    high_at = high_grid[0] + high_grid[1] * np.arange(len(high))

    def inverse(at: Any, values: Any, wanted: Any) -> tuple[Any, Any]:
        place = jnp.clip(jnp.searchsorted(values, wanted, side="right") - 1, 0, len(values) - 2)
        slope = (at[1] - at[0]) / (values[place + 1] - values[place])
        return at[place] + (wanted - values[place]) * slope, slope

    def log_density(q: Any) -> Any:
        gain, half_width = jnp.exp(q[GAIN]), jnp.exp(q[HALF_WIDTH])
        upper, upper_slope = inverse(jnp.asarray(high_at), jnp.asarray(high), q[UPPER])
        cut = jnp.maximum(-q[UPPER], 0.0) ** 1.5
        lower, lower_slope = inverse(jnp.asarray(low_at), jnp.asarray(low), q[LOWER] / gain - mean_u + cut)
        frequency = jnp.exp(q[FIRST_MODE : FIRST_MODE + 2 * n_modes : 2])
        damping = jnp.exp(q[FIRST_MODE + 1 : FIRST_MODE + 2 * n_modes : 2])
        angle = 2 * jnp.pi * frequency / rate
        turned = angle * jnp.sqrt(1 - damping**2)
        pairs = jnp.exp(-angle * damping) * (jnp.cos(turned) + 1j * jnp.sin(turned))
        poles = jnp.concatenate([jnp.asarray(real) + 0j, pairs])
        every = jnp.concatenate([poles, jnp.conj(pairs)])
        differences = poles[:, None] - every[None, :]
        differences = differences + jnp.eye(len(real) + n_modes, len(real) + 2 * n_modes)
        residues = gain * jnp.prod(poles[:, None] - zeros[None, :], axis=1) / jnp.prod(differences, axis=1)
        r, p = residues[len(real) :], pairs
        a1, a2 = 2 * p.real, jnp.abs(p) ** 2
        b1, b2 = 2 * r.real, -2 * (r * jnp.conj(p)).real
        direct = residues[: len(real)].real
        v = jnp.clip(jnp.asarray(u), lower, upper)

        def advance(state: Any, command: Any) -> tuple[Any, Any]:
            x, newer, older = state
            w = direct @ x + b1 @ newer + b2 @ older
            return (real * x + command, command + a1 * newer - a2 * older, newer), w

        rest = (jnp.zeros(len(real)), jnp.zeros(n_modes), jnp.zeros(n_modes))
        sigma, kappa = jnp.exp(q[-2]), jnp.tanh(q[-1])
        shrinkage = 1 - kappa**2
        variance = sigma**2 * shrinkage
        total = -0.5 * len(u) * jnp.log(2 * jnp.pi * variance)
        for begin, end in itertools.pairwise(starts):
            _, w = jax.lax.scan(advance, rest, v[begin:end], unroll=8)
            e = jnp.asarray(y[begin:end]) - jnp.sign(w) * jnp.maximum(jnp.abs(w) - half_width, 0.0)
            squares = jnp.sum((e[1:] - kappa * e[:-1]) ** 2) + shrinkage * e[0] ** 2
            total += 0.5 * jnp.log(shrinkage) - 0.5 * squares / variance
        log_lower, log_upper = jnp.log(-lower), jnp.log(upper)
        total += jnp.log(shrinkage) + jnp.log(upper_slope * lower_slope) - q[GAIN]
        total += -0.5 * ((log_lower - priors[LOWER, 0]) / priors[LOWER, 1]) ** 2 - log_lower
        total += -0.5 * ((log_upper - priors[UPPER, 0]) / priors[UPPER, 1]) ** 2 - log_upper
        total += -0.5 * (half_width / scale) ** 2 + q[HALF_WIDTH]
        normal = (q[GAIN:-1] - priors[GAIN:-1, 0]) / priors[GAIN:-1, 1]
        return total - 0.5 * jnp.sum(normal**2)

    return log_density
