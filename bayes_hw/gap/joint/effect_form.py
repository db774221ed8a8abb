"""Effects that the joint search knows: where each acts in the kernel, its parameters, its starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint import joint_kernel as K  # noqa: N812

Place = Literal["input", "output", "law"]
LONGEST_PERIOD, COARSE_CYCLES, CYCLE_STEP, MOST_CYCLES = 8.0, 7.0, 0.5, 90.0
"""Periods in position: up to eight times the travel, and down to so many cycles a travel in steps of half a
cycle, since one that is off by a cycle over the travel shows nothing. Short ones are scanned first."""


@dataclass(frozen=True)
class JointScale:
    """Sizes natural to the records: `speed` of the limited command (input units), `gain` output units per
    sample and unit of command, `travel` and `sigma` in output units, `samples` of the longest record;
    `periods` (output units) are those that a scan found promising, `shortest` the shortest that may be looked
    for: what rounding does repeats with its step."""

    speed: float
    gain: float
    travel: float
    sigma: float
    samples: int
    rate_hz: float
    periods: tuple[float, ...] = ()
    shortest: float = 0.0


@dataclass(frozen=True)
class Slot:
    """One parameter: its row in the kernel's array, name, bounds; `logarithmic` ones are positive."""

    row: int
    name: str
    logarithmic: bool = False
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class Form:
    """One form of a label.

    `slots` gives its parameters for a scale, `starts` the values (parameters,) to begin from, at which the
    form changes nothing. A form that is `further` extends another of its label by parameters, and is tried
    where that one is present.
    """

    label: str
    name: str
    place: Place
    slots: Callable[[JointScale], tuple[Slot, ...]]
    starts: Callable[[JointScale], Sequence[tuple[float, ...]]]
    law: int = -1
    base: int = 0
    further: bool = False

    @property
    def is_law(self) -> bool:
        return self.place == "law"

    @property
    def full_name(self) -> str:
        return f"{self.label} ({self.name})" if self.name else self.label


def coarse_periods(scale: JointScale) -> list[float]:
    """Long periods, output units."""
    long = np.geomspace(1 / LONGEST_PERIOD, 1.0, 8, endpoint=False)
    cycles = np.concatenate([long, np.arange(1.0, COARSE_CYCLES, CYCLE_STEP)])
    return [float(scale.travel / c) for c in cycles if scale.travel / c >= scale.shortest]


def scanned_cycles() -> FloatArray:
    """Cycles over the travel that a scan goes through."""
    return np.arange(1.0, MOST_CYCLES, CYCLE_STEP)


def _wavenumber(scale: JointScale, row: int) -> Slot:
    shortest = max(scale.travel / (1.1 * MOST_CYCLES), scale.shortest)
    return Slot(row, "wavenumber", True, 2 * np.pi / (12 * scale.travel), 2 * np.pi / shortest)


def _slow(scale: JointScale, row: int, name: str = "time") -> Slot:
    return Slot(row, name, True, 0.02 * scale.samples, 3.0 * scale.samples)


def _friction(scale: JointScale, base: int) -> Slot:
    unit = scale.speed * (1.0 if base == K.BASE_COMMAND else scale.gain)
    return Slot(0, "smoothing_speed", True, 0.003 * unit, 0.15 * unit)


def _bristle(scale: JointScale, base: int) -> Slot:
    unit = scale.speed * (1.0 if base == K.BASE_COMMAND else scale.gain)
    return Slot(0, "presliding", True, 0.003 * unit, 10 * unit)


def _speed_unit(scale: JointScale, base: int) -> float:
    return scale.speed * (1.0 if base == K.BASE_COMMAND else scale.gain)


def _coulomb(place: str, base: int) -> Form:
    return Form(
        "friction", f"Coulomb, {place}", "law",
        lambda s: (_friction(s, base),),
        lambda s: [(share * _speed_unit(s, base),) for share in (0.03, 0.1)],
        K.COULOMB, base,
    )  # fmt: skip


def _stribeck(place: str, base: int) -> Form:
    return Form(
        "friction", f"Stribeck, {place}", "law",
        lambda s: (
            _friction(s, base),
            Slot(1, "static_excess", False, 0.0, 4.0),
            Slot(2, "stribeck_speed", True, 0.02 * _speed_unit(s, base), 0.6 * _speed_unit(s, base)),
        ),
        lambda s: [(0.05 * _speed_unit(s, base), 0.5, 0.15 * _speed_unit(s, base))],
        K.STRIBECK, base,
    )  # fmt: skip


def _presliding(place: str, base: int) -> Form:
    return Form(
        "friction", f"presliding, {place}", "law",
        lambda s: (_bristle(s, base),),
        lambda s: [(share * _speed_unit(s, base),) for share in (0.3, 3.0)],
        K.BRISTLE, base,
    )  # fmt: skip


def _early_rate(row: int, name: str) -> Form:
    return Form(
        "rate_limit", name, "input",
        lambda s: (Slot(row, "slowness", False, 0.0, 100 / s.speed),),
        lambda s: [(0.02 / s.speed,), (0.3 / s.speed,), (2.0 / s.speed,), (8.0 / s.speed,)],
    )  # fmt: skip


def _wave(
    label: str, name: str, place: Place, first: int, periods: Callable[[JointScale], Sequence[float]]
) -> Form:
    return Form(
        label, name, place,
        lambda s: (
            Slot(first, "sine"), Slot(first + 1, "cosine"), _wavenumber(s, first + 2),
        ),
        lambda s: [(0.0, 0.0, 2 * np.pi / p) for p in periods(s)],
    )  # fmt: skip


def _ripple(name: str, base: int) -> Form:
    return Form(
        "torque_ripple", name, "law",
        lambda s: (_wavenumber(s, 0), Slot(1, "phase")),
        lambda s: [(2 * np.pi / p, phase) for p in s.periods or coarse_periods(s) for phase in (0.4, 2.0)],
        K.RIPPLE, base,
    )  # fmt: skip


def _second_harmonic(base: int) -> Form:
    return Form(
        "torque_ripple", "two harmonics", "law",
        lambda s: (_wavenumber(s, 0), Slot(1, "phase"), Slot(2, "second", False, -2.0, 2.0)),
        lambda s: [(2 * np.pi / s.travel, 0.4, 0.1)],
        K.RIPPLE, base, True,
    )  # fmt: skip


FORMS: tuple[Form, ...] = (
    _early_rate(K.LATE_RATE, ""),
    _early_rate(K.EARLY_RATE, "before the limiter"),
    _wave("saturation_drift", "", "input", K.LIMIT_SINE, coarse_periods),
    Form(
        "saturation_drift", "slope", "input",
        lambda s: (Slot(K.LIMIT_SLOPE, "slope", False, -2 / s.travel, 2 / s.travel),),
        lambda _: [(0.0,)],
    ),
    Form("command_bias", "", "input", lambda _: (Slot(K.BIAS, "bias"),), lambda _: [(0.0,)]),
    Form(
        "gain_drift", "", "input",
        lambda s: (Slot(K.CHANGE, "change", False, -0.9, 5.0), _slow(s, K.WARMING)),
        lambda s: [(0.0, share * s.samples) for share in (0.1, 0.3, 0.8)],
    ),
    Form(
        "cubic_stiffness", "", "law",
        lambda _: (Slot(1, "softening", False, 0.0, 3.0),),
        lambda _: [(0.0,)],
        K.CUBIC, K.BASE_SECOND_DIFFERENCE,
    ),
    _coulomb("motor", K.BASE_COMMAND),
    _presliding("motor", K.BASE_COMMAND),
    _stribeck("motor", K.BASE_COMMAND),
    _coulomb("load", K.BASE_SPEED),
    _presliding("load", K.BASE_SPEED),
    _stribeck("load", K.BASE_SPEED),
    Form(
        "backlash", "kinematic", "output",
        lambda s: (Slot(K.PLAY, "half_gap", False, 0.0, 0.3 * s.travel),),
        lambda s: [(0.3 * s.sigma,), (2.0 * s.sigma,)],
    ),
    Form(
        "backlash", "dynamic", "law",
        lambda s: (Slot(0, "gap", True, 1e-3 * _twist(s), 30 * _twist(s)),),
        lambda s: [(share * _twist(s),) for share in (0.1, 0.5)],
        K.GAP, K.BASE_SECOND_DIFFERENCE,
    ),
    _ripple("", K.BASE_POSITION),
    _second_harmonic(K.BASE_POSITION),
    _wave(
        "encoder_eccentricity", "", "output", K.SINE,
        lambda s: [*coarse_periods(s), *(p for p in s.periods if p < s.travel / COARSE_CYCLES)],
    ),
    Form(
        "gain_asymmetry", "", "output",
        lambda _: (Slot(K.LOG_RATIO, "log_ratio", False, -0.7, 0.7),),
        lambda _: [(0.0,)],
    ),
    Form(
        "other", "curve of the command", "input",
        lambda s: (
            Slot(K.EVEN_CURVE, "even", False, -0.5, 0.5),
            Slot(K.ODD_CURVE, "odd", False, -0.45 / s.speed, 2 / s.speed),
        ),
        lambda _: [(0.0, 0.0)],
    ),
    Form(
        "other", "hysteresis of the spring", "law",
        lambda s: (Slot(0, "yield", True, 0.003 * _twist(s), 10 * _twist(s)),),
        lambda s: [(share * _twist(s),) for share in (0.1, 1.0)],
        K.BRISTLE, K.BASE_THIRD_DIFFERENCE,
    ),
    Form(
        "other", "torque limit", "law",
        lambda s: (Slot(0, "acceleration", True, 0.05 * _twist(s), 30 * _twist(s)),),
        lambda s: [(share * _twist(s),) for share in (0.3, 1.0, 3.0)],
        K.EXCESS, K.BASE_SECOND_DIFFERENCE,
    ),
    Form(
        "other", "stiffness over position", "law",
        lambda s: (_wavenumber(s, 0), Slot(1, "phase")),
        lambda s: [
            (2 * np.pi / p, phase) for p in coarse_periods(s) if p > 0.1 * s.travel for phase in (0.4, 2.0)
        ],
        K.MODULATED, K.BASE_SECOND_DIFFERENCE,
    ),
    Form("sensor_drift", "ramp", "output", lambda _: (Slot(K.RATE, "rate"),), lambda _: [(0.0,)]),
    Form(
        "sensor_drift", "thermal", "output",
        lambda s: (Slot(K.SETTLING, "amount"), _slow(s, K.SETTLING_TIME)),
        lambda s: [(0.0, share * s.samples) for share in (0.08, 0.25, 0.6)],
    ),
)  # fmt: skip


def _twist(scale: JointScale) -> float:
    """Second difference of w when the speed changes by its limit over ten samples."""
    return 0.1 * scale.speed * scale.gain
