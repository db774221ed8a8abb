"""A drive train that model.json states: its torques reach the axis as a simulation of its masses does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvals
from scipy.signal import cont2discrete

from bayes_hw.errors import InputError
from bayes_hw.gap.any_train import needs_ports
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.gap.simulate.physical_train import PhysicalTrain
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.physical import Physical

RATE = 50.0
MASSES = {
    "inertias": [0.8, 1.0, 0.3, 0.2],
    "bearings": [0.02, 0.03, 0.0, 0.0],
    "springs": [
        {"between": [0, 1], "stiffness": 260.0, "damping": 1.2},
        {"between": [1, 2], "stiffness": 150.0, "damping": 0.7},
        {"between": [1, 3], "stiffness": 400.0, "damping": 0.8},
    ],
    "motor": 0,
    "load": 1,
    "sensor": 1,
    "loop": {"kp": 9.0, "ki": 6.0},
}


def model(**physical: object) -> HammersteinWiener:
    """An axis with two appendages, whose train cannot be read back from G, with what its owner knows."""
    known = Physical.from_dict(MASSES)
    kp, n = MASSES["loop"]["kp"], len(MASSES["inertias"])  # type: ignore[index,arg-type]
    b = np.zeros((len(known.a), 1))
    b[n, 0], b[-1, 0] = kp / MASSES["inertias"][0], 1.0  # type: ignore[index]
    a, b, c, *_ = cont2discrete((known.a, b, known.sensor[None], np.zeros((1, 1))), 1 / RATE)
    size = len(a)
    pencil, right = np.zeros((size + 1, size + 1)), np.zeros((size + 1, size + 1))
    pencil[:size, :size], pencil[:size, size:], pencil[size:, :size] = a, b, c
    right[:size, :size] = np.eye(size)
    roots = eigvals(pencil, right)
    zeros = roots[np.argsort(np.where(np.isfinite(roots), np.abs(roots), np.inf))[: size - 1]]
    poles, gain = np.linalg.eigvals(a), float((c @ b)[0, 0])
    poles = np.where(np.abs(poles - 1) < 1e-6, 1.0, poles)
    light = [p for p in poles if p.imag > 0 and -np.log(p).real / abs(np.log(p)) < 0.25]
    modes = [
        {"frequency_hz": abs(s) / (2 * np.pi), "damping_ratio": -s.real / abs(s)}
        for s in (np.log(p) * RATE for p in light)
    ]
    return HammersteinWiener.from_dict(
        {
            "sample_rate_hz": RATE,
            "saturation": {"lower": -1.0, "upper": 1.2},
            "linear": {
                "zeros": [[z.real, z.imag] for z in zeros],
                "poles": [[p.real, p.imag] for p in poles],
                "gain": gain,
                "delay_samples": 0,
            },
            "dominant_modes": modes[:2],
            "dead_zone": {"half_width": 0.001},
            "noise": {"sigma": 0.001},
            "physical": {**MASSES, **physical},
        }
    )


@pytest.mark.parametrize("door", [0, 1])
def test_a_torque_moves_the_sensor_as_it_moves_the_masses(door: int) -> None:
    """The path's steps against a zero-order hold of the masses themselves."""
    axis = model()
    path = ChainBuilder(axis).chain(axis_nominal(axis)).torque_path
    known = Physical.from_dict(MASSES)
    t = np.arange(400) / RATE
    inertia = known.inertias[door]
    a, b, c, *_ = cont2discrete(
        (known.a, known.torques[:, [door]] * inertia, known.sensor[None], np.zeros((1, 1))), 1 / RATE
    )
    x, exact = np.zeros((len(a), 1)), []
    for _ in t:
        exact.append(float((c @ x)[0, 0]))
        x = a @ x + b
    weight = np.where(np.arange(len(path.poles)) < path.real_count, 1.0, 2.0)
    hold = [np.where(p == 0, t, np.expm1(p * t) / np.where(p == 0, 1, p)) for p in path.poles]
    residues = path.inputs[door] * path.outputs[0]
    found = sum(float(k) * (r * h).real for k, r, h in zip(weight, residues, hold, strict=True))
    assert np.allclose(found, exact, rtol=1e-6, atol=1e-9 * np.ptp(exact))


def axis_nominal(axis: HammersteinWiener) -> np.ndarray:
    return np.asarray(ChainBuilder(axis).axis.nominal)


def test_what_is_stated_is_taken_in_place_of_reading_back() -> None:
    axis = model()
    assert isinstance(ChainBuilder(axis).reference, PhysicalTrain)
    assert not needs_ports(axis)
    assert needs_ports(replace(axis, physical=None))


def test_the_modes_of_the_torques_move_with_those_of_g() -> None:
    axis = model()
    builder = ChainBuilder(axis)
    moved = builder.axis.nominal.copy()
    at = builder.axis.names.index("mode1.frequency_hz")
    moved[at] *= 1.03
    torque = builder.chain(moved).torque_path.poles
    command = builder.chain(moved).command_path.poles
    assert all(np.min(np.abs(torque - pole)) < 1e-9 for pole in command if pole != 0)


def test_masses_of_another_axis_are_refused() -> None:
    springs = [{"between": [0, 1], "stiffness": 20.0, "damping": 0.1}, *MASSES["springs"][1:]]  # type: ignore[index]
    with pytest.raises(InputError, match="no mode near"):
        ChainBuilder(model(springs=springs))


def test_a_heavy_resonator_on_the_load_changes_g() -> None:
    """Against the masses with one more body on the load."""
    axis = model()
    chain = ChainBuilder(axis).chain(axis_nominal(axis), Resonator(0.1, 1.3, 0.03))
    hz, zeta, inertia = 1.3, 0.03, 0.1
    omega = 2 * np.pi * hz
    added = {"between": [1, 4], "stiffness": inertia * omega**2, "damping": 2 * zeta * omega * inertia}
    larger = Physical.from_dict(
        {
            **MASSES,
            "inertias": [*MASSES["inertias"], inertia],  # type: ignore[misc]
            "bearings": [*MASSES["bearings"], 0.0],  # type: ignore[misc]
            "springs": [*MASSES["springs"], added],  # type: ignore[misc]
        }
    )
    exact = np.linalg.eigvals(larger.a)
    for pole in chain.command_path.poles:
        if abs(pole) > 0.01:
            assert np.min(np.abs(exact - pole)) < 1e-4 * abs(pole)
