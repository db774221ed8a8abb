"""All that records show before any model, put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import cached_property
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray, white_sigma
from bayes_hw.column_roles.reading_step import resolution
from bayes_hw.errors import InputError
from bayes_hw.first_look.advice import Advice, advice
from bayes_hw.first_look.delay import delay
from bayes_hw.first_look.distortion import distortion
from bayes_hw.first_look.feedback import feedback
from bayes_hw.first_look.frequency_response import FrequencyResponse
from bayes_hw.first_look.known_columns import known_columns
from bayes_hw.first_look.measures import TURNS, Measures
from bayes_hw.first_look.motion import position_error, regimes, reversals, speed_map
from bayes_hw.first_look.noise import (
    NoiseSpectrum,
    drift,
    noise_spectrum,
    quiet_sigma,
)
from bayes_hw.first_look.repeated import RepeatedError, errors_of, repeated_error
from bayes_hw.first_look.response import MeasuredResponse, measured_response
from bayes_hw.first_look.statics import Statics, statics
from bayes_hw.model.sample_rate import check_alike
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

SCHEMA = "bayes-hw/look/1"
LEAST_SAMPLES = 64
AT_ZERO = 4.0
"""A first angle within so many noise levels of zero counts as zero: the record's angles are then absolute."""


class Look(Measures):
    """What `records` show, with what follows from it in words."""

    def __repr__(self) -> str:
        return f"Look({len(self.records)} records, {self.duration_s:g} s: {self.advice.sentence})"

    @cached_property
    def advice(self) -> Advice:
        """What is shown, what is not, and what to record next."""
        return advice(self)

    def to_dict(self) -> dict[str, Any]:
        """The content of look.json."""
        first = self.records[0]
        response = self.response
        return {
            "schema": SCHEMA,
            "records": [
                {"name": r.name, "samples": len(r), "duration_s": r.duration_s, "origin": origin}
                for r, origin in zip(self.records, self.origins, strict=True)
            ],
            "sample_rate_hz": first.sample_rate_hz,
            "units": first.units.to_dict(),
            "frequency_response": _response(response.linear if response else None),
            "best_linear_approximation": _response(response.best_linear if response else None),
            "delay_s": None
            if self.delay is None
            else {
                "mean": self.delay.mean,
                "sd": self.delay.sd,
                "hdi94": [self.delay.low, self.delay.high],
            },
            "noise_sigma": self.noise_sigma,
            "noise_sigma_white": self.white_sigma,
            "noise_spectrum": None
            if self.noise is None
            else {"frequency_hz": _list(self.noise.frequency_hz), "density": _list(self.noise.density)},
            "resolution": self.resolution,
            "drift_per_hour": {"mean": self.drift_per_hour[0], "standard_error": self.drift_per_hour[1]},
            "saturation": {"lower": self.apart.lower, "upper": self.apart.upper}
            | {"share_at_lower": self.at_limits[0], "share_at_upper": self.at_limits[1]},
            "dead_zone": {"half_width": self.apart.half_width},
            "hysteresis": None if self.repeated.hysteresis is None else self.repeated.hysteresis.to_dict(),
            "ripples": [asdict(ripple) for ripple in self.repeated.ripples],
            "reversals": self.reversals,
            "distortion": None if self.distortion is None else asdict(self.distortion),
            "closed_loop": None
            if self.feedback is None
            else asdict(self.feedback) | {"hint": self.feedback.closed_loop},
            "speed_against_command": {
                "command": _list(self.speed.command),
                "rising": _list(self.speed.rising),
                "falling": _list(self.speed.falling),
            },
            "position_error": {
                "angle": _list(self.position.angle),
                "mean": _list(self.position.mean),
                "standard_error": _list(self.position.standard_error),
            },
            "regimes": {name: asdict(regime) for name, regime in self.regimes.items()},
            "known": {
                column.name: {
                    "unit": column.unit,
                    "frequency_hz": _list(column.frequency_hz),
                    "coherence": _list(column.coherence),
                    "bound": column.bound,
                    "share_of_error": column.share,
                    "follows": column.follows,
                }
                for column in self.known
            },
            "shows": list(self.advice.shows),
            "cannot_show": list(self.advice.cannot_show),
            "record_next": list(self.advice.record_next),
        }


def look(records: Sequence[Record]) -> Look:
    """What `records` of one axis show; raises InputError where they differ in rate or units, or are too
    short.
    """
    _check(records)
    with one_blas_thread():
        return _seen(records)


def _seen(records: Sequence[Record]) -> Look:
    first = records[0]
    rate = first.sample_rate_hz
    commands = [record.u for record in records]
    white = white_sigma([record.y for record in records])
    origins = tuple(_origin(record, white) for record in records)
    outputs = [record.y - origin for record, origin in zip(records, origins, strict=True)]
    found = statics(outputs, commands, rate)
    if not all(record.measured_samples[0] for record in records):
        outputs = [_levelled(found, k, y, records[k]) for k, y in enumerate(outputs)]
        found = statics(outputs, commands, rate)
    if not any(record.measured_samples[0] for record in records):
        found = replace(found, half_width=None, bound=None)  # about an angle that nobody knows
    outputs = [_over_holes(found, k, y, records[k]) for k, y in enumerate(outputs)]
    response = measured_response(outputs, commands, rate, found)
    limited = [found.limited(u) for u in commands]
    repeated = repeated_error(outputs, commands, [r.y for r in records], found, rate, white)
    noise, sigma = _noise(outputs, commands, rate, response, repeated, white)
    opened = [found.opened(k, y) for k, y in enumerate(outputs)]
    cleaned = [y - part for y, part in zip(opened, repeated.part, strict=True)]
    lag = delay(cleaned, limited, rate, found.seen)
    errors = errors_of(outputs, found)
    longest = max(range(len(records)), key=lambda k: len(records[k]))
    return Look(
        records=tuple(records),
        origins=origins,
        errors=errors,
        repeated=repeated,
        statics=found,
        response=response,
        noise=noise,
        noise_sigma=sigma,
        white_sigma=min(white, sigma),
        resolution=resolution([record.y for record in records], white),
        delay=lag,
        drift_per_hour=drift(errors[longest], rate),
        distortion=distortion(repeated.left, commands, rate),
        feedback=feedback(repeated.left, commands, rate, [r.y_or_nan for r in records]),
        speed=speed_map(outputs, commands, rate, lag.mean if lag else 0.0),
        position=position_error([r.y for r in records], errors, TURNS.get(first.units.output)),
        regimes=regimes(outputs, commands, rate, sigma),
        reversals=sum(reversals(y, max(6 * white, 0.02 * float(np.ptp(y)))) for y in outputs),
        at_limits=_at_limits(repeated.statics if repeated.is_seen else found, np.concatenate(commands)),
        known=known_columns(records, errors, limited, rate),
    )


def _levelled(found: Statics, number: int, y: FloatArray, record: Record) -> FloatArray:
    """The output counted from where the simulated motion began, where nothing was measured when it did."""
    measured = record.measured_samples
    if measured[0] or len(found.undisturbed) <= number:
        return y
    return np.asarray(y - np.median((y - found.undisturbed[number])[measured]))


def _over_holes(found: Statics, number: int, y: FloatArray, record: Record) -> FloatArray:
    """The output as simulated where it was not measured, with what is left of its neighbours."""
    measured = record.measured_samples
    if measured.all() or len(found.undisturbed) <= number:
        return y
    simulated, at = found.predicted(number), np.arange(len(y))
    left = np.interp(at, at[measured], (y - simulated)[measured])
    return np.where(measured, y, simulated + left)


def _at_limits(found: Statics, commands: FloatArray) -> tuple[float, float]:
    """Shares of the samples that ask for less than the lower and more than the upper limit."""
    lower = -np.inf if found.lower is None else found.lower
    upper = np.inf if found.upper is None else found.upper
    return float(np.mean(commands < lower)), float(np.mean(commands > upper))


def _check(records: Sequence[Record]) -> None:
    check_alike(records)
    for record in records:
        if len(record) < LEAST_SAMPLES:
            raise InputError(
                f"record {record.name}: {len(record)} samples are too few to show anything; "
                f"give {LEAST_SAMPLES} or more"
            )


def _origin(record: Record, white: float) -> float:
    """The angle that counts as zero: zero itself, or where the record begins when that is elsewhere."""
    moving = np.flatnonzero(record.u != record.u[0])
    rest = int(moving[0]) if len(moving) and record.u[0] == 0 else 1
    begin = float(record.y[: max(rest, 1)].mean())
    return 0.0 if abs(begin) <= AT_ZERO * white else begin


def _noise(
    outputs: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    sample_rate_hz: float,
    response: MeasuredResponse | None,
    repeated: RepeatedError,
    white: float,
) -> tuple[NoiseSpectrum | None, float]:
    """Its spectrum, and its standard deviation beside what repeats."""
    if repeated.is_seen:
        cleaned = [y - part for y, part in zip(outputs, repeated.part, strict=True)]
        response = measured_response(cleaned, commands, sample_rate_hz, repeated.statics)
    noise = noise_spectrum(response.linear) if response else None
    sigma = noise.sigma if noise and noise.sigma > 0 else white
    quiet = quiet_sigma(repeated.left, sample_rate_hz) if repeated.is_seen else 0.0
    return noise, min(sigma, quiet) if quiet > 0 else sigma


def _response(response: FrequencyResponse | None) -> dict[str, list[float | None]]:
    if response is None:
        names = (
            "frequency_hz",
            "magnitude",
            "phase_deg",
            "coherence",
            "magnitude_lo",
            "magnitude_hi",
            "rate_magnitude",
        )
        return {name: [] for name in names}
    return {
        "frequency_hz": _list(response.frequency_hz),
        "magnitude": _list(response.magnitude),
        "phase_deg": _list(response.phase_deg),
        "coherence": _list(response.coherence),
        "magnitude_lo": _list(response.lower),
        "magnitude_hi": _list(response.upper),
        "rate_magnitude": _list(response.magnitude * response.rate_factor),
    }


def _list(values: FloatArray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]
