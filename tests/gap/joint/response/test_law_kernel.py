"""Laws of torques: derivatives against differences, and friction that is solved for."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.law_kernel import held_back, law_of, torque_of_memory

LAWS = {
    "Coulomb": K.COULOMB, "Stribeck": K.STRIBECK, "bristle": K.BRISTLE, "ripple": K.RIPPLE, "cubic": K.CUBIC,
    "gap": K.GAP, "excess": K.EXCESS, "modulated": K.MODULATED, "drag": K.DRAG, "slip": K.SLIP,
}  # fmt: skip
STEP = 1e-6


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("q", [-1.3, -0.2, 0.3, 1.7])
def test_derivatives_are_those_of_the_value(law: int, q: float) -> None:
    at = np.array([q, 0.4, 0.6, 0.3, 0.8, 0.2])
    with_memory = law in (K.BRISTLE, K.SLIP)

    def value(x: np.ndarray) -> float:
        torque, memory, *_ = law_of(law, *x, 0.5, False)
        return float(memory if with_memory else torque)

    _, _, by_q, by_w, by_t0, by_t1, by_t2, by_memory = law_of(law, *at, 0.5, True)
    for i, given in enumerate((by_q, by_w, by_t0, by_t1, by_t2, by_memory)):
        step = STEP * np.eye(6)[i]
        assert given == pytest.approx((value(at + step) - value(at - step)) / (2 * STEP), abs=1e-7)


@pytest.mark.parametrize("law", [K.BRISTLE, K.SLIP])
def test_a_torque_follows_its_memory(law: int) -> None:
    """By both derivatives, over a step in which the memory does not change of itself."""
    grip = 0.6
    torque, memory, *_ = law_of(law, 0.0, 0.0, grip, 0.0, 0.0, 0.2, 1.0, False)
    by_memory, by_grip = torque_of_memory(law, memory, grip)
    other, *_ = law_of(law, 0.0, 0.0, grip, 0.0, 0.0, 0.2 + STEP, 1.0, False)
    wider, *_ = law_of(law, 0.0, 0.0, grip + STEP, 0.0, 0.0, 0.2, 1.0, False)
    assert by_memory == pytest.approx((other - torque) / STEP, rel=1e-4)
    assert by_grip == pytest.approx((wider - torque) / STEP, abs=1e-4)


@pytest.mark.parametrize("speed", [-0.9, -0.05, 0.08, 1.2])
@pytest.mark.parametrize("stribeck", [False, True])
def test_friction_that_holds_has_the_derivatives_of_its_value(speed: float, stribeck: bool) -> None:
    at = np.array([speed, 0.3, 0.1, 0.7, 0.5])
    torque, *slopes = held_back(*at, stribeck)
    assert abs(torque) <= 1 + 0.7 * stribeck
    for i, slope in enumerate(slopes):
        step = STEP * np.eye(5)[i]
        above, below = held_back(*(at + step), stribeck)[0], held_back(*(at - step), stribeck)[0]
        assert slope == pytest.approx((above - below) / (2 * STEP), abs=1e-7)


def test_friction_stops_a_load_within_the_step() -> None:
    """A torque that changes the step's speed by ten times it leaves next to nothing of it."""
    torque, *_ = held_back(0.1, 1.0, 1e-3, 0.0, 1.0, False)
    assert abs(0.1 + torque) < 2e-4
