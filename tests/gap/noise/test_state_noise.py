"""The Kalman filter of noise with a state against the multivariate normal density of the same noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import LOAD_TORQUE, MOTOR_TORQUE, RATE, TRAIN, W
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.stats import multivariate_normal

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.state_noise import StateNoise, View, torque_noise, walking_noise
from bayes_hw.gap.simulate.path import Path, ordered

N = 60
SIGMA, CORRELATION = 0.4, 0.6


def encoder_covariance() -> FloatArray:
    lag = np.abs(np.subtract.outer(np.arange(N), np.arange(N)))
    return np.asarray(SIGMA**2 * CORRELATION**lag)


def check(noise: StateNoise, covariance: FloatArray) -> None:
    e = np.random.default_rng(1).multivariate_normal(np.zeros(N), covariance, size=2)
    expected = sum(multivariate_normal(np.zeros(N), covariance).logpdf(row) for row in e)
    assert noise.fitted_to(list(e)).log_likelihood == pytest.approx(expected, rel=1e-7)
    many = np.random.default_rng(2).multivariate_normal(np.zeros(N), covariance, size=4000).T
    white = noise.whiten(many, 0)
    assert np.abs(np.cov(white) - np.eye(N)).max() < 6 / np.sqrt(4000)


def test_a_random_walk_from_zero() -> None:
    steps = np.minimum.outer(np.arange(N), np.arange(N)) * 0.05**2
    check(walking_noise(SIGMA, CORRELATION, 0.05), encoder_covariance() + steps)


def test_a_walk_that_does_not_always_show() -> None:
    """Hidden for two stretches, shown in part at their ends, and of doubtful size there."""
    share = np.ones(N)
    share[10:20] = share[33:36] = 0.0
    share[[9, 20, 36]] = 0.4, 0.7, 0.2
    doubt = np.zeros(N)
    doubt[[10, 20, 33]] = 0.3, 0.2, 0.05
    walk = np.minimum.outer(np.arange(N), np.arange(N)) * 0.05**2
    shown = np.outer(share, share) * walk
    noise = replace(walking_noise(SIGMA, CORRELATION, 0.05), views=(View(share, doubt),) * 2)
    check(noise, encoder_covariance() + shown + np.diag(doubt))


def test_a_walk_of_changing_strength() -> None:
    """Increments of 4 and of a ninth of the variance for some samples; the encoder's own noise stays."""
    strength = np.ones(N)
    strength[12:20], strength[40:44] = 4.0, 1 / 9
    passed = np.concatenate([[0.0], np.cumsum(strength)[:-1]])
    walk = np.minimum.outer(passed, passed) * 0.05**2
    view = View(np.ones(N), np.zeros(N), strength)
    noise = replace(walking_noise(SIGMA, CORRELATION, 0.05), views=(view,) * 2)
    check(noise, encoder_covariance() + walk)


def test_samples_without_a_reading_say_nothing() -> None:
    """The likelihood is that of the others, whatever stands there; they are whitened to zero."""
    doubt = np.zeros(N)
    doubt[[5, 6, 30, N - 1]] = np.inf
    kept = np.isfinite(doubt)
    walk = np.minimum.outer(np.arange(N), np.arange(N)) * 0.05**2
    covariance = walk + encoder_covariance()
    e = np.random.default_rng(4).multivariate_normal(np.zeros(N), covariance)
    expected = multivariate_normal(np.zeros(kept.sum()), covariance[np.ix_(kept, kept)]).logpdf(e[kept])
    noise = replace(walking_noise(SIGMA, CORRELATION, 0.05), views=(View(np.ones(N), doubt),))
    spoilt = np.where(kept, e, 1e6)
    assert noise.fitted_to([spoilt]).log_likelihood == pytest.approx(float(expected), rel=1e-7)
    white = noise.whiten(spoilt[:, None], 0)[:, 0]
    assert not white[~kept].any() and np.abs(white).max() < 6


@pytest.mark.parametrize("states", [2, 7, 17, 33])
def test_any_number_of_states(states: int) -> None:
    """Also more than there are lanes in a row: against the covariance that the states' own equations give."""
    rng = np.random.default_rng(states)
    transition = np.diag(rng.uniform(0.5, 0.99, states)) + np.diag(rng.uniform(-0.02, 0.02, states - 1), 1)
    transition[-1, :-1] = transition[:-1, -1] = 0.0
    root, output = 0.2 * rng.normal(size=(states, states)), rng.normal(size=states)
    root[-1, :-1] = root[:-1, -1] = 0.0
    increment, variance = root @ root.T, np.eye(states)
    noise = StateNoise(transition, output, increment, variance, 1.0)
    covariance = np.zeros((N, N))
    for k in range(N):
        column = variance @ output
        for later in range(k, N):
            covariance[k, later] = covariance[later, k] = output @ column
            column = transition @ column
        variance = transition @ variance @ transition.T + increment
    check(noise, covariance)


def test_what_is_expected_of_a_walk() -> None:
    """Mean and variance of the walk given the residuals before, by the joint normal distribution."""
    noise = walking_noise(SIGMA, CORRELATION, 0.3)
    walk = np.minimum.outer(np.arange(N), np.arange(N)) * 0.3**2
    covariance = walk + encoder_covariance()
    e = np.random.default_rng(6).multivariate_normal(np.zeros(N), covariance)
    mean, variance = noise.expected(e, 0)
    weights = [np.linalg.solve(covariance[:k, :k], walk[:k, k]) for k in range(N)]
    np.testing.assert_allclose(mean, [w @ e[:k] for k, w in enumerate(weights)], atol=1e-6)
    np.testing.assert_allclose(
        variance, [walk[k, k] - w @ walk[:k, k] for k, w in enumerate(weights)], atol=1e-6
    )


def test_a_torque_through_the_drive_train() -> None:
    """Covariance of w by the state space of the drive train with the torque's two states beside it."""
    slow, fast, sd = 2 * np.pi * 0.3, 2 * np.pi * 1.1, 40.0
    a, b, c = TRAIN.state_space()
    n = len(a)
    motion = np.zeros((n + 2, n + 2))
    motion[:n, :n], motion[:n, n + 1] = a, b[:, LOAD_TORQUE]
    motion[n, n], motion[n + 1, n], motion[n + 1, n + 1] = -slow, fast, -fast
    drive = np.zeros((n + 2, n + 2))
    drive[n, n] = 2 * slow * sd**2
    start = np.zeros((n + 2, n + 2))
    start[n:, n:] = solve_continuous_lyapunov(motion[n:, n:], -drive[n:, n:])
    output = np.concatenate([c[W], np.zeros(2)])
    steps = 100
    h = 1 / RATE / steps
    step, half = expm(motion * h), expm(motion * h / 2)
    added = (drive + 4 * half @ drive @ half.T + step @ drive @ step.T) * h / 6
    variance, whole = start, np.linalg.matrix_power(step, steps)
    covariance = np.zeros((N, N))
    for k in range(N):
        column = variance @ output
        for later in range(k, N):
            covariance[k, later] = covariance[later, k] = output @ column
            column = whole @ column
        for _ in range(steps):
            variance = step @ variance @ step.T + added
    poles, right = np.linalg.eig(a)
    gains = np.linalg.inv(right) @ b[:, [MOTOR_TORQUE, LOAD_TORQUE]]
    outputs = (c[[W]] @ right).repeat(4, axis=0)
    real, upper = np.abs(poles.imag) < 1e-9, poles.imag > 1e-9
    path = Path(*ordered(poles[real | upper], gains[real | upper].T, outputs[:, real | upper]))
    check(
        torque_noise(SIGMA, CORRELATION, sd, (0.3, 1.1), path, RATE),
        covariance + encoder_covariance(),
    )


def test_whitening_is_linear() -> None:
    noise, rng = walking_noise(SIGMA, CORRELATION, 0.05), np.random.default_rng(3)
    columns = rng.normal(size=(300, 2))
    both = noise.whiten(columns, 0)
    np.testing.assert_allclose(
        noise.whiten(columns @ np.array([[2.0], [-3.0]]), 0)[:, 0],
        2 * both[:, 0] - 3 * both[:, 1],
        atol=1e-12,
    )


def test_weaker_noise_keeps_the_encoder() -> None:
    """A tenth of the walk's variance, the encoder's own noise as it was; the whole is the same noise."""
    noise = walking_noise(0.01, 0.5, 0.003)
    weaker, expected = noise.weaker(0.1), walking_noise(0.01, 0.5, 0.003 * np.sqrt(0.1))
    np.testing.assert_allclose(weaker.increment, expected.increment)
    np.testing.assert_allclose(weaker.initial, expected.initial)
    np.testing.assert_array_equal(noise.weaker(1.0).increment, noise.increment)


def test_gains_that_are_kept_are_those_of_the_record_and_the_noise() -> None:
    """After other records, lengths and a weaker copy of the same noise, every answer is that of a new one."""

    def new() -> StateNoise:
        shares = np.ones(N), (np.arange(N) > 20).astype(np.float64)
        views = tuple(View(share, np.zeros(N)) for share in shares)
        return replace(walking_noise(SIGMA, CORRELATION, 0.3), views=views)

    columns = np.random.default_rng(8).normal(size=(N, 3))
    noise = new()
    for record in (0, 1, 0, 1):
        np.testing.assert_array_equal(noise.whiten(columns, record), new().whiten(columns, record))
    weaker = noise.weaker(0.1).whiten(columns, 1)
    np.testing.assert_array_equal(weaker, new().weaker(0.1).whiten(columns, 1))
    plain = walking_noise(SIGMA, CORRELATION, 0.3)
    whole = plain.whiten(columns, 0)
    np.testing.assert_array_equal(plain.whiten(columns[:40], 1), whole[:40])
