"""Densities of known moments for the tests of moves and sampler."""

from __future__ import annotations

import time

import numpy as np

from bayes_hw.arrays import FloatArray


class Target:
    """A vectorised log-density that counts its calls and can be made to stop or to be slow."""

    def __init__(self, dimension: int) -> None:
        self.names = tuple(f"x{i}" for i in range(dimension))
        self.non_finite = 0
        self.calls = 0
        self.interrupt_at: int | None = None
        self.delay_s = 0.0

    def __call__(self, x: FloatArray) -> FloatArray:
        self.calls += 1
        if self.calls == self.interrupt_at:
            raise KeyboardInterrupt
        if self.delay_s:
            time.sleep(self.delay_s)
        return self.log_density(x)

    def log_density(self, x: FloatArray) -> FloatArray:
        raise NotImplementedError


class Gaussian(Target):
    """A correlated normal distribution whose widths differ by a factor of ten."""

    def __init__(self, dimension: int) -> None:
        super().__init__(dimension)
        rng = np.random.default_rng(0)
        rotation, _ = np.linalg.qr(rng.standard_normal((dimension, dimension)))
        self.covariance = (rotation * np.logspace(-1, 1, dimension)) @ rotation.T
        self.mean = rng.standard_normal(dimension)
        self.precision = np.linalg.inv(self.covariance)

    def chi_square(self, x: FloatArray) -> FloatArray:
        centred = x - self.mean
        return np.einsum("...i,ij,...j->...", centred, self.precision, centred)

    def log_density(self, x: FloatArray) -> FloatArray:
        return -0.5 * self.chi_square(x)

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        return rng.multivariate_normal(self.mean, self.covariance, size=count)


class LogGamma(Target):
    """Independent logarithms of gamma variables of shape 2: skewed, with one thin and one thick tail."""

    SHAPE = 2.0

    def log_density(self, x: FloatArray) -> FloatArray:
        return np.sum(self.SHAPE * x - np.exp(np.minimum(x, 500)), axis=-1)

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        return np.log(rng.gamma(self.SHAPE, size=(count, len(self.names))))


class Banana(Target):
    """x0 ~ N(0, 1), x1 ~ N(x0^2, 0.5^2): means 0 and 1, variances 1 and 2.25, no correlation."""

    def __init__(self) -> None:
        super().__init__(2)

    def log_density(self, x: FloatArray) -> FloatArray:
        return -0.5 * x[:, 0] ** 2 - 0.5 * ((x[:, 1] - x[:, 0] ** 2) / 0.5) ** 2


class Ridges(Target):
    """Half the coordinates z_i ~ N(0, 1), the others ~ N(0.4 z_i z_next, 0.5^2), and x = mixing z, rotated:
    as many curved ridges, none along a coordinate of x."""

    def __init__(self, dimension: int) -> None:
        super().__init__(dimension)
        self.mixing = np.linalg.qr(np.random.default_rng(1).standard_normal((dimension, dimension)))[0]

    def straight(self, x: FloatArray) -> FloatArray:
        """Independent standard normal variables."""
        first, second = np.split(x @ self.mixing, 2, axis=-1)
        return np.concatenate([first, (second - 0.4 * first * np.roll(first, -1, axis=-1)) / 0.5], axis=-1)

    def log_density(self, x: FloatArray) -> FloatArray:
        return -0.5 * np.sum(self.straight(x) ** 2, axis=-1)

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        first, second = np.split(rng.standard_normal((count, len(self.names))), 2, axis=-1)
        second = 0.5 * second + 0.4 * first * np.roll(first, -1, axis=-1)
        return np.concatenate([first, second], axis=-1) @ self.mixing.T


class TwoModes(Target):
    """x0 is N(-3, 1) with weight 0.3 or N(3, 1) with weight 0.7; three more standard normal variables."""

    def __init__(self) -> None:
        super().__init__(4)

    def log_density(self, x: FloatArray) -> FloatArray:
        left, right = np.log(0.3) - 0.5 * (x[:, 0] + 3) ** 2, np.log(0.7) - 0.5 * (x[:, 0] - 3) ** 2
        return np.logaddexp(left, right) - 0.5 * np.sum(x[:, 1:] ** 2, axis=1)


class HalfSpace(Gaussian):
    """A Gaussian cut at x0 > mean: -inf on one side."""

    def log_density(self, x: FloatArray) -> FloatArray:
        return np.where(x[:, 0] > self.mean[0], super().log_density(x), -np.inf)
