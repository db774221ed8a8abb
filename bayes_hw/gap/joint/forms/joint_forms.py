"""Forms of the effects that the joint search knows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale, Slot

TURNS_SEEN = 1.5
"""Within the travel, at least, for a shape over position to be told as a period."""

COARSE_TURNS, TURN_STEP, MOST_TURNS = 7.0, 0.5, 120.0
"""Turns within the travel: started from up to the first; scanned in steps of half a turn up to the last,
since a period that is off by a turn over the travel shows nothing."""

LIMIT_TURNS = range(7, 25)
"""From which limits that move are begun too: what is off by half a turn still shows."""

STOP_SHARES = (0.2, 0.3, 0.4, 0.5)
"""Of the travel."""

LEADS = (-3.0, 4.0)
"""Samples by which the angle that limits look at is ahead: what of the delay lies behind them."""

LONG_PERIODS = 8
"""Periods that are screened from those seen TURNS_SEEN times to 8 times the travel."""


def coarse_periods(scale: JointScale) -> list[float]:
    """Periods seen often enough, long ones, output units."""
    turns = np.arange(TURNS_SEEN, COARSE_TURNS, TURN_STEP)
    return [float(scale.travel / t) for t in turns if scale.travel / t >= scale.shortest]


def scanned_cycles() -> FloatArray:
    """Cycles over the travel that a scan goes through."""
    return np.arange(TURNS_SEEN, MOST_TURNS, TURN_STEP)


def _bending(scale: JointScale) -> list[float]:
    """Longer ones: shapes over position."""
    return [float(p) for p in np.geomspace(1.05 / TURNS_SEEN, 8.0, LONG_PERIODS) * scale.travel]


def _wavenumber(scale: JointScale, row: int) -> Slot:
    shortest = max(scale.travel / (1.1 * MOST_TURNS), scale.shortest)
    return Slot(row, "wavenumber", True, 2 * np.pi / (12 * scale.travel), 2 * np.pi / shortest)


def period_wavenumber(scale: JointScale, row: int) -> Slot:
    shortest = max(scale.travel / (1.1 * MOST_TURNS), scale.shortest)
    return Slot(row, "wavenumber", True, 2 * np.pi * TURNS_SEEN / scale.travel, 2 * np.pi / shortest)


def _shape_wavenumber(scale: JointScale, row: int) -> Slot:
    longest = 2 * np.pi / (12 * scale.travel)
    return Slot(row, "wavenumber", True, longest, 2 * np.pi * TURNS_SEEN / scale.travel)


def _slow(scale: JointScale, row: int, name: str = "time") -> Slot:
    return Slot(row, name, True, 0.02 * scale.samples, 3.0 * scale.samples)


def _speed_unit(scale: JointScale, base: int) -> float:
    return scale.speed * (1.0 if base == K.BASE_COMMAND else scale.gain)


def _friction(scale: JointScale, base: int) -> Slot:
    unit = _speed_unit(scale, base)
    return Slot(0, "smoothing_speed", True, 0.003 * unit, 0.15 * unit)


def _bristle(scale: JointScale, base: int) -> Slot:
    unit = _speed_unit(scale, base)
    return Slot(0, "presliding", True, 0.003 * unit, 10 * unit)


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


def _by_twist(form: Form, label: str, kind: str) -> Form:
    """A friction's law where what it looks at is the twist of the drive."""
    return _seen_as(form, label, f"{kind} by {form.name}", "twist")


def _as_shape(form: Form) -> Form:
    """A ripple's law where what it looks at shows no period."""
    return _not_scanned(form, "torque over position, part of a wave", "shape")


def _as_reading(form: Form) -> Form:
    """A ripple's law where it is a reading: an error of the measured speed that is periodic in position is
    the rate of such a ripple."""
    return replace(_not_scanned(form, "speed reading over position", "reading"), misread=True)


def _not_scanned(form: Form, name: str, slot_prefix: str) -> Form:
    """A ripple's law under another name, whose period is not scanned for."""
    named = _seen_as(form, "other", f"{name} {form.name}".rstrip(), slot_prefix)
    return replace(named, starts=lambda s: form.starts(replace(s, periods=(), motor_periods=())))


def _seen_as(form: Form, label: str, name: str, slot_prefix: str) -> Form:
    """A law that has another name by what it looks at: it is never begun, and extends no other form."""

    def slots(scale: JointScale) -> tuple[Slot, ...]:
        return tuple(replace(slot, name=f"{slot_prefix}_{slot.name}") for slot in form.slots(scale))

    return replace(form, label=label, name=name, slots=slots, further=True, otherwise=None)


def _rate(row: int, name: str) -> Form:
    return Form(
        "rate_limit", name, "input",
        lambda s: (Slot(row, "slowness", False, 0.0, 100 / s.speed),),
        lambda s: [(0.02 / s.speed,), (0.3 / s.speed,), (2.0 / s.speed,), (8.0 / s.speed,)],
    )  # fmt: skip


def _stepped_rate(row: int, name: str) -> Form:
    """A ramp that a controller moves in steps: one in so many of its steps a sample is `held`."""
    return Form(
        "rate_limit", name, "input",
        lambda s: (Slot(row, "slowness", False, 0.0, 100 / s.speed), Slot(K.HELD, "held", False, 0.0, 1.0)),
        lambda s: [(0.3 / s.speed, 0.5)],
        further=True,
    )  # fmt: skip


Periods: TypeAlias = Callable[[JointScale], list[float]]
Wavenumber: TypeAlias = Callable[[JointScale, int], Slot]


def _wave(label: str, name: str, periods: Periods, wavenumber: Wavenumber) -> Form:
    return Form(
        label, name, "output",
        lambda s: (Slot(K.SINE, "sine"), Slot(K.COSINE, "cosine"), wavenumber(s, K.WAVENUMBER)),
        lambda s: [(0.0, 0.0, 2 * np.pi / p) for p in periods(s)],
    )  # fmt: skip


def _ripple(
    label: str, name: str, periods: Periods, wavenumber: Wavenumber, base: int = K.BASE_POSITION
) -> Form:
    return Form(
        label, name, "law",
        lambda s: (wavenumber(s, 0), Slot(1, "phase")),
        lambda s: [(2 * np.pi / p, phase) for p in periods(s) for phase in (0.4, 2.0)],
        K.RIPPLE, base,
    )  # fmt: skip


def _second_harmonic(base: int, name: str) -> Form:
    """What was found alone may be either of the two."""
    return Form(
        "torque_ripple", f"two harmonics{name}", "law",
        lambda s: (period_wavenumber(s, 0), Slot(1, "phase"), Slot(2, "second", False, -2.0, 2.0)),
        lambda s: [(4 * np.pi / s.travel, 0.4, 0.1)],
        K.RIPPLE, base, further=True,
        otherwise=lambda one: {"wavenumber": one["wavenumber"] / 2, "phase": one["phase"], "second": 1.5},
    )  # fmt: skip


def _oval() -> Form:
    """Of a disc off its axis that is not round; what was found alone may be either harmonic."""
    return Form(
        "encoder_eccentricity", "two harmonics", "output",
        lambda s: (
            Slot(K.SINE, "sine"), Slot(K.COSINE, "cosine"), period_wavenumber(s, K.WAVENUMBER),
            Slot(K.SINE2, "second_sine"), Slot(K.COSINE2, "second_cosine"),
        ),
        lambda s: [(0.0, 0.0, 2 * np.pi / p, 0.0, 0.0) for p in _turning_or_long(s)],
        further=True,
        otherwise=lambda one: {
            "wavenumber": one["wavenumber"] / 2, "sine": 0.0, "cosine": 0.0,
            "second_sine": one["sine"], "second_cosine": one["cosine"],
        },
    )  # fmt: skip


def _any_period(scale: JointScale) -> list[float]:
    return [*coarse_periods(scale), *_bending(scale)]


def _limit_periods(scale: JointScale) -> list[float]:
    shorter = [scale.travel / turns for turns in LIMIT_TURNS]
    return [*_any_period(scale), *(p for p in shorter if p >= scale.shortest)]


def turning_periods(scale: JointScale) -> list[float]:
    """What a scan found, or long periods seen often enough."""
    return list(scale.periods) or coarse_periods(scale)


def _motor_periods(scale: JointScale) -> list[float]:
    return list(scale.motor_periods) or coarse_periods(scale)


def _turning_or_long(scale: JointScale) -> list[float]:
    return [*coarse_periods(scale), *(p for p in scale.periods if p < scale.travel / COARSE_TURNS)]


_FRICTIONS: tuple[Form, ...] = tuple(
    make(place, base)
    for place, base in (("motor", K.BASE_COMMAND), ("load", K.BASE_SPEED))
    for make in (_coulomb, _presliding, _stribeck)
)
_RIPPLES: tuple[Form, ...] = (
    _ripple("torque_ripple", "", turning_periods, period_wavenumber),
    _ripple("torque_ripple", "of the motor", _motor_periods, period_wavenumber, K.BASE_MOTOR),
    _second_harmonic(K.BASE_POSITION, ""),
    _second_harmonic(K.BASE_MOTOR, " of the motor"),
)
AS_SHAPE: dict[Form, Form] = {form: _as_shape(form) for form in _RIPPLES}
"""Ripples, and the same where the motion that they look at does not go through a period often enough."""

AS_READING: dict[Form, Form] = {form: _as_reading(form) for form in _RIPPLES}
"""Ripples, and the same where they enter as what the loop misreads does."""

_HYSTERESIS = Form(
    "other", "hysteresis of the spring", "law",
    lambda s: (Slot(0, "yield", True, 0.003 * s.twist, 10 * s.twist),),
    lambda s: [(share * s.twist,) for share in (0.1, 1.0)],
    K.BRISTLE, K.BASE_TWIST_RATE,
)  # fmt: skip
_DRAG = Form("other", "drag", "law", lambda _: (), lambda _: [()], K.DRAG, K.BASE_SPEED)
BY_TWIST: dict[Form, Form] = {
    **{form: _by_twist(form, "backlash", "contact") for form in (*_FRICTIONS, _HYSTERESIS)},
    _DRAG: replace(_DRAG, label="cubic_stiffness", name="quadratic", further=True),
}
"""Laws, and the same where they look at a twist: a friction that takes away what a spring passes on is
contact in a gap, a drag a spring whose stiffness grows or falls with the size of the twist."""

REMEMBERING: dict[Form, Form] = {_HYSTERESIS: _HYSTERESIS} | {
    form: _by_twist(form, "other", "hysteresis") for form in _FRICTIONS if form.law == K.BRISTLE
}
"""Those on bristles that add to it: a spring with hysteresis."""

AT_ONCE: dict[Form, Form] = {
    form: replace(form, label="backlash", name=f"kinematic by {form.name}", further=True)
    for form in _FRICTIONS
    if form.base == K.BASE_SPEED
}
"""Frictions of the load, and the same where they move the reading at once and accelerate nothing: it stands
still at a reversal until a gap is crossed."""

FORMS: tuple[Form, ...] = (
    _rate(K.LATE_RATE, ""),
    _rate(K.EARLY_RATE, "before the limiter"),
    _stepped_rate(K.LATE_RATE, "in steps"),
    _stepped_rate(K.EARLY_RATE, "in steps, before the limiter"),
    Form(
        "saturation_drift", "", "input",
        lambda s: (
            Slot(K.LIMIT_SINE, "sine"), Slot(K.LIMIT_COSINE, "cosine"), _wavenumber(s, K.LIMIT_WAVENUMBER),
            Slot(K.LIMIT_LEAD, "lead", False, *LEADS),
        ),
        lambda s: [(0.0, 0.0, 2 * np.pi / p, 0.5) for p in _limit_periods(s)],
    ),
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
        lambda _: (Slot(1, "softening", False, 0.0, 100.0),),
        lambda _: [(0.0,), (0.3,), (1.5,)],
        K.CUBIC, K.BASE_TWIST,
    ),
    *_FRICTIONS,
    Form(
        "backlash", "kinematic", "output",
        lambda s: (Slot(K.PLAY, "half_gap", False, 0.0, 0.3 * s.travel),),
        lambda s: [(0.3 * s.sigma,), (2.0 * s.sigma,)],
        remembers=True,
    ),
    Form(
        "backlash", "dynamic", "law",
        lambda s: (Slot(0, "gap", True, 1e-3 * s.twist, 30 * s.twist),),
        lambda s: [(share * s.twist,) for share in (0.1, 0.5, 2.0, 8.0)],
        K.GAP, K.BASE_TWIST,
    ),
    *BY_TWIST.values(),
    *REMEMBERING.values(),
    *AT_ONCE.values(),
    *_RIPPLES,
    *AS_SHAPE.values(),
    *AS_READING.values(),
    _wave("encoder_eccentricity", "", _turning_or_long, period_wavenumber),
    _oval(),
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
        "other", "slip beyond the spring", "law",
        lambda s: (Slot(0, "acceleration", True, 0.05 * s.twist, 30 * s.twist),),
        lambda s: [(share * s.twist,) for share in (0.1, 0.3, 1.0, 3.0)],
        K.SLIP, K.BASE_TWIST,
    ),
    Form(
        "other", "torque limit", "law",
        lambda s: (Slot(0, "acceleration", True, 0.05 * s.twist, 30 * s.twist),),
        lambda s: [(share * s.twist,) for share in (0.3, 1.0, 3.0)],
        K.EXCESS, K.BASE_TWIST,
    ),
    Form(
        "other", "stiffness over position", "law",
        lambda s: (_wavenumber(s, 0), Slot(1, "phase")),
        lambda s: [
            (2 * np.pi / p, phase) for p in _any_period(s) if p > 0.1 * s.travel for phase in (0.4, 2.0)
        ],
        K.MODULATED, K.BASE_TWIST,
    ),
    _wave("other", "reading over position", _bending, _shape_wavenumber),
    _ripple("other", "torque over position", _bending, _shape_wavenumber),
    Form(
        "other", "stops", "law",
        lambda s: (Slot(0, "angle", True, 0.02 * s.travel, s.travel),),
        lambda s: [(share * s.travel,) for share in STOP_SHARES],
        K.EXCESS, K.BASE_POSITION,
    ),
    _DRAG,
    Form("sensor_drift", "ramp", "output", lambda _: (Slot(K.RATE, "rate"),), lambda _: [(0.0,)]),
    Form(
        "sensor_drift", "thermal", "output",
        lambda s: (Slot(K.SETTLING, "amount"), _slow(s, K.SETTLING_TIME)),
        lambda s: [(0.0, share * s.samples) for share in (0.08, 0.25, 0.6)],
    ),
)  # fmt: skip
