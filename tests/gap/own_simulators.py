"""Simulators of three kinds, and records of axes that have something more than they."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.simulator import FunctionSimulator
from bayes_hw.gap.simulate.rigid_axis import PositionController, RigidAxis
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Normal
from bayes_hw.record import Record, Units

RATE = 20.0


def motor_speed(values: FloatArray, inputs: FloatArray) -> FloatArray:
    """A user's own function: first-order systems with gain and time constant, (batch, samples)."""
    gain, time = values.T
    decay = np.exp(-1 / (RATE * time))
    return np.array(
        [lfilter([0.0, g * (1 - d)], [1.0, -d], inputs) for g, d in zip(gain, decay, strict=True)]
    )


def motor(noise_sigma: float = float("nan")) -> FunctionSimulator:
    return FunctionSimulator(
        "motor",
        motor_speed,
        (
            Parameter("speed_per_volt", "rpm/V", 30.0, LogNormal(30.0, 0.2), Logarithm()),
            Parameter("time_constant", "s", 0.3, LogNormal(0.3, 0.5), Logarithm()),
        ),
        RATE,
        Units(input="V", output="rpm"),
        noise_sigma,
    )


def travelled(values: FloatArray, inputs: FloatArray) -> FloatArray:
    """A user's own function: ideal integrators from a start, (batch, samples)."""
    return values[:, :1] + values[:, 1:] * np.concatenate([[0.0], np.cumsum(inputs)[:-1]]) / RATE


def integrator() -> FunctionSimulator:
    return FunctionSimulator(
        "integrator",
        travelled,
        (
            Parameter("start", "deg", 0.0, Normal(0.0, 0.1), Identity()),
            Parameter("ratio", "", 1.0, LogNormal(1.0, 0.05), Logarithm()),
        ),
        RATE,
    )


LOOP = PositionController(20.0, 30.0, 50.0, 500.0)
AXIS_RATE = 50.0
MASS, FORCE_GAIN = 10.0, 12.0


def rigid_axis(controller: PositionController | None = LOOP) -> RigidAxis:
    return RigidAxis(
        "axis",
        9.5,
        FORCE_GAIN,
        AXIS_RATE,
        0.01,
        controller,
        units=Units(input="m", output="m"),
    )


def rubbing_axis(reference: FloatArray, coulomb: float, forwards: float, backwards: float) -> FloatArray:
    """Position (samples,) of a mass with friction in N, N s/m and N s/m under the loop, written out anew.

    Ten steps of the controller a sample, each cut in ten for the motion, explicit.
    """
    steps = int(LOOP.rate_hz / AXIS_RATE)
    h = 1 / LOOP.rate_hz
    x, v, before = 0.0, 0.0, 0.0
    found = np.empty(len(reference))
    after = np.append(reference[1:], reference[-1])
    for k in range(len(reference)):
        found[k] = x
        for j in range(steps):
            wanted = reference[k] + (after[k] - reference[k]) * j / steps
            u = LOOP.velocity_gain * (LOOP.proportional * (wanted - x) - (x - before) / h)
            before = x
            for _ in range(10):
                viscous = forwards if v > 0 else backwards
                pushed = FORCE_GAIN * u - viscous * v
                moved = v + 0.1 * h * pushed / MASS
                stopped = 0.1 * h * coulomb / MASS
                v = 0.0 if abs(moved) <= stopped else moved - np.sign(moved) * stopped
                x += 0.1 * h * v
    return found


def steps(samples: int, seed: int, largest: float, length: int = 20) -> FloatArray:
    """A command that jumps to a new level every `length` samples."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-largest, largest, -(-samples // length)), length)[:samples]


def sweep(samples: int, seed: int) -> FloatArray:
    """A smooth reference that goes back and forth at several speeds, from rest at zero."""
    t = np.arange(samples) / AXIS_RATE
    rng = np.random.default_rng(seed)
    waves = [
        a * (1 - np.cos(2 * np.pi * f * t))
        for a, f in zip((0.1, 0.03), rng.uniform(0.1, 0.6, 2), strict=True)
    ]
    return np.asarray(sum(waves))


def record(name: str, u: FloatArray, y: FloatArray, rate: float, units: Units | None = None) -> Record:
    return Record(name, np.arange(len(u)) / rate, u, y, rate, units or Units())
