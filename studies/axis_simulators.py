"""Three simulators that are no Hammerstein-Wiener models, and the measured records held against them.

Each can be diagnosed from the command line as well, as `--simulator axis_simulators:dc_motor` with this
folder on PYTHONPATH.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.simulator import FunctionSimulator
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.simulate.rigid_axis import PositionController, RigidAxis
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Normal
from bayes_hw.record import Columns, Record, Units

EMPS_STEP = 4
EMPS_CONTROLLER = PositionController(160.18, 243.45, 10.0, 1000.0)
EMPS_FORCE_PER_VOLT = 35.15065188248547
"""Gains of the position loop (1/s, V s/m) and of the drive (N/V), the limit in V: given with the record."""

MOTOR_RATE = 100.0
MOUNT_RATE = 20.0


def emps() -> RigidAxis:
    """The EMPS as a frictionless mass of some 100 kg under its own position controller."""
    return RigidAxis(
        "EMPS, a frictionless rigid axis in closed loop",
        mass=100.0,
        force_gain=EMPS_FORCE_PER_VOLT,
        sample_rate_hz=1000.0 / EMPS_STEP,
        start_speed=0.05,
        controller=EMPS_CONTROLLER,
        units=Units(input="m", output="m"),
    )


def emps_case(path: Path, share: float = 0.6) -> SimulatorCase:
    """Reference and measured position, every fourth sample; the first `share` of the record to train on."""
    whole = Record.read(path, columns=Columns("t", "qg", "qm"), units=Units(input="m", output="m"))
    t = np.arange(len(whole))[::EMPS_STEP] / 1000.0
    kept = f"every {EMPS_STEP}th sample kept"
    record = replace(
        whole,
        t=t,
        u=whole.u[::EMPS_STEP],
        y=whole.y[::EMPS_STEP],
        sample_rate_hz=1000.0 / EMPS_STEP,
        treatment=(*whole.treatment, kept),
    )
    train, held = record.split(share)
    return SimulatorCase.of_records(emps(), [train], [held], [train.u])


def first_order(values: FloatArray, inputs: FloatArray) -> FloatArray:
    """time y' = speed u(t - delay) - y, exact for a command held over every sample, from rest."""
    outputs = np.empty((len(values), len(inputs)))
    for row, (speed, time, delay) in enumerate(values):
        samples = delay * MOTOR_RATE
        whole = int(samples)
        padded = np.concatenate([np.zeros(whole + 1), inputs])[: len(inputs) + 1]
        delayed = (1 - samples + whole) * padded[1:] + (samples - whole) * padded[:-1]
        decay = np.exp(-1 / (MOTOR_RATE * time))
        outputs[row] = lfilter([0.0, speed * (1 - decay)], [1.0, -decay], delayed)
    return outputs


def dc_motor() -> FunctionSimulator:
    """A DC motor as a first-order system with delay, volts in, revolutions per minute out."""
    return FunctionSimulator(
        "DC motor, first order",
        first_order,
        (
            Parameter("speed_per_volt", "rpm/V", 27.0, LogNormal(27.0, 0.3), Logarithm()),
            Parameter("time_constant", "s", 0.3, LogNormal(0.3, 0.5), Logarithm()),
            Parameter("delay", "s", 0.03, LogNormal(0.03, 0.5), Logarithm()),
        ),
        MOTOR_RATE,
        Units(input="V", output="rpm"),
    )


def dc_motor_record(path: Path) -> Record:
    """The whole staircase."""
    return Record.read(path, columns=Columns("time", "voltage", "rpm"), units=Units(input="V", output="rpm"))


def dc_motor_case(path: Path) -> SimulatorCase:
    """Steps up to 6 V of both signs to train on, those of 8 V and more held out."""
    whole = dc_motor_record(path)
    up, down = whole.window(0.0, 42.0), whole.window(49.5, 60.0)
    high, low = whole.window(42.0, 48.0), whole.window(60.0, 66.0)
    return SimulatorCase.of_records(dc_motor(), [up, down], [high, low], [up.u, down.u])


def dc_motor_other_cases(path: Path) -> dict[str, SimulatorCase]:
    """The same record parted otherwise."""
    whole = dc_motor_record(path)
    up, down, most, last = (whole.window(*s) for s in ((0, 48), (49.5, 66), (49.5, 63), (63, 66)))
    return {
        "forward half to train on, backward half held out": SimulatorCase.of_records(
            dc_motor(), [up], [down]
        ),
        "backward half to train on, forward half held out": SimulatorCase.of_records(
            dc_motor(), [down], [up]
        ),
        "the last 3 s held out": SimulatorCase.of_records(dc_motor(), [up, most], [last], [most.u]),
    }


def integrate(values: FloatArray, inputs: FloatArray) -> FloatArray:
    """start + gain times the sum of the commands so far."""
    travelled = np.concatenate([[0.0], np.cumsum(inputs)[:-1]]) / MOUNT_RATE
    return values[:, :1] + values[:, 1:] * travelled


def mount() -> FunctionSimulator:
    """A telescope mount as an ideal integrator of its velocity command."""
    return FunctionSimulator(
        "Rubin mount, an ideal integrator",
        integrate,
        (
            Parameter("start.position", "deg", -28.73, Normal(-28.73, 0.01), Identity()),
            Parameter("gain_to_position", "", 1.0, LogNormal(1.0, 0.05), Logarithm()),
        ),
        MOUNT_RATE,
    )


def mount_case(path: Path, share: float = 0.6) -> SimulatorCase:
    """Azimuth under its velocity command; the first `share` of the record to train on."""
    whole = Record.read(
        path,
        columns=Columns("timestamp", "demandVelocity", "actualPosition"),
        resample_hz=MOUNT_RATE,
    )
    train, held = whole.split(share)
    return SimulatorCase.of_records(mount(), [train], [held], [train.u])
