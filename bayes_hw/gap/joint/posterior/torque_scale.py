"""A torque on what turns with the encoder, as the acceleration that it gives, from the ports alone.

Let G = g T / s carry the command to the angle, g the velocity gain, and P a torque that acts where the
encoder sits. Below the first mode S = 1 - T is what the velocity loop lets through, and P s^2 = S / J of
any loop. J is the inertia of what turns with the encoder where the loop holds the motor much stiffer than
the gear holds the load, so that S is small; that of the whole axis where the loop does next to nothing, so
that S is near one; else between the two, and S tells about where. Records tell T up to a delay only, which
of it is the command's; so J and the delay are those at which S and J P s^2 agree best at most frequencies of
the band: at a few a pair of poles that all but cancels may stand.

What a torque at the motor moves behind a gear is told by the small difference of two large numbers, the twist
of the gear and the give of the loop, so that its acceleration is not told by these records at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.effect_paths import drive_response, port_response
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.cascade import Structure

BAND = (0.1, 0.45)
"""Where it is read, as shares of the first mode's frequency (or of a quarter of the rate)."""

POINTS = 24
DELAYS = np.linspace(-3.0, 3.0, 301)
"""Samples by which T may lead or lag beyond what G says."""

MOST_MISFIT = 0.3
"""Median size of S / (J P s^2) - 1 beyond which the axis is no single inertia there."""

LIGHT_DAMPING = 0.3
"""Damping ratio below which a pair of poles swings against the drive rather than being the loop's."""

SEEN = 0.05
"""Of the largest speed in which a light pair swings: one of less all but cancels, and is not the gear's."""

AT_ENCODER = (K.BASE_SPEED, K.BASE_POSITION)
"""What laws look at that act where the encoder sits."""

LET_THROUGH = (0.0, 0.1, 0.3, 0.7, 0.9)
"""Root mean square of S in the band, of which the next two are functions, linear in between."""

EXCESS = (0.0, 0.05, 0.55, 0.66, 0.72)
EXCESS_SD = (0.05, 0.06, 0.18, 0.31, 0.34)
"""Mean and standard deviation of the logarithm of J over the load's inertia: of drives of two and of three
masses with an inertia of the motor from 0.3 to 3 times the load's, any loop (docs/decisions/0098)."""


def acceleration_draws(
    structure: Structure,
    fitted: JointValues,
    drawn: Sequence[JointValues],
    number: int,
    rate_hz: float,
    rng: np.random.Generator,
) -> FloatArray | None:
    """Acceleration, output units/s^2, that one unit of the law of effect `number` gives, (draws,).

    None where the values that fit do not tell it, see `acceleration_of_unit`.
    """
    at_fit = acceleration_of_unit(structure, fitted, fitted.effects[number], rate_hz)
    if at_fit is None:
        return None
    fits = _inertia(structure, fitted, fitted.effects[number], rate_hz)
    found = [
        at_fit * fits.inertia / _inertia(structure, values, values.effects[number], rate_hz).inertia
        for values in drawn
    ]
    spread = fits.excess_sd if _light_modes(fitted, rate_hz) else 0.0
    return np.asarray(found * np.exp(spread * rng.standard_normal(len(found))))


def acceleration_of_unit(
    structure: Structure, values: JointValues, effect: Effect, rate_hz: float
) -> float | None:
    """Acceleration, output units/s^2, that one unit of the effect's law gives what turns with the encoder.

    None where G has no integrator, where the band does not look like one inertia, and where the law looks at
    a motor that a gear lets swing against the load.
    """
    if not structure.integrator or (effect.form.base not in AT_ENCODER and _light_modes(values, rate_hz)):
        return None
    found = _inertia(structure, values, effect, rate_hz)
    if found.misfit >= MOST_MISFIT:
        return None
    return float(np.exp(found.excess if _light_modes(values, rate_hz) else 0.0) / found.inertia)


def _light_modes(values: JointValues, rate_hz: float) -> list[float]:
    """Frequencies of the modes that swing and are seen in the speed after a step of the command, Hz."""
    a1, a2, b0, b1 = values.cascade.sections
    swings = a2 > a1 * a1 / 4
    z = (a1 / 2 + 1j * np.sqrt(np.where(swings, a2 - a1 * a1 / 4, 0.0)))[swings]
    poles = np.log(z)
    light = -poles.real < LIGHT_DAMPING * np.abs(poles)
    speed = np.abs(poles) * np.abs(b0[swings] * z + b1[swings]) / np.abs(z.imag)
    seen = speed > SEEN * np.max(speed, initial=0.0, where=light)
    return [float(f) for f in np.abs(poles[light & seen]) * rate_hz / (2 * np.pi)]


@dataclass(frozen=True)
class _Inertia:
    """J, in units of the law a unit of acceleration, by how much S and J P s^2 differ (relative), and the
    root mean square of S."""

    inertia: float
    misfit: float
    let_through: float

    @property
    def excess(self) -> float:
        """Mean logarithm of J over the inertia of what turns with the encoder, where a gear twists."""
        return float(np.interp(self.let_through, LET_THROUGH, EXCESS))

    @property
    def excess_sd(self) -> float:
        """Its standard deviation."""
        return float(np.interp(self.let_through, LET_THROUGH, EXCESS_SD))


def _inertia(structure: Structure, values: JointValues, effect: Effect, rate_hz: float) -> _Inertia:
    first = min((f for f in _light_modes(values, rate_hz) if f > 0), default=rate_hz / 4)
    f = first * np.geomspace(*BAND, POINTS)
    z = np.exp(2j * np.pi * f / rate_hz)
    closed = drive_response(structure, values, z) * (z - 1) / values.cascade.integrator_residue
    pushed = port_response(values, effect, z) * 2 * (z - 1) ** 2 / (z + 1) * rate_hz**2
    let_through = 1 - closed * z ** -DELAYS[:, None]
    ratio = let_through / pushed
    inertia = np.median(ratio.real, axis=1)
    misfit = np.median(np.abs(ratio / inertia[:, None] - 1), axis=1)
    best = int(np.argmin(misfit))
    return _Inertia(
        float(abs(inertia[best])),
        float(misfit[best]),
        float(np.sqrt(np.mean(np.abs(let_through[best]) ** 2))),
    )
