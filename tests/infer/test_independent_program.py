"""The same posterior by a program that shares no code with this one: plain numpy, its own simulator, its own
likelihood and priors, random-walk Metropolis."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import autocorrelation_time
from bayes_hw.infer.inference import infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

CHAINS, STEPS, SAMPLES = 128, 1200, 150


class PlainPosterior:
    """log p of (log -lower, log upper, log half width, log gain, log f, log zeta, log sigma, atanh kappa) for
    an axis of an integrator and one mode, given one record: difference equation in the numerator's and
    denominator's coefficients, all chains in one array."""

    def __init__(self, model: HammersteinWiener, u: FloatArray, y: FloatArray, sigma: float) -> None:
        self.u, self.y = u, y
        self.delay = model.linear.delay_samples
        self.zeros = np.real(np.poly(model.linear.zeros))
        mode = model.dominant_modes[0]
        self.centres = np.log(
            [
                *(-model.saturation.lower, model.saturation.upper, 1.0, model.linear.gain),
                *(mode.frequency_hz, mode.damping_ratio, sigma),
            ]
        )
        self.widths = np.array([0.3, 0.3, np.inf, 0.3, 0.1, 0.8, 1.5])
        self.dead_zone_scale = 3 * model.dead_zone.half_width

    def __call__(self, q: FloatArray) -> FloatArray:
        lower, upper, half_width, gain, frequency, damping, sigma = np.exp(q[:, :7]).T
        kappa = np.tanh(q[:, 7])
        log_p = -0.5 * np.sum(((q[:, :7] - self.centres) / self.widths) ** 2, axis=1)
        log_p += q[:, 2] - 0.5 * (half_width / self.dead_zone_scale) ** 2 + np.log(1 - kappa**2)
        natural = 2 * np.pi * frequency / 20.0
        radius, angle = np.exp(-damping * natural), natural * np.sqrt(1 - np.minimum(damping, 0.999) ** 2)
        a1, a2 = -2 * radius * np.cos(angle), radius**2
        denominator = np.stack([np.ones_like(a1), a1 - 1, a2 - a1, -a2])
        first = 3 - (len(self.zeros) - 1)
        v = np.zeros((len(self.u) + 4, len(q)))
        w = np.zeros_like(v)
        shifted = np.r_[np.zeros(self.delay), self.u[: len(self.u) - self.delay]]
        e = np.empty((len(self.u), len(q)))
        for k, command in enumerate(shifted):
            now = k + 4
            v[now] = np.minimum(np.maximum(command, -lower), upper)
            for i, coefficient in enumerate(self.zeros):
                w[now] += gain * coefficient * v[now - first - i]
            for i in range(1, 4):
                w[now] -= denominator[i] * w[now - i]
            y = np.where(w[now] > half_width, w[now] - half_width, np.minimum(w[now] + half_width, 0.0))
            e[k] = self.y[k] - y
        variance = sigma**2 * (1 - kappa**2)
        squares = np.sum((e[1:] - kappa * e[:-1]) ** 2, axis=0) + (1 - kappa**2) * e[0] ** 2
        log_p += -0.5 * len(e) * np.log(variance) + 0.5 * np.log(1 - kappa**2) - 0.5 * squares / variance
        return np.where(np.isfinite(log_p) & (damping < 0.999), log_p, -np.inf)


def random_walk(
    density: PlainPosterior, start: FloatArray, factor: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Metropolis chains (steps, chains, parameters), the first third dropped."""
    x, log_p, kept = start, density(start), []
    for step in range(STEPS):
        proposed = x + 2.38 / np.sqrt(x.shape[1]) * rng.standard_normal(x.shape) @ factor.T
        log_q = density(proposed)
        taken = np.log(rng.random(len(x))) < log_q - log_p
        x, log_p = np.where(taken[:, None], proposed, x), np.where(taken, log_q, log_p)
        if step >= STEPS // 3:
            kept.append(x)
    return np.stack(kept)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:overflow encountered")
def test_marginals_agree_within_monte_carlo_error(small_axis: HammersteinWiener) -> None:
    """Mean and standard deviation of every coordinate within four standard errors of both programs, and
    quantiles as near as their own errors allow. Only the random walk's scale comes from the other program."""
    record = measured(small_axis, SAMPLES, seed=21)
    settings = SamplerSettings(walkers=128, max_steps=1500, target_ess=4000)
    inference = infer(small_axis, [record], np.random.default_rng(3), free="conditional", settings=settings)
    assert inference.posterior.converged and inference.posterior.noise_order == 1
    ours = inference.sampling.chain
    flat = ours.reshape(-1, 8)
    density = PlainPosterior(small_axis, record.u, record.y, inference.start.noise.sigma)
    rng = np.random.default_rng(4)
    start = flat.mean(axis=0) + 0.5 * flat.std(axis=0) * rng.standard_normal((CHAINS, 8))
    theirs = random_walk(density, start, np.linalg.cholesky(np.cov(flat.T)), rng)
    for i, name in enumerate(inference.posterior.names):
        a, b = ours[..., i], theirs[..., i]
        size_b = b.size / autocorrelation_time(b)
        for power in (1, 2):
            p, q = (a - b.mean()) ** power, (b - b.mean()) ** power
            error = np.sqrt(p.var() / inference.sampling.convergence.ess_bulk[i] + q.var() / size_b)
            assert abs(p.mean() - q.mean()) < 4 * error, (name, power, p.mean() - q.mean(), error)
        for level in (0.03, 0.5, 0.97):
            share = np.mean(b < np.quantile(a, level))
            error = np.sqrt(level * (1 - level) * (1 / size_b + 1 / 1000))
            assert abs(share - level) < 4.5 * error, (name, level, share)
