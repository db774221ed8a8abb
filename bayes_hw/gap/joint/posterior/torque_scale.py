"""An effect's torque as the acceleration that it gives the axis, from the ports alone.

Below its first mode an axis turns as one inertia J, and a velocity loop holds it: a torque moves the angle by
P = S / (J s^2), the command by G = g T / s with S + T = 1, g the velocity gain. So 1 / J = P s^2 / (1 - T),
whatever the loop is: no inertia need be known to state a torque as the acceleration of the whole axis, seen
at the encoder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.response.effect_paths import drive_response, port_response
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.cascade import Structure

BAND = (0.1, 0.45)
"""Where it is read, as shares of the first mode's frequency (or of a quarter of the rate)."""

POINTS = 24
MOST_SPREAD = 3.0
"""Upper over lower quartile within the band beyond which the axis is no single inertia there."""


def acceleration_of_unit(
    structure: Structure, values: JointValues, effect: Effect, rate_hz: float
) -> float | None:
    """Acceleration, output units/s^2, that one unit of the effect's law gives the whole axis.

    None where G has no integrator or the band does not look like one inertia.
    """
    if not structure.integrator:
        return None
    low, middle, high = np.quantile(_inverse_inertia(structure, values, effect, rate_hz), [0.25, 0.5, 0.75])
    return float(middle) if np.isfinite(high) and high < MOST_SPREAD * low else None


def acceleration_draws(
    structure: Structure, drawn: Sequence[JointValues], number: int, rate_hz: float
) -> FloatArray:
    """The same of effect `number` of every draw, (draws,), however its band looks."""
    return np.array(
        [float(np.median(_inverse_inertia(structure, v, v.effects[number], rate_hz))) for v in drawn]
    )


def _inverse_inertia(structure: Structure, values: JointValues, effect: Effect, rate_hz: float) -> FloatArray:
    """|P s^2 / (1 - T)| at the frequencies of BAND."""
    c = values.cascade
    frequencies = [
        rate_hz * float(np.angle(complex(a1 / 2, np.sqrt(a2 - a1 * a1 / 4)))) / (2 * np.pi)
        for a1, a2 in c.sections[:2].T
        if a2 > a1 * a1 / 4
    ]
    first = min([f for f in frequencies if f > 0], default=rate_hz / 4)
    f = first * np.geomspace(*BAND, POINTS)
    z = np.exp(2j * np.pi * f / rate_hz)
    closed = drive_response(structure, values, z) * (z - 1) / c.integrator_residue
    path = port_response(values, effect, z) * 2 * (z - 1) ** 2 / (z + 1) * rate_hz**2
    return np.abs(path / (1 - closed))
