"""What the posterior says of the axis, in a controller designer's terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.loop import frequency_grid
from bayes_hw.control.zeros import Antiresonance, antiresonances, minimum_phase, zeros
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import INTERVAL_PROBABILITY, highest_density_interval

DELAY_SHARE = 0.25
"""The equivalent delay is read off at this share of the lowest resonance, or of half the sample rate."""


@dataclass(frozen=True)
class Quantity:
    """One number of the axis over the draws: `nominal` is that of the point estimate."""

    unit: str
    nominal: float
    mean: float
    sd: float
    hdi94: tuple[float, float]

    @classmethod
    def of(cls, draws: FloatArray, nominal: float, unit: str) -> Quantity:
        low, high = highest_density_interval(draws) if np.ptp(draws) > 0 else (draws[0], draws[0])
        return cls(unit, nominal, float(np.mean(draws)), float(np.std(draws)), (float(low), float(high)))


@dataclass(frozen=True, eq=False)
class PlantSummary:
    """Quantities by name, the response of G with its pointwise central 94 %, and its zeros.

    `draws` maps the same names to values (draws,). `transport_delay_samples` is the whole delay of the model
    with the excess of its poles over its zeros; sampling does not move it. `equivalent_delay_hz` is where the
    quantity "equivalent_delay" is read off. `magnitude_db` and `phase_deg` have shape (2, frequencies), and
    `nominal_response` is that of the point estimate. `unreached` are the limits, and speeds at them, that
    no command of the records reached: how far beyond they lie is prior.
    """

    quantities: Mapping[str, Quantity]
    draws: Mapping[str, FloatArray]
    transport_delay_samples: int
    equivalent_delay_hz: float
    frequency_hz: FloatArray
    nominal_response: FloatArray
    nominal_phase_deg: FloatArray
    magnitude_db: FloatArray
    phase_deg: FloatArray
    antiresonances: tuple[Antiresonance, ...]
    minimum_phase: float
    unreached: tuple[str, ...] = ()

    @property
    def modes(self) -> int:
        return sum(name.endswith(".frequency_hz") for name in self.quantities)

    def mode_draws(self, what: str) -> list[FloatArray]:
        """Draws of "frequency_hz" or "damping_ratio" of every mode."""
        return [self.draws[f"mode{i + 1}.{what}"] for i in range(self.modes)]


def plant_summary(
    posterior: Posterior, values: FloatArray, axis: AxisDraws, nominal: AxisDraws
) -> PlantSummary:
    """The summary over `values` (draws, parameters), of which `axis` holds the axes."""
    units = axis.units
    point = posterior.point_estimate
    named: dict[str, tuple[FloatArray, float, str]] = {
        "velocity_gain": (axis.velocity_gain(), float(nominal.velocity_gain()[0]), units.velocity_gain)
    }
    for name in ("saturation.lower", "saturation.upper", "dead_zone.half_width"):
        i = posterior.names.index(name)
        named[name] = (values[:, i], float(point[i]), posterior.parameters[i].unit)
    speed = np.array([axis.velocity_gain() * limit for limit in (axis.lower, axis.upper)])
    at_nominal = nominal.velocity_gain() * np.concatenate([nominal.lower, nominal.upper])
    for i, name in enumerate(("speed.lower", "speed.upper")):
        named[name] = (speed[i] * axis.gains[1], float(at_nominal[i]) * axis.gains[1], f"{units.output}/s")
    for i, name in enumerate(posterior.names):
        if name.startswith("mode") and name.endswith((".frequency_hz", ".damping_ratio")):
            named[name] = (values[:, i], float(point[i]), posterior.parameters[i].unit)
    lowest = [v[1] for k, v in named.items() if k.endswith(".frequency_hz")]
    at = DELAY_SHARE * (min(lowest) if lowest else axis.sample_rate_hz / 2)
    named["equivalent_delay"] = (axis.equivalent_delay(at), float(nominal.equivalent_delay(at)[0]), "s")
    frequency = frequency_grid(axis, axis.sample_rate_hz, 1e-3)
    response, centre = axis.response(frequency), nominal.response(frequency)[0]
    tails = [(1 - INTERVAL_PROBABILITY) / 2, (1 + INTERVAL_PROBABILITY) / 2]
    magnitude = 20 * np.log10(np.abs(response))
    centre_phase = np.unwrap(np.angle(centre))
    phase = centre_phase + np.angle(response / centre)
    linear = posterior.axis.model.linear
    return PlantSummary(
        quantities={name: Quantity.of(*entry) for name, entry in named.items()},
        draws={name: entry[0] for name, entry in named.items()},
        transport_delay_samples=linear.total_delay,
        equivalent_delay_hz=at,
        frequency_hz=frequency,
        nominal_response=20 * np.log10(np.abs(centre)),
        nominal_phase_deg=np.rad2deg(centre_phase),
        magnitude_db=np.quantile(magnitude, tails, axis=0),
        phase_deg=np.rad2deg(np.quantile(phase, tails, axis=0)),
        antiresonances=antiresonances(axis, nominal),
        minimum_phase=float(np.mean(minimum_phase(zeros(axis)))),
        unreached=tuple(
            name for limit in posterior.unreached for name in (limit, limit.replace("saturation", "speed"))
        ),
    )
