"""Step, ramp and sidereal tracking of the whole nonlinear loop, over the draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.simulator import simulate_loop
from bayes_hw.infer.summary import INTERVAL_PROBABILITY

SIDEREAL_ARCSEC_PER_S = 15.041067
"""Mean rate of the sky: 360 degrees in 86164.0905 s."""

UNITS_PER_DEGREE = {
    "deg": 1.0,
    "rad": np.pi / 180,
    "mrad": 1e3 * np.pi / 180,
    "mdeg": 1e3,
    "arcmin": 60.0,
    "arcsec": 3600.0,
}
"""Output units in which the sidereal rate is known."""

STEP_SECONDS, RAMP_SHARE = 2.0, 0.5
"""Defaults: a step as long as the nominal axis moves in 2 s at the slower of its limits, a ramp at half of
that speed."""

DURATION_S = 60.0
RAMP_DURATION_S = 20.0
SETTLED_SHARE = 0.02
SETTLING_IN_S = 10.0
"""The first seconds of tracking that rms errors leave out."""


@dataclass(frozen=True)
class TestSignals:
    """What the loops are asked to follow: sizes in output units (per s); `sidereal_rate` None where the
    output is no angle in a known unit."""

    __test__ = False

    step: float
    ramp_rate: float
    sidereal_rate: float | None

    @classmethod
    def for_axis(cls, nominal: AxisDraws) -> TestSignals:
        """Sizes that suit the axis; see STEP_SECONDS."""
        speed = abs(float(nominal.velocity_gain()[0])) * min(
            -float(nominal.lower[0]), float(nominal.upper[0])
        )
        speed *= nominal.gains[1]
        per_degree = UNITS_PER_DEGREE.get(nominal.units.output)
        sidereal = None if per_degree is None else SIDEREAL_ARCSEC_PER_S / 3600 * per_degree
        return cls(STEP_SECONDS * speed, RAMP_SHARE * speed, sidereal)


@dataclass(frozen=True, eq=False)
class Response:
    """One test: what the output or the error does in time, and figures of merit of every draw.

    `t`, `reference`, `median`, `lower`, `upper`, `nominal` have shape (samples,); the last four are of the
    output (`shows` "output") or of the error r - y ("error"), lower and upper the central 94 % of the draws.
    `merits` maps a name to values (draws,), infinite where not reached, and `units` to their units.
    """

    name: str
    shows: str
    t: FloatArray
    reference: FloatArray
    median: FloatArray
    lower: FloatArray
    upper: FloatArray
    nominal: FloatArray
    merits: Mapping[str, FloatArray]
    units: Mapping[str, str]


def responses(
    axis: AxisDraws,
    nominal: AxisDraws,
    controller: Controller,
    signals: TestSignals,
    noise: FloatArray,
) -> tuple[Response, ...]:
    """The tests of one controller on every draw of `axis`; `nominal` is the point estimate.

    `noise` (draws, samples) is encoder noise of at least DURATION_S: the sidereal test also runs with it.
    """
    found = [
        _step(axis, nominal, controller, signals.step),
        _ramp(axis, nominal, controller, signals.ramp_rate),
    ]
    if signals.sidereal_rate is not None:
        found.append(_sidereal(axis, nominal, controller, signals.sidereal_rate, noise))
    return tuple(found)


def _step(axis: AxisDraws, nominal: AxisDraws, controller: Controller, size: float) -> Response:
    """From rest in the middle of the dead zone."""
    t = _time(axis, RAMP_DURATION_S)
    reference = np.where(t > 0, size, 0.0)
    y, at_nominal = (simulate_loop(a, controller, reference).y for a in (axis, nominal))
    error = np.abs(y - size)
    outside = error > SETTLED_SHARE * size
    last = len(t) - 1 - np.argmax(outside[:, ::-1], axis=1)
    settling = np.where(outside[:, -1], np.inf, np.where(outside.any(axis=1), t[last] + t[1], 0.0))
    later = t >= RAMP_DURATION_S / 2
    merits = {
        "overshoot": 100 * np.maximum(y.max(axis=1) / size - 1, 0),
        "settling time": settling,
        "rms error at the end": _rms(reference[later] - y[:, later]),
    }
    units = {"overshoot": "%", "settling time": "s", "rms error at the end": axis.units.output}
    return _banded("step", "output", t, reference, y, at_nominal[0], merits, units)


def _ramp(axis: AxisDraws, nominal: AxisDraws, controller: Controller, rate: float) -> Response:
    """From rest in the middle of the dead zone."""
    t = _time(axis, RAMP_DURATION_S)
    reference = rate * t
    error, at_nominal = (reference - simulate_loop(a, controller, reference).y for a in (axis, nominal))
    later = t >= RAMP_DURATION_S / 2
    merits = {"rms error": _rms(error[:, later]), "largest error": np.abs(error).max(axis=1)}
    units = dict.fromkeys(merits, axis.units.output)
    return _banded("ramp", "error", t, reference, error, at_nominal[0], merits, units)


def _sidereal(
    axis: AxisDraws, nominal: AxisDraws, controller: Controller, rate: float, noise: FloatArray
) -> Response:
    """From rest on one side of the dead zone through it to the other, half way."""
    t = _time(axis, DURATION_S)
    reference = rate * (t - t[-1] / 2)
    clean, at_nominal = (_tracking_error(a, controller, reference) for a in (axis, nominal))
    noisy = _tracking_error(axis, controller, reference, noise[:, : len(t)])
    before = (t >= SETTLING_IN_S) & (t < 0.45 * t[-1])
    crossing = t >= 0.45 * t[-1]
    merits = {
        "rms error": _rms(clean[:, before]),
        "rms error with noise": _rms(noisy[:, before]),
        "largest error in the dead zone": np.abs(clean[:, crossing]).max(axis=1),
    }
    units = dict.fromkeys(merits, axis.units.output)
    return _banded("sidereal", "error", t, reference, clean, at_nominal[0], merits, units)


def _tracking_error(
    axis: AxisDraws, controller: Controller, reference: FloatArray, noise: FloatArray | None = None
) -> FloatArray:
    c3 = axis.gains[2]
    start = reference[0] / c3 - axis.half_width
    y = simulate_loop(axis, controller, reference, noise=noise, initial_position=start).y
    return np.asarray(reference - y, dtype=np.float64)


def _banded(
    name: str,
    shows: str,
    t: FloatArray,
    reference: FloatArray,
    curves: FloatArray,
    nominal: FloatArray,
    merits: Mapping[str, FloatArray],
    units: Mapping[str, str],
) -> Response:
    lower, median, upper = np.quantile(
        curves, [(1 - INTERVAL_PROBABILITY) / 2, 0.5, (1 + INTERVAL_PROBABILITY) / 2], axis=0
    )
    return Response(name, shows, t, reference, median, lower, upper, nominal, merits, units)


def _time(axis: AxisDraws, seconds: float) -> FloatArray:
    return np.asarray(np.arange(round(seconds * axis.sample_rate_hz)) / axis.sample_rate_hz, dtype=np.float64)


def _rms(error: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(error**2, axis=1)), dtype=np.float64)
