"""Scalar parameters: names, units, priors and transforms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray
from bayes_hw.model.priors import Prior, Transform


@dataclass(frozen=True)
class Parameter:
    """One scalar parameter; `nominal` is its value in the model that the prior is centred on."""

    name: str
    unit: str
    nominal: float
    prior: Prior
    transform: Transform

    @property
    def coordinate_sd(self) -> float:
        """Standard deviation of the coordinate under the prior, where it is normal; else half of what lies
        between the coordinates at one standard deviation of a normal to either side of the prior's median."""
        normal = self.transform.normal_of(self.prior)
        if normal is not None:
            return normal[1]
        either_side = self.prior.quantile(special.ndtr(np.array([-1.0, 1.0])))
        below, above = np.sort(self.transform.to_coordinate(either_side))
        return float(above - below) / 2


def as_coordinates(parameters: tuple[Parameter, ...], values: FloatArray) -> FloatArray:
    """Values of shape (parameters, ...) in unbounded coordinates."""
    return np.stack([p.transform.to_coordinate(v) for p, v in zip(parameters, values, strict=True)])


def as_values(parameters: tuple[Parameter, ...], coordinates: FloatArray) -> FloatArray:
    """Coordinates of shape (parameters, ...) as parameter values."""
    return np.stack([p.transform.to_value(q) for p, q in zip(parameters, coordinates, strict=True)])


def log_prior(parameters: tuple[Parameter, ...], coordinates: FloatArray) -> FloatArray:
    """Log-density of the prior in coordinates (Jacobian included), shape of one coordinate."""
    total = np.zeros_like(coordinates[0])
    for parameter, coordinate in zip(parameters, coordinates, strict=True):
        value = parameter.transform.to_value(coordinate)
        total = total + parameter.prior.log_density(value)
        total = total + parameter.transform.log_jacobian(coordinate)
    return total


class ParameterVector:
    """`as_values` and `log_prior` of one tuple of parameters, many walkers in few calls.

    Log-normal parameters are normal in their logarithms and normal ones in themselves: those rows share one
    sum of squares, and all logarithms share one exponential.
    """

    def __init__(self, parameters: tuple[Parameter, ...]) -> None:
        self.parameters = parameters
        signs = [p.transform.exponential for p in parameters]
        self._logarithms = np.flatnonzero(signs)
        self._negative = [i for i, sign in enumerate(signs) if sign < 0]
        self._no_logarithms = [i for i, sign in enumerate(signs) if sign == 0]
        coordinates = [p.transform.normal_of(p.prior) for p in parameters]
        normal = {i: found for i, found in enumerate(coordinates) if found is not None}
        self._normal = np.array(list(normal), dtype=int)
        self._mean = np.array([mean for mean, _ in normal.values()]).reshape(-1, 1)
        self._precision = np.array([1 / sd for _, sd in normal.values()]).reshape(-1, 1)
        self._constant = float(np.sum(np.log(self._precision)) - 0.5 * len(normal) * np.log(2 * np.pi))
        self._others = [i for i in range(len(parameters)) if i not in normal]

    def values(self, coordinates: FloatArray) -> FloatArray:
        """Values of coordinates, both (parameters, walkers)."""
        values = np.empty_like(coordinates)
        values[self._logarithms] = np.exp(coordinates[self._logarithms])
        for i in self._negative:
            np.negative(values[i], out=values[i])
        for i in self._no_logarithms:
            values[i] = self.parameters[i].transform.to_value(coordinates[i])
        return values

    def log_prior(self, coordinates: FloatArray, values: FloatArray) -> FloatArray:
        """Log-density of the prior (walkers,) in coordinates, Jacobian included, given their values."""
        standard = (coordinates[self._normal] - self._mean) * self._precision
        total = np.einsum("ij,ij->j", standard, standard)
        total *= -0.5
        total += self._constant
        for i in self._others:
            parameter = self.parameters[i]
            total += parameter.prior.log_density(values[i])
            total += parameter.transform.log_jacobian(coordinates[i])
        return total
