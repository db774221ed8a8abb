"""Short ways to write the parameters of effects."""

from __future__ import annotations

from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Normal


def positive(name: str, unit: str, median: float, log_sd: float = 2.0) -> Parameter:
    """A positive parameter whose size is known to a factor of exp(log_sd)."""
    return Parameter(name, unit, median, LogNormal(median, log_sd), Logarithm())


def signed(name: str, unit: str, sd: float) -> Parameter:
    """A parameter of either sign about zero."""
    return Parameter(name, unit, 0.0, Normal(0.0, sd), Identity())
