"""What is known of the base parameters of a given model.json before any record is seen."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, LogNormal

LIMIT_LOG_SD = 0.08
GAIN_LOG_SD = 0.07
FREQUENCY_LOG_SD = 0.035
DAMPING_LOG_SD = 0.4
DEAD_ZONE_LOG_SD = 0.7
"""How far a nominal model may be off; a third wider than stated for a given model.json."""

STATIC_SPREAD: FloatArray = np.array([0.12, 0.12, 0.7, 0.07])
STATIC_SPREAD.setflags(write=False)
"""Of starts about the nominal limits, dead zone and gain, in logarithms; the modes start as given."""


def base_parameters(axis: AxisParameters) -> tuple[Parameter, ...]:
    """The base parameters of FORMATS.md with priors for a nominal model."""
    spreads = [LIMIT_LOG_SD, LIMIT_LOG_SD, DEAD_ZONE_LOG_SD, GAIN_LOG_SD]
    found = []
    for row, parameter in enumerate(axis.parameters):
        spread = spreads[row] if row < len(spreads) else FREQUENCY_LOG_SD
        if parameter.name.endswith("damping_ratio"):
            spread = DAMPING_LOG_SD
        nominal = parameter.nominal
        prior = LogNormal(nominal, spread)
        found.append(
            Parameter(parameter.name, parameter.unit, nominal, prior, Logarithm(float(np.sign(nominal))))
        )
    return tuple(found)
