"""The strength found leaves the gap that was asked for."""

from __future__ import annotations

import pytest

from bayes_hw.plant.effects.effect import strength_for_gap


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("target", [0.05, 1.0, 300.0])
def test_powers_of_the_strength(power: float, target: float) -> None:
    strength, gap = strength_for_gap(lambda s: 2 * s**power, target)
    assert gap == pytest.approx(target, rel=0.15)
    assert gap == 2 * strength**power


def test_threshold_then_growth() -> None:
    """Nothing below strength 3, as with a limit that is not reached."""
    strength, gap = strength_for_gap(lambda s: max(s - 3.0, 0.0), 0.5)
    assert gap == pytest.approx(0.5, rel=0.15)
    assert strength == pytest.approx(3.5, rel=0.05)


def test_a_gap_out_of_reach_gives_the_closest() -> None:
    _, gap = strength_for_gap(lambda s: min(s, 2.0), 10.0)
    assert gap == 2.0


def test_an_instability_counts_as_too_strong() -> None:
    _, gap = strength_for_gap(lambda s: s if s < 5 else float("inf"), 4.0)
    assert gap == pytest.approx(4.0, rel=0.15)
