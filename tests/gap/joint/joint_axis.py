"""A small axis for the tests of the joint search, with records that a test may give any effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.identify.growth.descent import Response
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import Mode
from bayes_hw.record import Record, Units

RATE, SIGMA = 20.0, 0.002
SAMPLES, GIVEN_SAMPLES = 400, 700
STRUCTURE = Structure(1, True, 0, 1, lower=True, upper=True, dead_zone=True)
CASCADE = CascadeValues(
    -0.35, 0.3, 0.02, 0.0, 0.005, np.zeros((2, 0)),
    np.array([[1.5], [0.9], [1e-3], [-8e-4]]), np.zeros((1, 3)),
)  # fmt: skip


def command(samples: int, seed: int) -> FloatArray:
    """Steps held for a second."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-0.5, 0.5, samples // 20 + 1), 20)[:samples]


def record(y: FloatArray, seed: int) -> Record:
    """Of angles (samples,) under `command`."""
    return Record(f"r{seed}", np.arange(len(y)) / RATE, command(len(y), seed), y, RATE, Units())


def scale(samples: int) -> JointScale:
    return JointScale(0.3, 0.005, 1.5, SIGMA, samples, RATE)


def form(label: str, name: str = "") -> Form:
    return next(f for f in FORMS if f.label == label and f.name == name)


def response_with(effects: tuple[Effect, ...], samples: int) -> tuple[JointResponse, JointValues]:
    """The axis with effects on one record of nothing."""
    response = JointResponse(STRUCTURE, effects, [record(np.zeros(samples), 1)], scale(samples))
    return response, JointValues(CASCADE, effects)


def measured(effects: tuple[Effect, ...], samples: int, seeds: tuple[int, ...]) -> list[Record]:
    """Records of the axis with effects and white noise."""
    response, values = response_with(effects, samples)
    found = []
    for seed in seeds:
        noise = SIGMA * np.random.default_rng(seed + 100).standard_normal(samples)
        found.append(record(response.simulate(values, command(samples, seed)).y + noise, seed))
    return found


def torque(law: Form, start: tuple[float, ...], weight: float, seen: float = 0.02) -> Effect:
    """A torque through a port of some weights, its law looking at the states with weight `seen`."""
    ports = Ports(
        np.zeros(0), np.array([[weight], [-0.5 * weight]]), np.array([0.3 * weight, 0.4]),
        np.zeros(0), np.array([[seen], [-0.5 * seen]]), True,
    )  # fmt: skip
    return Effect(law, np.array(start), ports)


def some_effect(law: Form) -> Effect:
    """The form at a strength that shows."""
    start = law.starts(scale(SAMPLES))[0]
    if law.is_law:
        of_twist = law.base in (K.BASE_TWIST, K.BASE_TWIST_RATE)
        stiff = law.label in ("cubic_stiffness", "other") or of_twist
        return torque(law, start, 1e-10 if stiff else 2e-4, 1e-5 if stiff else 0.02)
    slots = law.slots(scale(SAMPLES))
    values = [x + (0.01 if slot.lower < x else 0.02) for x, slot in zip(start, slots, strict=True)]
    return Effect(law, np.array(values))


def assert_tangents(response: JointResponse, values: JointValues, what: str) -> None:
    """Against central differences, at all but the few measured samples where a limit, a play or a clip
    begins."""
    assert_derivatives(response, response.coordinates(values), what)


def assert_derivatives(response: Response, x: FloatArray, what: str) -> None:
    """The same at coordinates (size,) of any response."""
    ((rows, _, _),) = response.linearise(x, 0)
    for i in range(len(x)):
        step = 1e-6 * max(abs(x[i]), 1e-2)
        above, below = x.copy(), x.copy()
        above[i] += step
        below[i] -= step
        expected = (response.residuals(below)[0] - response.residuals(above)[0]) / (2 * step)
        error = np.nanquantile(np.abs(rows[i] - expected), 0.97)
        assert error <= 2e-3 * np.nanmax(np.abs(expected)) + 1e-8, (what, i)


def model(lower: float = -0.35, upper: float = 0.3, gain: float = 1.0) -> HammersteinWiener:
    """The axis as a model.json has it, off by these."""
    linear = linear_block(STRUCTURE, CASCADE)
    mode = Mode.from_pole(next(p for p in linear.poles if p.imag > 0), RATE)
    return HammersteinWiener(
        "given",
        RATE,
        Saturation(lower, upper),
        replace(linear, gain=gain * linear.gain),
        DeadZone(0.03),
        (mode,),
        SIGMA,
    )
