"""A position controller: PI or PID in incremental form, with its limits, and its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.control.notch import Notch, Section
from bayes_hw.control.state_space import StateSpace, series
from bayes_hw.errors import InputError
from bayes_hw.files import read_json, write_json
from bayes_hw.format_names import CONTROLLER

RATIO_TOLERANCE = 1e-6
LARGEST_NUMBER = 1e150
LARGEST_DELAY = 1000
"""Periods; the states of a loop grow with them."""


@dataclass(frozen=True)
class Controller:
    """u = C(z) (r - y), computed as increments and limited as they are added up.

        q(k) = notch and low-pass filters applied to r(k) - y(k)
        d(k) = (Tf d(k-1) + Kd (q(k) - q(k-1))) / (Tf + T)
        m(k) = m'(k-1) + Kp (q(k) - q(k-1)) + Ki T q(k) + d(k) - d(k-1)
        u(k) = min(max(m(k), u(k-1) - a T, lower), u(k-1) + a T, upper)
        m'(k) = m(k) + min(1, T / T_aw) (u(k) - m(k))

    the incremental PID of section 2.2 of Acta Astronomica Sinica, doi
    10.15940/j.cnki.0001-5245.2026.01.012, with limits on the rate of change of the command and on the
    command. `anti_windup_s` is the tracking time T_aw of back-calculation (Åström and Hägglund, Advanced PID
    Control, sec. 3.5): zero is the plain incremental form, which remembers the limited command; infinite
    remembers the unlimited one, so that the integral winds up.

    `proportional` (Kp) in input units per output unit, `integral` (Ki) in those per s, `derivative` (Kd) in
    those times s, `derivative_filter_s` (Tf) in s, `speed_limit` (lower, upper) in input units,
    `rate_of_change_limit` (a) in input units per s, `delay_samples` whole periods between measuring and
    commanding, `low_pass_hz` the corner of a first-order low pass made discrete by Tustin's rule, which
    blocks half the sample rate altogether. T = 1 / sample_rate_hz.
    """

    name: str
    sample_rate_hz: float
    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    derivative_filter_s: float = 0.0
    speed_limit: tuple[float, float] = (-np.inf, np.inf)
    rate_of_change_limit: float = np.inf
    anti_windup_s: float = 0.0
    delay_samples: int = 0
    notches: tuple[Notch, ...] = ()
    low_pass_hz: float = np.inf

    def __post_init__(self) -> None:
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise InputError("sample_rate_hz: must be finite and positive")
        for label in ("proportional", "integral", "derivative", "derivative_filter_s"):
            value = getattr(self, label)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"{label}: must be finite and zero or more")
        if self.proportional + self.integral + self.derivative == 0:
            raise InputError("proportional: one of proportional, integral and derivative must be positive")
        if not self.speed_limit[0] < 0 < self.speed_limit[1]:
            raise InputError("speed_limit: needs lower < 0 < upper")
        if not self.rate_of_change_limit > 0:
            raise InputError("rate_of_change_limit: must be positive")
        if not self.anti_windup_s >= 0:
            raise InputError("anti_windup_s: must be zero or more, or null for none")
        if not 0 <= self.delay_samples <= LARGEST_DELAY:
            raise InputError(f"delay_samples: must be from zero to {LARGEST_DELAY}")
        for notch in self.notches:
            if notch.frequency_hz >= self.sample_rate_hz / 2:
                raise InputError("notches: frequency_hz must lie below half the controller's rate")

        if not 0 < self.low_pass_hz < self.sample_rate_hz / 2 and np.isfinite(self.low_pass_hz):
            raise InputError("low_pass_hz: must lie between 0 and half the controller's rate")

    @property
    def sections(self) -> tuple[Section, ...]:
        """Coefficients b0, b1, b2, a1, a2 of every filter before the PID."""
        found = [notch.coefficients(self.period_s) for notch in self.notches]
        if np.isfinite(self.low_pass_hz):
            t = float(np.tan(np.pi * self.low_pass_hz * self.period_s))
            found.append((t / (1 + t), t / (1 + t), 0.0, (t - 1) / (t + 1), 0.0))
        return tuple(found)

    @property
    def kind(self) -> str:
        """ "P", "PI", "PD", "PID" or "I"."""
        terms = (("P", self.proportional), ("I", self.integral), ("D", self.derivative))
        return "".join(letter for letter, gain in terms if gain > 0)

    @property
    def period_s(self) -> float:
        return 1 / self.sample_rate_hz

    @property
    def memory_share(self) -> float:
        """How much of u - m a step takes back: 1 for the plain incremental form, 0 without anti-windup."""
        return 1.0 if self.anti_windup_s <= self.period_s else self.period_s / self.anti_windup_s

    def ratio_to(self, model_rate_hz: float) -> int:
        """Model samples a controller period.

        Raises InputError unless the model's rate is a whole multiple of the controller's: the model says
        nothing of what happens between its own samples.
        """
        ratio = model_rate_hz / self.sample_rate_hz
        if round(ratio) < 1 or abs(ratio - round(ratio)) > RATIO_TOLERANCE * ratio:
            raise InputError(
                f"controller {self.name!r}: its rate {self.sample_rate_hz:g} Hz does not divide the model's "
                f"{model_rate_hz:g} Hz; sample a model at a multiple of the controller's rate"
            )
        return round(ratio)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """C(exp(2 pi i f T)) without limits, same shape as `frequency_hz`."""
        back = np.exp(-2j * np.pi * frequency_hz * self.period_s)
        found = np.full(np.shape(back), self.proportional, dtype=np.complex128)
        if self.integral:
            found = found + self.integral * self.period_s / (1 - back)
        if self.derivative:
            total = self.derivative_filter_s + self.period_s
            found = found + self.derivative * (1 - back) / (total - self.derivative_filter_s * back)
        for b0, b1, b2, a1, a2 in self.sections:
            found = found * (b0 + back * (b1 + b2 * back)) / (1 + back * (a1 + a2 * back))
        return np.asarray(found * back**self.delay_samples, dtype=np.complex128)

    def state_space(self) -> StateSpace:
        """C(z) without limits and without `delay_samples`."""
        system = StateSpace.gain(self.proportional)
        if self.integral:
            step = self.integral * self.period_s
            system = system.parallel(StateSpace.first_order(1.0, step, 1.0, step))
        if self.derivative:
            total = self.derivative_filter_s + self.period_s
            pole, gain = self.derivative_filter_s / total, self.derivative / total
            system = system.parallel(StateSpace.first_order(pole, gain * (pole - 1), 1.0, gain))
        for section in self.sections:
            system = series(StateSpace.biquad(*section), system)
        return system

    @classmethod
    def read(cls, path: Path | str) -> Controller:
        """Read a controller file. Raises InputError that names the file, the key and the remedy."""
        path = Path(path)
        data = read_json(path, "give a controller file")
        try:
            return cls.from_dict(data, path.stem)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: Any, name: str = "controller") -> Controller:
        """Build the controller from the content of its file; raises InputError naming the key."""
        if not isinstance(data, Mapping):
            raise InputError("the top level must be an object with the keys of a controller file")
        known = (
            *("schema", "name", "type", "units", "sample_rate_hz", "proportional", "integral", "derivative"),
            *("derivative_filter_s", "speed_limit", "rate_of_change_limit", "anti_windup_s"),
            *("delay_samples", "notches", "low_pass_hz"),
        )
        for key in data:
            if key not in known:
                raise InputError(f"unknown key {key!r}; use {', '.join(known[4:])}")
        speed = data.get("speed_limit")
        if isinstance(speed, list) and len(speed) == 2:
            limits = (_number(speed[0], "speed_limit"), _number(speed[1], "speed_limit"))
        else:
            reach = np.inf if speed is None else _number(speed, "speed_limit")
            limits = (-reach, reach)
        low_pass = data.get("low_pass_hz")
        rate_limit, windup = data.get("rate_of_change_limit"), data.get("anti_windup_s", 0.0)
        delay = _number(data.get("delay_samples", 0), "delay_samples")
        if delay != int(delay):
            raise InputError("delay_samples: must be a whole number of periods")
        notches = data.get("notches", [])
        if not isinstance(notches, list):
            raise InputError("notches: must be a list of objects")
        controller = cls(
            name=str(data.get("name", name)),
            sample_rate_hz=_number(data.get("sample_rate_hz"), "sample_rate_hz"),
            proportional=_number(data.get("proportional"), "proportional"),
            integral=_number(data.get("integral", 0.0), "integral"),
            derivative=_number(data.get("derivative", 0.0), "derivative"),
            derivative_filter_s=_number(data.get("derivative_filter_s", 0.0), "derivative_filter_s"),
            speed_limit=limits,
            rate_of_change_limit=np.inf
            if rate_limit is None
            else _number(rate_limit, "rate_of_change_limit"),
            anti_windup_s=np.inf if windup is None else _number(windup, "anti_windup_s"),
            delay_samples=int(delay),
            notches=tuple(Notch.from_dict(item, f"notches[{i}]") for i, item in enumerate(notches)),
            low_pass_hz=np.inf if low_pass is None else _number(low_pass, "low_pass_hz"),
        )
        if data.get("type", controller.kind) != controller.kind:
            raise InputError(f"type: is {data['type']!r} but the gains are those of a {controller.kind}")
        return controller

    def to_dict(self, input_unit: str = "deg/s", output_unit: str = "deg") -> dict[str, Any]:
        """The content of a controller file; units are stated for the reader."""
        gain_unit = f"({input_unit})/{output_unit}"
        return {
            "schema": CONTROLLER,
            "name": self.name,
            "type": self.kind,
            "sample_rate_hz": self.sample_rate_hz,
            "proportional": self.proportional,
            "integral": self.integral,
            "derivative": self.derivative,
            "derivative_filter_s": self.derivative_filter_s,
            "speed_limit": None if np.isinf(self.speed_limit[1]) else list(self.speed_limit),
            "rate_of_change_limit": _or_none(self.rate_of_change_limit),
            "anti_windup_s": _or_none(self.anti_windup_s),
            "delay_samples": self.delay_samples,
            "notches": [notch.to_dict() for notch in self.notches],
            "low_pass_hz": _or_none(self.low_pass_hz),
            "units": {
                "sample_rate_hz": "Hz",
                "proportional": gain_unit,
                "integral": f"{gain_unit}/s",
                "derivative": f"{gain_unit} s",
                "derivative_filter_s": "s",
                "speed_limit": input_unit,
                "rate_of_change_limit": f"({input_unit})/s",
                "anti_windup_s": "s",
                "delay_samples": "controller periods",
                "low_pass_hz": "Hz",
            },
        }

    def write(self, path: Path, input_unit: str, output_unit: str) -> None:
        """Write the controller file (to a temporary name, then renamed)."""
        write_json(path, self.to_dict(input_unit, output_unit))


def _number(value: Any, label: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{label}: missing or not a number")
    if not abs(value) <= LARGEST_NUMBER:
        raise InputError(f"{label}: must be finite, and no larger than {LARGEST_NUMBER:g}")
    return float(value)


def _or_none(value: float) -> float | None:
    return None if np.isinf(value) else value
