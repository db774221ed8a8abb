"""Prior densities of single parameters, and the transforms to unbounded coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray

_LOG_SQRT_2PI = 0.5 * np.log(2 * np.pi)
ROUNDING, SMALLEST_MODULUS = 1e-15, 1e-100
"""Distance from the border at which a value still has a finite coordinate."""


Moments: TypeAlias = tuple[float, float] | None
"""Mean and standard deviation of what is normal; None where it is not."""


class Prior(Protocol):
    """A one-dimensional density; the value or the logarithm of its size may be normal."""

    @property
    def of_value(self) -> Moments: ...

    @property
    def of_logarithm(self) -> Moments: ...

    def log_density(self, value: FloatArray) -> FloatArray:
        """Natural logarithm of the density at every value, -inf outside the support."""
        ...

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Inverse of the distribution function."""
        ...

    def describe(self, unit: str) -> str:
        """The density in words, with its unit."""
        ...


class Density:
    """What is normal of most densities: neither value nor logarithm."""

    @property
    def of_value(self) -> Moments:
        return None

    @property
    def of_logarithm(self) -> Moments:
        return None


@dataclass(frozen=True)
class Normal(Density):
    """exp(-(x - mean)^2 / (2 sd^2)) / (sd sqrt(2 pi))."""

    mean: float
    sd: float

    @property
    def of_value(self) -> Moments:
        return self.mean, self.sd

    def log_density(self, value: FloatArray) -> FloatArray:
        standard = (value - self.mean) * (1 / self.sd)
        return -0.5 * standard * standard - (np.log(self.sd) + _LOG_SQRT_2PI)

    def quantile(self, probability: FloatArray) -> FloatArray:
        return self.mean + self.sd * np.asarray(special.ndtri(probability))

    def describe(self, unit: str) -> str:
        return f"normal, mean {self.mean:.4g}, sd {self.sd:.3g} {unit}".rstrip()


@dataclass(frozen=True)
class LogNormal(Density):
    """log |x| is normal about log |median| with standard deviation log_sd; x has the sign of `median`."""

    median: float
    log_sd: float

    @property
    def of_logarithm(self) -> Moments:
        return float(np.log(abs(self.median))), self.log_sd

    def log_density(self, value: FloatArray) -> FloatArray:
        ratio = np.asarray(value / self.median, dtype=np.float64)
        inside = ratio > 0
        safe = np.where(inside, ratio, 1.0)
        density = (
            -0.5 * (np.log(safe) / self.log_sd) ** 2
            - np.log(self.log_sd * safe * abs(self.median))
            - _LOG_SQRT_2PI
        )
        return np.where(inside, density, -np.inf)

    def quantile(self, probability: FloatArray) -> FloatArray:
        order = probability if self.median > 0 else 1 - np.asarray(probability)
        return self.median * np.exp(self.log_sd * np.asarray(special.ndtri(order)))

    def describe(self, unit: str) -> str:
        return (
            f"log-normal, median {self.median:.4g} {unit}".rstrip()
            + f", log sd {self.log_sd:.3g} (factor {np.exp(2 * self.log_sd):.3g} at 2 sd)"
        )


@dataclass(frozen=True)
class HalfNormal(Density):
    """2 exp(-x^2 / (2 scale^2)) / (scale sqrt(2 pi)) for x >= 0."""

    scale: float

    def log_density(self, value: FloatArray) -> FloatArray:
        value = np.asarray(value, dtype=np.float64)
        density = np.log(2) - 0.5 * (value / self.scale) ** 2 - np.log(self.scale) - _LOG_SQRT_2PI
        return np.where(value >= 0, density, -np.inf)

    def quantile(self, probability: FloatArray) -> FloatArray:
        return self.scale * np.asarray(special.ndtri(0.5 + 0.5 * np.asarray(probability)))

    def describe(self, unit: str) -> str:
        return f"half-normal, scale {self.scale:.4g} {unit}".rstrip()


@dataclass(frozen=True)
class Uniform(Density):
    """Constant between `lower` and `upper`."""

    lower: float
    upper: float

    def log_density(self, value: FloatArray) -> FloatArray:
        inside = (value >= self.lower) & (value <= self.upper)
        return np.where(inside, -np.log(self.upper - self.lower), -np.inf)

    def quantile(self, probability: FloatArray) -> FloatArray:
        return self.lower + (self.upper - self.lower) * np.asarray(probability)

    def describe(self, unit: str) -> str:
        return f"uniform between {self.lower:.4g} and {self.upper:.4g} {unit}".rstrip()


@dataclass(frozen=True)
class ShiftedLogNormal(Density):
    """x - lower is log-normal with the given median and standard deviation of its logarithm."""

    lower: float
    median: float
    log_sd: float

    def log_density(self, value: FloatArray) -> FloatArray:
        return LogNormal(self.median, self.log_sd).log_density(value - self.lower)

    def quantile(self, probability: FloatArray) -> FloatArray:
        return self.lower + LogNormal(self.median, self.log_sd).quantile(probability)

    def describe(self, unit: str) -> str:
        rest = LogNormal(self.median, self.log_sd).describe(unit)
        return f"{self.lower:.4g} plus {rest}"


@dataclass(frozen=True)
class TimeConstant(Density):
    """A pole p of the given `sign` whose time constant -1 / log |p| in samples is log-normal about `median`.

    A uniform density of p would hold a slow pole to be as unlikely as it is close to one; this one does not
    care how fast the record was sampled.
    """

    median: float
    log_sd: float
    sign: float = 1.0

    def log_density(self, value: FloatArray) -> FloatArray:
        size = self.sign * np.asarray(value)
        inside = (size > 0) & (size < 1)
        rate = -np.log(np.where(inside, size, 0.5))
        density = LogNormal(self.median, self.log_sd).log_density(1 / rate) - 2 * np.log(rate) + rate
        return np.where(inside, density, -np.inf)

    def quantile(self, probability: FloatArray) -> FloatArray:
        order = probability if self.sign > 0 else 1 - np.asarray(probability)
        return self.sign * np.exp(-1 / LogNormal(self.median, self.log_sd).quantile(order))

    def describe(self, unit: str) -> str:
        return f"its time constant in samples: {LogNormal(self.median, self.log_sd).describe(unit)}"


class Transform(Protocol):
    """A monotone map between a parameter's value and an unbounded coordinate."""

    @property
    def exponential(self) -> float:
        """The sign s of value = s exp(coordinate); zero for any other map."""
        ...

    def normal_of(self, prior: Prior) -> Moments:
        """Of the coordinate, where `prior` makes it normal."""
        ...

    def to_value(self, coordinate: FloatArray) -> FloatArray: ...

    def to_coordinate(self, value: FloatArray) -> FloatArray: ...

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        """log |d value / d coordinate|."""
        ...


class Map:
    """No exponential, and nothing normal."""

    @property
    def exponential(self) -> float:
        return 0.0

    def normal_of(self, prior: Prior) -> Moments:  # noqa: ARG002
        return None


@dataclass(frozen=True)
class Identity(Map):
    """value = coordinate."""

    def normal_of(self, prior: Prior) -> Moments:
        return prior.of_value

    def to_value(self, coordinate: FloatArray) -> FloatArray:
        return coordinate

    def to_coordinate(self, value: FloatArray) -> FloatArray:
        return value

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        return np.zeros_like(coordinate)


@dataclass(frozen=True)
class Logarithm(Map):
    """value = sign exp(coordinate), with `sign` +1 or -1."""

    sign: float = 1.0

    @property
    def exponential(self) -> float:
        return self.sign

    def normal_of(self, prior: Prior) -> Moments:
        return prior.of_logarithm if self.sign * prior.quantile(np.array(0.5)) > 0 else None

    def to_value(self, coordinate: FloatArray) -> FloatArray:
        return self.sign * np.exp(coordinate)

    def to_coordinate(self, value: FloatArray) -> FloatArray:
        return np.log(value / self.sign)

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        return coordinate


@dataclass(frozen=True)
class ShiftedLogarithm(Map):
    """value = lower + exp(coordinate)."""

    lower: float

    def to_value(self, coordinate: FloatArray) -> FloatArray:
        return self.lower + np.exp(coordinate)

    def to_coordinate(self, value: FloatArray) -> FloatArray:
        return np.log(value - self.lower)

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        return coordinate


@dataclass(frozen=True)
class HyperbolicTangent(Map):
    """value = tanh(coordinate), for values between -1 and 1."""

    def to_value(self, coordinate: FloatArray) -> FloatArray:
        return np.tanh(coordinate)

    def to_coordinate(self, value: FloatArray) -> FloatArray:
        return np.arctanh(value)

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        magnitude = np.abs(coordinate)
        return 2 * (np.log(2) - magnitude - np.log1p(np.exp(-2 * magnitude)))


@dataclass(frozen=True)
class NormalProbability(Map):
    """value = 2 Phi(coordinate) - 1, for values between -1 and 1.

    A uniform prior is a standard normal one of the coordinate; of an inverse tangent it has exponential
    tails, which a sampler crosses slowly.
    """

    def to_value(self, coordinate: FloatArray) -> FloatArray:
        return np.asarray(special.erf(coordinate / np.sqrt(2)))

    def to_coordinate(self, value: FloatArray) -> FloatArray:
        return np.sqrt(2) * np.asarray(special.erfinv(np.clip(value, ROUNDING - 1, 1 - ROUNDING)))

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        return 0.5 * np.log(2 / np.pi) - 0.5 * np.asarray(coordinate) ** 2


@dataclass(frozen=True)
class TimeConstantLogarithm(Map):
    """value = sign exp(-exp(-coordinate)), a pole of modulus between 0 and 1: the coordinate is the logarithm
    of its time constant in samples."""

    sign: float = 1.0

    def to_value(self, coordinate: FloatArray) -> FloatArray:
        return self.sign * np.exp(-np.exp(-np.asarray(coordinate)))

    def to_coordinate(self, value: FloatArray) -> FloatArray:
        size = np.clip(self.sign * np.asarray(value), SMALLEST_MODULUS, 1 - ROUNDING)
        return -np.log(-np.log(size))

    def log_jacobian(self, coordinate: FloatArray) -> FloatArray:
        return -np.exp(-coordinate) - coordinate
