"""Scalar parameters: names, units, priors and transforms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
