"""The posterior of some records sampled by others: numpy with emcee's default move, nutpie, NumPyro.

All have the density of `bayes_hw.infer.log_posterior.LogPosterior` for records from rest with AR(1) noise,
free dominant modes and a saturation, dead zone and gain. The gradient samplers work in straight coordinates
(`bayes_hw.infer.reparameterisation`), where they are faster than in any other tried here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np
from numba import njit
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.reparameterisation import Reparameterisation

LOWER, UPPER, HALF_WIDTH, GAIN, FIRST_MODE = range(5)


class NaivePosterior:
    """The log-posterior of one parameter vector with numpy and scipy.signal.lfilter."""

    def __init__(self, target: LogPosterior) -> None:
        model = target.axis.model
        self.parameters = target.parameters
        self.rate, self.delay = model.sample_rate_hz, model.linear.delay_samples
        self.records = target.records
        self.n_modes = len(model.dominant_modes)
        chosen = list(model.mode_indices())
        moving = np.concatenate([model.linear.poles[chosen], np.conj(model.linear.poles[chosen])])
        self.fixed = np.array([p for p in model.linear.poles if np.min(np.abs(moving - p)) > 1e-12])
        self.numerator = np.real(np.poly(model.linear.zeros))

    def __call__(self, coordinates: FloatArray) -> float:
        log_prior = 0.0
        values = np.empty(len(coordinates))
        for i, (parameter, q) in enumerate(zip(self.parameters, coordinates, strict=True)):
            values[i] = parameter.transform.to_value(q)
            log_prior += parameter.prior.log_density(values[i]) + parameter.transform.log_jacobian(q)
        frequency = values[FIRST_MODE : FIRST_MODE + 2 * self.n_modes : 2]
        damping = values[FIRST_MODE + 1 : FIRST_MODE + 2 * self.n_modes : 2]
        if not np.isfinite(log_prior) or np.any(np.diff(frequency) <= 0) or np.any(damping >= 1):
            return -np.inf
        s = 2 * np.pi * frequency * (-damping + 1j * np.sqrt(1 - damping**2))
        pairs = np.exp(s / self.rate)
        a = np.real(np.poly(np.concatenate([self.fixed, pairs, pairs.conj()])))
        b = np.zeros(len(a))
        b[len(a) - len(self.numerator) :] = values[GAIN] * self.numerator
        sigma, kappa = values[-2], values[-1]
        variance = sigma**2 * (1 - kappa**2)
        total = log_prior
        for record in self.records:
            v = np.zeros(len(record))
            v[self.delay :] = np.clip(record.u, values[LOWER], values[UPPER])[: len(record) - self.delay]
            w = signal.lfilter(b, a, v)
            e = record.y - np.sign(w) * np.maximum(np.abs(w) - values[HALF_WIDTH], 0)
            innovations = e[1:] - kappa * e[:-1]
            squares = innovations @ innovations + (1 - kappa**2) * e[0] ** 2
            total += -0.5 * len(e) * np.log(2 * np.pi * variance) + 0.5 * np.log(1 - kappa**2)
            total += -0.5 * squares / variance
        return float(total) if np.isfinite(total) else -np.inf


def naive_chain(target: LogPosterior, start: FloatArray, steps: int, seed: int) -> FloatArray:
    """emcee with its default stretch move: a chain (steps, walkers, parameters)."""
    sampler = emcee.EnsembleSampler(len(start), start.shape[1], NaivePosterior(target))
    sampler._random.seed(seed)
    sampler.run_mcmc(start, steps)
    return np.asarray(sampler.get_chain())


@dataclass(frozen=True, eq=False)
class StraightGradient:
    """Log-posterior and gradient at one point of straight coordinates, compiled (forward sensitivities)."""

    target: LogPosterior
    reparameterisation: Reparameterisation

    def arguments(self) -> tuple[Any, ...]:
        """What `log_posterior_and_gradient` takes after the point."""
        target, straight = self.target, self.reparameterisation
        naive = NaivePosterior(target)
        model, delay = target.axis.model, target.axis.model.linear.delay_samples
        u = np.concatenate(
            [np.r_[np.zeros(delay), record.u[: len(record) - delay]] for record in target.records]
        )
        y = np.concatenate([record.y for record in target.records])
        first = np.concatenate([np.arange(len(record)) == 0 for record in target.records])
        real = np.sort(naive.fixed.real)
        priors = np.array([_normal_prior(p) for p in target.parameters])
        scale = float(target.parameters[HALF_WIDTH].prior.scale)  # type: ignore[attr-defined]
        tables = (
            np.array([straight.lower.first, straight.lower.step]),
            straight.lower.values,
            np.array([straight.upper.first, straight.upper.step]),
            straight.upper.values,
            straight.mean_command,
        )
        shape = (real, model.linear.zeros.astype(np.complex128), naive.n_modes, naive.rate)
        return (u, y, first, *shape, priors, scale, *tables)


def _normal_prior(parameter: Any) -> tuple[float, float]:
    prior = parameter.prior
    if hasattr(prior, "median"):
        return float(np.log(abs(prior.median))), float(prior.log_sd)
    return 0.0, np.inf


@njit(cache=True, nogil=True)
def _from_table(grid, values, wanted):  # type: ignore[no-untyped-def]
    low, high = 0, len(values) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if values[middle] <= wanted:
            low = middle
        else:
            high = middle
    slope = grid[1] / (values[low + 1] - values[low])
    return grid[0] + grid[1] * low + (wanted - values[low]) * slope, slope


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def log_posterior_and_gradient(  # type: ignore[no-untyped-def]
    q,
    u,
    y,
    first,
    real,
    zeros,
    n_modes,
    rate,
    priors,
    half_width_scale,
    low_grid,
    low,
    high_grid,
    high,
    mean_u,
    grad,
):
    """Log-posterior at straight coordinates q (parameters,); fills grad with its gradient.

    dw / dlower and dw / dupper are G applied to indicators of saturation, dw / da of a mode's section is w
    filtered by 1 / A, and the rest follows by the chain rule.
    """
    d, n = len(q), len(u)
    gain = np.exp(q[GAIN])
    upper, upper_slope = _from_table(high_grid, high, q[UPPER])
    cut = max(-q[UPPER], 0.0) ** 1.5
    lower, lower_slope = _from_table(low_grid, low, q[LOWER] / gain - mean_u + cut)
    grad[:] = 0.0
    if upper <= 0 or lower >= 0:
        return -np.inf
    half_width = np.exp(q[HALF_WIDTH])
    poles = np.empty(len(real) + n_modes, dtype=np.complex128)
    for i in range(len(real)):
        poles[i] = real[i]
    for m in range(n_modes):
        frequency, damping = np.exp(q[FIRST_MODE + 2 * m]), np.exp(q[FIRST_MODE + 2 * m + 1])
        if damping >= 1:
            return -np.inf
        angle = 2 * np.pi * frequency / rate
        turned = angle * np.sqrt(1 - damping**2)
        poles[len(real) + m] = np.exp(-angle * damping) * (np.cos(turned) + 1j * np.sin(turned))
    residues = np.empty_like(poles)
    for i in range(len(poles)):
        above, below = gain + 0j, 1.0 + 0j
        for zero in zeros:
            above *= poles[i] - zero
        for j in range(len(poles)):
            if j != i:
                below *= poles[i] - poles[j]
            if j >= len(real):
                below *= poles[i] - np.conj(poles[j])
        residues[i] = above / below
    sigma, kappa = np.exp(q[d - 2]), np.tanh(q[d - 1])
    shrinkage = 1 - kappa * kappa
    variance = sigma * sigma * shrinkage
    x = np.zeros((len(real), 3))
    s_new, s_old = np.zeros((n_modes, 3)), np.zeros((n_modes, 3))
    f_new, f_old = np.zeros(n_modes), np.zeros(n_modes)
    w, v = np.zeros(3), np.zeros(3)
    slopes, previous = np.zeros(4 + 2 * n_modes), np.zeros(4 + 2 * n_modes)
    sums = np.zeros(4 + 2 * n_modes)
    e_before, squares, products = 0.0, 0.0, 0.0
    records = 0
    for k in range(n):
        if first[k]:
            records += 1
            x[:], s_new[:], s_old[:], f_new[:], f_old[:] = 0.0, 0.0, 0.0, 0.0, 0.0
        v[0] = min(max(u[k], lower), upper)
        v[1] = 1.0 if u[k] < lower else 0.0
        v[2] = 1.0 if u[k] > upper else 0.0
        w[:] = 0.0
        for i in range(len(real)):
            for c in range(3):
                w[c] += residues[i].real * x[i, c]
                x[i, c] = poles[i].real * x[i, c] + v[c]
        for m in range(n_modes):
            p, r = poles[len(real) + m], residues[len(real) + m]
            a1, a2 = 2 * p.real, p.real * p.real + p.imag * p.imag
            b1, b2 = 2 * r.real, -2 * (r.real * p.real + r.imag * p.imag)
            for c in range(3):
                w[c] += b1 * s_new[m, c] + b2 * s_old[m, c]
                newest = v[c] + a1 * s_new[m, c] - a2 * s_old[m, c]
                s_old[m, c] = s_new[m, c]
                s_new[m, c] = newest
        outside = 1.0 if abs(w[0]) > half_width else 0.0
        sign = 1.0 if w[0] > 0 else -1.0
        e = y[k] - outside * (w[0] - sign * half_width)
        slopes[LOWER], slopes[UPPER] = outside * w[1], outside * w[2]
        slopes[HALF_WIDTH] = -outside * sign
        slopes[GAIN] = outside * w[0]
        for m in range(n_modes):
            p = poles[len(real) + m]
            a1, a2 = 2 * p.real, p.real * p.real + p.imag * p.imag
            slopes[4 + 2 * m] = outside * f_new[m]
            slopes[5 + 2 * m] = -outside * f_old[m]
            newest = w[0] + a1 * f_new[m] - a2 * f_old[m]
            f_old[m] = f_new[m]
            f_new[m] = newest
        if first[k]:
            squares += shrinkage * e * e
            products += kappa * e * e
            for i in range(len(sums)):
                sums[i] += shrinkage * e * slopes[i]
        else:
            a = e - kappa * e_before
            squares += a * a
            products += a * e_before
            for i in range(len(sums)):
                sums[i] += a * (slopes[i] - kappa * previous[i])
        for i in range(len(sums)):
            previous[i] = slopes[i]
        e_before = e
    total = -0.5 * n * np.log(2 * np.pi * variance) + 0.5 * records * np.log(shrinkage)
    total -= 0.5 * squares / variance
    d_lower, d_upper = sums[LOWER] / variance, sums[UPPER] / variance
    grad[HALF_WIDTH] = sums[HALF_WIDTH] / variance * half_width
    grad[GAIN] = sums[GAIN] / variance
    for m in range(n_modes):
        p = poles[len(real) + m]
        frequency, damping = np.exp(q[FIRST_MODE + 2 * m]), np.exp(q[FIRST_MODE + 2 * m + 1])
        angle, root = 2 * np.pi * frequency / rate, np.sqrt(1 - damping**2)
        by_frequency = p * angle * (-damping + 1j * root)
        by_damping = p * angle * damping * (-1 - 1j * damping / root)
        for j, change in ((4 + 2 * m, by_frequency), (5 + 2 * m, by_damping)):
            a1 = 2 * change.real
            a2 = 2 * (p.real * change.real + p.imag * change.imag)
            grad[j] = (sums[4 + 2 * m] * a1 + sums[5 + 2 * m] * a2) / variance
    grad[d - 2] = -n + squares / variance
    grad[d - 1] = (n - records) * kappa + products / (sigma * sigma) - kappa * squares / variance
    total += np.log(upper_slope * lower_slope / gain)
    d_lower += -1 / lower
    d_upper += -1 / upper
    log_lower, log_upper = np.log(-lower), np.log(upper)
    z = (log_lower - priors[LOWER, 0]) / priors[LOWER, 1]
    total += -0.5 * z * z - log_lower
    d_lower += -z / priors[LOWER, 1] / lower
    z = (log_upper - priors[UPPER, 0]) / priors[UPPER, 1]
    total += -0.5 * z * z - log_upper
    d_upper += -z / priors[UPPER, 1] / upper
    grad[LOWER] = d_lower * lower_slope / gain
    grad[UPPER] = d_upper * upper_slope
    if q[UPPER] < 0:
        grad[UPPER] += d_lower * lower_slope * (-1.5) * np.sqrt(-q[UPPER])
    grad[GAIN] += -d_lower * lower_slope * q[LOWER] / gain - 1
    for i in range(GAIN, d - 1):
        z = (q[i] - priors[i, 0]) / priors[i, 1]
        total += -0.5 * z * z
        grad[i] += -z / priors[i, 1]
    z = half_width / half_width_scale
    total += -0.5 * z * z + q[HALF_WIDTH]
    grad[HALF_WIDTH] += -z * z + 1
    total += np.log(shrinkage)
    grad[d - 1] += -2 * kappa
    return total
