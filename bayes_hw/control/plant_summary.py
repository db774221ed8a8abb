"""What the posterior says of the axis, in a controller designer's terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.loop import frequency_grid
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import INTERVAL_PROBABILITY, highest_density_interval

LIGHT_DAMPING = 0.3
"""A zero pair less damped than this makes a dip in the response."""

LARGEST = 1e3
"""A zero of larger modulus is rounding error of one at infinity."""


@dataclass(frozen=True, eq=False)
class Antiresonance:
    """A zero pair of the nominal G and the pair nearest to it in every draw.

    `frequency_hz` and `damping_ratio` (draws,); a damping below zero means a zero outside the unit circle.
    """

    nominal_hz: float
    nominal_damping: float
    frequency_hz: FloatArray
    damping_ratio: FloatArray


def zeros(axis: AxisDraws) -> ComplexArray:
    """The zeros of every draw, (poles, draws), in order of modulus; infinite where there are fewer.

    With A = diag(p), B = 1, C = r and D the direct term: generalized eigenvalues of [A B; C D] and [I 0; 0 0]
    (Rosenbrock's pencil; Emami-Naeini and Van Dooren, doi 10.1016/0005-1098(82)90070-X).
    """
    poles, residues = axis.poles.T, axis.residues.T
    n = poles.shape[1]
    kept = np.eye(n + 1)
    kept[n, n] = 0
    found = np.empty((axis.count, n), dtype=np.complex128)
    for draw in range(axis.count):
        pencil = np.ones((n + 1, n + 1), dtype=np.complex128)
        pencil[:n, :n] = np.diag(poles[draw])
        scale = np.abs(residues[draw]).max()
        pencil[n, :n], pencil[n, n] = residues[draw] / scale, axis.direct[draw] / scale
        top, bottom = eig(pencil, kept, right=False, homogeneous_eigvals=True)
        finite = np.abs(bottom) * LARGEST > np.abs(top)
        roots = np.sort_complex(top[finite] / bottom[finite])
        found[draw] = np.inf
        found[draw, : len(roots)] = roots[np.argsort(np.abs(roots), kind="stable")]
    return found.T


def minimum_phase(found: ComplexArray) -> FloatArray:
    """1 for each draw whose finite zeros all lie inside the unit circle, else 0, (draws,)."""
    return np.asarray(np.all((np.abs(found) < 1) | np.isinf(found), axis=0), dtype=np.float64)


def antiresonances(axis: AxisDraws, nominal: AxisDraws) -> tuple[Antiresonance, ...]:
    """Every lightly damped zero pair of `nominal` below half the sample rate, in order of frequency."""
    rate = axis.sample_rate_hz
    reference = zeros(nominal)[:, 0]
    everywhere = zeros(axis)
    found = []
    for zero in reference[np.isfinite(reference) & (reference.imag > 1e-9)]:
        s = np.log(zero) * rate
        if abs(s.real) > LIGHT_DAMPING * abs(s):
            continue
        nearest = np.argmin(np.abs(everywhere - zero), axis=0)
        matched = np.log(everywhere[nearest, np.arange(axis.count)]) * rate
        size = np.abs(matched)
        found.append(
            Antiresonance(
                float(abs(s)) / (2 * np.pi),
                float(-s.real / abs(s)),
                size / (2 * np.pi),
                -matched.real / size,
            )
        )
    return tuple(sorted(found, key=lambda pair: pair.nominal_hz))


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
