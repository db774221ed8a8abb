"""A motor of first order: the steady speed per volt and a time constant."""

import numpy as np
from scipy.signal import lfilter

from bayes_hw.gap.case.simulator import FunctionSimulator
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, LogNormal
from bayes_hw.record import Units

RATE = 20.0  # Hz


def speed(values, inputs):
    """Speeds (batch, samples) of parameter values (batch, parameters) under inputs (samples,)."""
    decays = np.exp(-1 / (RATE * values[:, 1]))
    rows = zip(values[:, 0], decays, strict=True)
    return np.array([lfilter([0, gain * (1 - d)], [1, -d], inputs) for gain, d in rows])


def simulator():
    """What is asked for on the command line: my_motor:simulator."""
    parameters = (
        Parameter("speed_per_volt", "rpm/V", 30.0, LogNormal(30.0, 0.2), Logarithm()),
        Parameter("time_constant", "s", 0.3, LogNormal(0.3, 0.5), Logarithm()),
    )
    return FunctionSimulator("motor", speed, parameters, RATE, Units(input="V", output="rpm"))
