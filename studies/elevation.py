"""An elevation axis under gravity: its model, its records, and the gravity term estimated from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from twin import NOISE_CORRELATION, NOISE_SHARE, coloured_noise

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import estimate_noise
from bayes_hw.identify.output_error import simulated_outputs, whitened
from bayes_hw.infer.inference import axis_for
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.excitation import balancing_offset, sine_sweep
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

GRAVITY_DEG_PER_S = 0.02
"""Velocity that gravity adds to the command at the horizon."""

ELEVATIONS_DEG = (20.0, 50.0, 75.0)
"""Where the records start."""

OFFSET_SHARES = (0.4, 1.6, 0.4)
AMPLITUDE = 0.4
STOP_HZ = 5.0
START_PHASE_RAD = -np.pi / 4
ITERATIONS = 6
TRUE_VALUES = {
    "saturation.lower": -0.21,
    "saturation.upper": 0.27,
    "dead_zone.half_width": 0.004,
    "mode1.frequency_hz": 3.0,
    "mode1.damping_ratio": 0.035,
    "mode2.frequency_hz": 3.9,
    "mode2.damping_ratio": 0.03,
}


@dataclass(frozen=True)
class Gravity:
    """The estimate of the velocity that gravity adds at the horizon, and its standard deviation, deg/s."""

    value: float
    sd: float


def elevation_model(azimuth: HammersteinWiener) -> HammersteinWiener:
    """The elevation axis: limits, dead zone and modes of its own, the other roots of G the azimuth's."""
    axis = AxisParameters(azimuth, "conditional", output_scale=1.0)
    values = [TRUE_VALUES.get(p.name, p.nominal) for p in axis.parameters]
    return replace(axis.to_model(np.array(values)), name="elevation twin")


def elevation_records(
    truth: HammersteinWiener, rng: np.random.Generator, duration_s: float
) -> tuple[Record, ...]:
    """One sweep from each starting elevation; y is the angle since the start.

    Gravity follows the elevation as the axis moves: command and motion are iterated to agree.
    """
    rate = truth.sample_rate_hz
    sweep = sine_sweep(rate, duration_s, AMPLITUDE, 0.0, STOP_HZ, start_phase_rad=START_PHASE_RAD)
    balance = balancing_offset(sweep, truth.saturation)
    records = []
    for number, (elevation, share) in enumerate(zip(ELEVATIONS_DEG, OFFSET_SHARES, strict=True), start=1):
        u = sweep + share * balance
        y = np.zeros(len(u))
        for _ in range(ITERATIONS):
            y = truth.simulate(u + GRAVITY_DEG_PER_S * np.cos(np.deg2rad(elevation + y))).y
        noise = coloured_noise(rng, len(y), NOISE_SHARE * float(np.std(y)), NOISE_CORRELATION)
        times = np.arange(len(u)) / rate
        records.append(
            Record(f"elevation_{number}", times, u, y + noise, rate, truth.units, source="simulated")
        )
    return tuple(records)


def corrected(
    records: Sequence[Record], elevations_deg: Sequence[float], gravity_deg_per_s: float
) -> tuple[Record, ...]:
    """The records with gravity's share added to their commands, at the elevations measured."""
    return tuple(
        replace(record, u=record.u + gravity_deg_per_s * _cosine(record, elevation))
        for record, elevation in zip(records, elevations_deg, strict=True)
    )


def estimate_gravity(
    model: HammersteinWiener, records: Sequence[Record], elevations_deg: Sequence[float]
) -> Gravity:
    """Gravity and the dominant parameters together by least squares, whitened by the noise found first."""
    axis = axis_for(model, records, "conditional", "rest")
    start = np.append(as_coordinates(axis.parameters, axis.nominal), 0.0)
    autoregression = np.zeros(0)

    def parts(point: FloatArray) -> list[FloatArray]:
        moved = corrected(records, elevations_deg, float(point[-1]))
        outputs = simulated_outputs(axis, as_values(axis.parameters, point[:-1])[:, None], moved)
        return [record.y - output[0] for record, output in zip(records, outputs, strict=True)]

    def residual(point: FloatArray) -> FloatArray:
        return np.concatenate([whitened(part, autoregression) for part in parts(point)])

    for _ in range(2):
        found = least_squares(residual, start, x_scale="jac", max_nfev=60)
        start = np.asarray(found.x)
        noise = estimate_noise(parts(start))
        autoregression = noise.autoregression
    found = least_squares(residual, start, x_scale="jac", max_nfev=60)
    covariance = np.linalg.inv(found.jac.T @ found.jac) * 2 * found.cost / len(found.fun)
    return Gravity(float(found.x[-1]), float(np.sqrt(covariance[-1, -1])))


def _cosine(record: Record, elevation_deg: float) -> FloatArray:
    return np.asarray(np.cos(np.deg2rad(elevation_deg + record.y)))
