"""Faults of the drive and of its loop are found as what they are, and named by no entry of the catalogue."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from joint_axis import assert_tangents, command, response_with, scale, torque
from scipy.linalg import eigvals

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.forms.drive_forms import DRIVE_FORMS, UNNAMED_OVER_POSITION
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import TURNS_SEEN
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.search.laws_of_states import every_law
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units

SAMPLES, RATE, STEPS, NOISE = 500, 20.0, 20, 2e-4
MOTOR, LOAD, SPRING, DAMPING, KP, KI = 0.5, 1.0, 60.0, 0.8, 5.0, 4.0


def stepped(x: FloatArray, v: float, drive: Callable[[float], float]) -> FloatArray:
    """One fine step of motor, spring and load behind a proportional-integral loop whose drive gives `drive`
    of the demand."""
    dt = 1 / (RATE * STEPS)
    motor, load, motor_speed, load_speed, integral = x
    twist = SPRING * (motor - load) + DAMPING * (motor_speed - load_speed)
    given = drive(KP * (v - motor_speed) + KI * integral)
    motor_speed += dt * (given - twist) / MOTOR
    load_speed += dt * twist / LOAD
    return np.array(
        [
            motor + dt * motor_speed,
            load + dt * load_speed,
            motor_speed,
            load_speed,
            integral + dt * (v - x[2]),
        ]
    )


def axis() -> HammersteinWiener:
    """What the axis is while its drive gives what is asked for."""

    def sample(x: FloatArray, v: float) -> FloatArray:
        for _ in range(STEPS):
            x = stepped(x, v, float)
        return x

    a = np.column_stack([sample(unit, 0.0) for unit in np.eye(5)])
    b, c = sample(np.zeros(5), 1.0), np.eye(5)[1]
    pencil, right = np.zeros((6, 6)), np.diag([1.0] * 5 + [0.0])
    pencil[:5, :5], pencil[:5, 5], pencil[5, :5] = a, b, c
    roots = eigvals(pencil, right)
    zeros = roots[np.argsort(np.where(np.isfinite(roots), np.abs(roots), np.inf))[:4]]
    poles = np.linalg.eigvals(a)
    poles[np.argmin(np.abs(poles - 1))] = 1.0
    return HammersteinWiener.from_dict(
        {
            "sample_rate_hz": RATE,
            "saturation": {"lower": -0.35, "upper": 0.3},
            "linear": {
                "zeros": [[z.real, z.imag] for z in zeros],
                "poles": [[p.real, p.imag] for p in poles],
                "gain": float(c @ b),
                "delay_samples": 0,
            },
            "dead_zone": {"half_width": 0.001},
            "noise": {"sigma": NOISE},
        }
    )


def records(drive: Callable[[float], float]) -> list[Record]:
    """The axis with this drive, its load read with noise."""
    found = []
    for seed in (1, 2):
        u = command(SAMPLES, seed)
        x, w = np.zeros(5), np.empty(SAMPLES)
        for k, v in enumerate(np.clip(u, -0.35, 0.3)):
            w[k] = x[1]
            for _ in range(STEPS):
                x = stepped(x, float(v), drive)
        y = np.sign(w) * np.maximum(np.abs(w) - 0.001, 0.0)
        y += NOISE * np.random.default_rng(seed).standard_normal(SAMPLES)
        found.append(Record(f"r{seed}", np.arange(SAMPLES) / RATE, u, y, RATE, Units()))
    return found


@pytest.mark.parametrize("form", DRIVE_FORMS, ids=lambda form: form.name)
def test_tangents_are_those_of_the_response(form: Form) -> None:
    start = form.starts(scale(SAMPLES))[0]
    response, values = response_with((torque(form, start, 2e-4),), SAMPLES)
    assert_tangents(response, values, form.full_name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "drive", "demand"),
    [
        ("torque limit of the drive", lambda asked: min(max(asked, -2.0), 2.0), 2.0),
        ("dead band of the drive", lambda asked: np.sign(asked) * max(abs(asked) - 0.03, 0.0), 0.03),
    ],
    ids=["limit", "dead band"],
)
def test_a_fault_of_the_drive_has_no_name(name: str, drive: Callable[[float], float], demand: float) -> None:
    """Nothing of the catalogue explains it as well, its demand is found in units of the command, and nothing
    is left."""
    with np.errstate(all="ignore"):
        base = best_base(records(drive), axis())
        found = every_law(base)
    best = max(found, key=lambda fit: fit.score)
    assert best.names == (f"other ({name}) over a motion of its own",)
    assert best.point.whitener.order == 0
    assert best.score > base.score + 300
    assert float(best.values.effects[0].values[0]) == pytest.approx(demand / KP, rel=0.25)


def test_what_is_periodic_is_seen_often_enough() -> None:
    form = next(form for form in DRIVE_FORMS if form.name == "speed reading over position")
    size = scale(SAMPLES)
    longest = size.travel / TURNS_SEEN * (1 + 1e-9)
    assert all(2 * np.pi / start[0] <= longest for start in form.starts(size))
    assert 2 * np.pi / form.slots(size)[0].lower <= longest
    assert form in UNNAMED_OVER_POSITION
