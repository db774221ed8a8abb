"""What convinces of an effect: a quantity over another one, found without the effect's law, beside that law.

Every label has its own method (`VIEWS`); all give an `EffectView`, so that a page draws any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.answer.error_view import (
    by_turns,
    error_over_time,
    glitches,
    late_readings,
    rounding,
    slow_torque,
)
from bayes_hw.gap.joint.answer.free_function import EffectView, Rows, Seen, viewed
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Place
from bayes_hw.gap.joint.posterior.torque_scale import acceleration_of_unit
from bayes_hw.gap.joint.response.effect_paths import limited_and_gain, through_drive, through_port
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.response.kernel_numbers import Simulated

View: TypeAlias = Callable[[Seen, str], EffectView]


def effect_view(seen: Seen, label: str) -> EffectView:
    """The view of a label of the answer, by its own method; of one without any, the error over time."""
    return VIEWS.get(label, error_over_time)(seen, label)


def _torque(seen: Seen, label: str) -> EffectView:
    """Torque over what its law looks at: speed for friction, twist for a spring, position for a ripple."""
    number = seen.number(label)
    if number is None:
        return error_over_time(seen, label)
    values, records = seen.fit.values, seen.records
    effect = values.effects[number]
    law = values.law_row(number)
    runs = seen.runs(values)
    units = records[0].units
    q = [run.signals[law] for run in runs]
    torques = [run.torques[law] for run in runs]
    paths: list[Rows] = [lambda rows, run=run: run.slope * through_port(values, effect, rows) for run in runs]  # type: ignore[misc]
    unit = acceleration_of_unit(seen.fit.structure, values, effect, seen.rate)
    sign = -1.0 if label == "friction" else 1.0
    quantity = {"friction": "friction", "torque_ripple": "torque"}.get(label, "torque beside the spring's")
    up, unit_up = (sign, "of its law") if unit is None else (sign * unit, f"{units.output}/s^2")
    over, across, over_unit = _abscissa(effect, units.output, units.input, seen.rate)
    if effect.form.law == K.RIPPLE:
        period = 2 * np.pi / float(effect.values[0])
        q = [np.mod(one, period) for one in q]
        over = f"position within its period of {period:.4g} {units.output}"
    reading = (
        f"{quantity[:1].upper()}{quantity[1:]} over {over}, found as a free function (points, 94 % "
        "intervals), all else as fitted; the line is the law of the answer. Without the effect the points "
        "lie at zero."
    )
    return viewed(seen, q, torques, paths, (quantity, unit_up, over, over_unit, reading), (across, up))


def _abscissa(effect: Effect, output: str, command: str, rate: float) -> tuple[str, float, str]:
    """Name, factor and unit of a law's signal."""
    name, factor, unit = {
        K.BASE_COMMAND: ("speed of the motor", 1.0, command),
        K.BASE_SPEED: ("speed of the load", rate, f"{output}/s"),
        K.BASE_TWIST: ("twist, as the acceleration that it gives", rate**2, f"{output}/s^2"),
        K.BASE_TWIST_RATE: ("speed of the twist, as the jerk that it gives", rate**3, f"{output}/s^3"),
        K.BASE_POSITION: ("position", 1.0, output),
        K.BASE_MOTOR: ("position of the motor", 1.0, output),
    }[effect.form.base]  # fmt: skip
    if effect.looks_at_states:
        name = f"motion of its own, as a {name.replace(',', '').split()[0]}"
    return name, factor, unit


def _without(seen: Seen, number: int) -> list[Simulated]:
    values = seen.fit.values
    kept = tuple(e for i, e in enumerate(values.effects) if i != number)
    response = seen.fit.response
    plain = replace(response, template=kept, weights=None)
    shown = JointValues(values.cascade, kept)
    return [plain.along(shown, number) for number in range(len(seen.records))]


def _reading_error(
    over: Callable[[Seen, Simulated, Effect], tuple[FloatArray, str, str]],
) -> View:
    """Error of the reading over something: position for a wave or unequal gains, time for a drift, speed for
    a play."""

    def view(seen: Seen, label: str) -> EffectView:
        number = seen.number(label)
        if number is None:
            return error_over_time(seen, label)
        values, unit = seen.fit.values, seen.records[0].units.output
        runs, plain = seen.runs(values), _without(seen, number)
        law = [run.y - other.y for run, other in zip(runs, plain, strict=True)]
        found = [over(seen, run, values.effects[number]) for run in runs]
        x, (_, name, over_unit) = [one[0] for one in found], found[0]
        reading = (
            f"Error of the reading over {name}, found as a free function (points, 94 % intervals), all else "
            "as fitted; the line is the law of the answer. Without this effect the points lie at zero."
        )
        paths: list[Rows] = [_as_is for _ in runs]
        return viewed(seen, x, law, paths, ("error of the reading", unit, name, over_unit, reading))

    return view


def _as_is(rows: FloatArray) -> FloatArray:
    return rows


def _by_place(views: Mapping[Place, View]) -> View:
    """The method of where the effect acts: a play with memory alone loses an angle, one with impacts is a
    torque; what has no name is a change of the command, a torque or an error of the reading, or has a turn
    among samples."""

    def view(seen: Seen, label: str) -> EffectView:
        number = seen.number(label)
        if number is None:
            return by_turns(seen, label)
        place = seen.fit.values.effects[number].form.place
        return views.get(place, error_over_time)(seen, label)

    return view


def _position(seen: Seen, run: Simulated, effect: Effect) -> tuple[FloatArray, str, str]:
    unit = seen.records[0].units.output
    for slot, value in zip(effect.form.slots(seen.fit.response.scale), effect.values, strict=True):
        period = 2 * np.pi / float(value) if slot.name == "wavenumber" else np.inf
        if period < 0.7 * np.ptp(run.w):
            return np.mod(run.w, period), f"position within its period of {period:.4g} {unit}", unit
    return run.w, "position", unit


def _time(seen: Seen, run: Simulated, effect: Effect) -> tuple[FloatArray, str, str]:
    del effect
    return np.arange(len(run.w)) / seen.rate, "time from the record's start", "s"


def _speed(seen: Seen, run: Simulated, effect: Effect) -> tuple[FloatArray, str, str]:
    del effect
    return np.gradient(run.w) * seen.rate, "speed of the axis", f"{seen.records[0].units.output}/s"


def _curve(seen: Seen, label: str) -> EffectView:
    """What the drive adds to a command, over that command."""
    number = seen.number(label)
    if number is None:
        return error_over_time(seen, label)
    fit, values = seen.fit, seen.fit.values
    even, odd = values.effects[number].values
    x: list[FloatArray] = []
    paths: list[Rows] = []
    for run, u in zip(seen.runs(values), seen.delayed_commands(), strict=True):
        limited, gain = limited_and_gain(fit.response.packed(values), u, run.w)
        x.append(limited)
        paths.append(
            lambda rows, run=run, gain=gain: run.slope * through_drive(fit.structure, values, rows * gain)  # type: ignore[misc]
        )
    law = [np.abs(one) * (even + odd * one) for one in x]
    unit = seen.records[0].units.input
    reading = (
        "Change of the command by the drive over the command within its limits, found as a free function "
        "(points, 94 % intervals), all else as fitted; the line is the law of the answer. Without the effect "
        "the points lie at zero."
    )
    words = ("change of the command", unit, "command within its limits", unit, reading)
    return viewed(seen, x, law, paths, words)


def _command_side(
    label: str, seen: Seen, run: Simulated, u: FloatArray
) -> tuple[FloatArray, FloatArray, Rows]:
    """Abscissa, law and path of an effect on the command."""
    values, samples = seen.fit.values, len(u)
    drive: Rows = lambda rows: run.slope * through_drive(seen.fit.structure, values, rows)  # noqa: E731
    time = np.arange(samples) / seen.rate
    slots = {
        slot.name: float(value)
        for e in values.effects
        if e.form.label == label
        for slot, value in zip(e.form.slots(seen.fit.response.scale), e.values, strict=True)
    }
    if label == "gain_drift":
        law = slots["change"] * (1 - np.exp(-np.arange(samples) / slots["time"]))
        carrier = run.v / (1 + law)
        return time, law, lambda rows: drive(rows * carrier)
    if label == "saturation_drift":
        cascade = values.cascade
        limit = np.where(run.v > 0, cascade.upper, cascade.lower)
        limit = np.where(np.isfinite(limit), limit, 1.0)
        law = run.v / limit - 1
        clipped = ((u > run.v) & (run.v > 0)) | ((u < run.v) & (run.v < 0))
        return run.w, np.where(clipped, law, 0.0), lambda rows: drive(rows * np.where(clipped, limit, 0.0))
    if label == "rate_limit":
        before = np.concatenate([[0.0], run.v[:-1]])
        asked = np.clip(u, values.cascade.lower, values.cascade.upper) - before
        return asked, run.v - before, lambda rows: drive(np.cumsum(rows, axis=1))
    return time, np.full(samples, slots.get("bias", 0.0)), drive


def _command(seen: Seen, label: str) -> EffectView:
    """Gain over time, limit over position, change of the command reached over that asked for, offset over
    time."""
    if seen.number(label) is None:
        return error_over_time(seen, label)
    runs, delayed = seen.runs(seen.fit.values), seen.delayed_commands()
    parts = [_command_side(label, seen, run, u) for run, u in zip(runs, delayed, strict=True)]
    units, rate = seen.records[0].units, seen.rate
    quantity, unit, over, over_unit, scales = {
        "gain_drift": ("change of the gain", "%", "time from the record's start", "s", (1.0, 100.0)),
        "saturation_drift": ("change of the limit", "%", "position", units.output, (1.0, 100.0)),
        "rate_limit": (
            "change of the command that the drive makes", f"{units.input}/s",
            "change asked for", f"{units.input}/s", (rate, rate),
        ),
    }.get(
        label, ("offset of the command", units.input, "time from the record's start", "s", (1.0, 1.0))
    )  # fmt: skip
    reading = (
        f"{quantity[:1].upper()}{quantity[1:]} over {over}, found as a free function (points, 94 % "
        "intervals), all else as fitted; the line is the law of the answer."
    )
    x, law, paths = ([part[i] for part in parts] for i in range(3))
    return viewed(seen, x, law, paths, (quantity, unit, over, over_unit, reading), scales)  # type: ignore[arg-type]


VIEWS: Mapping[str, View] = MappingProxyType(
    {
        "backlash": _by_place({"law": _torque, "output": _reading_error(_speed)}),
        "rate_limit": _command,
        "saturation_drift": _command,
        "command_bias": _command,
        "gain_drift": _command,
        "cubic_stiffness": _torque,
        "friction": _torque,
        "torque_ripple": _torque,
        "other": _by_place({"input": _curve, "law": _torque, "output": _reading_error(_position)}),
        "encoder_eccentricity": _reading_error(_position),
        "gain_asymmetry": _reading_error(_position),
        "sensor_drift": _reading_error(_time),
        "wind": slow_torque,
        "encoder_quantization": rounding,
        "timing_jitter": late_readings,
        "outliers": glitches,
    }
)
"""The method of every label."""
