"""Poles of G that only a torque passes leave G; one that the command needs stays."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.gap.joint.answer.idle_poles import without_idle_poles
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.known_input import KnownInput
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Record

SIGMA, RATE = 0.002, 20.0
PAIR = np.array([0.8 + 0.4j, 0.8 - 0.4j])


def axis(real: list[float], zeros: list[float]) -> HammersteinWiener:
    """Real poles and zeros beside a mode; the torque passes an integrator that stands beside G's own."""
    linear = LinearBlock(
        np.array(zeros, dtype=np.complex128), np.array([1.0, *real, *PAIR], dtype=np.complex128), 0.01, 1
    )
    wind = KnownInput(
        "wind", "torque", 0.02, 2.0, 0.02, "m/s", np.array([1 - 1e-7], dtype=np.complex128),
        np.array([0.125], dtype=np.complex128),
    )  # fmt: skip
    return HammersteinWiener(
        "test", RATE, Saturation(-2.0, 2.0), linear, DeadZone(0.0), noise_sigma=SIGMA, known=(wind,)
    )


@pytest.mark.parametrize(
    ("real", "zeros", "kept"),
    [([1 - 1e-7, 0.9995], [1 - 2e-7, 0.9995001], 0), ([0.7], [], 1), ([0.7, 1 - 1e-7], [1 - 1.5e-7], 1)],
)
def test_only_poles_that_the_command_needs_stay(real: list[float], zeros: list[float], kept: int) -> None:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1, 1, 40), 30)
    wind = np.cumsum(rng.standard_normal(len(u)))
    model = axis(real, zeros)
    y = model.simulate(u, known={"wind": wind}).y + SIGMA * rng.standard_normal(len(u))
    record = Record("test", np.arange(len(u)) / RATE, u, y, RATE, model.units, known={"wind": wind})
    found = without_idle_poles(model, [record], NoiseEstimate(SIGMA, np.zeros(0)))
    assert len(found.linear.poles) == 3 + kept
    left = record.y - found.simulate(u, known={"wind": wind}).y
    assert np.std(left) < 1.02 * SIGMA
    assert np.abs(found.linear.poles - 1).min() < 1e-9
