"""A MuJoCo axis without a fault is the Hammerstein-Wiener system that its case states, and its faults act."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from plant_axis import drawn_axis

from bayes_hw.plant.case import make_case
from bayes_hw.plant.draws import rms
from bayes_hw.plant.effects.effect import Scales
from bayes_hw.plant.foreign.mechanics import Friction
from bayes_hw.plant.foreign.plant import CATALOGUE, UNNAMED, ForeignPlant, discrete_system
from bayes_hw.plant.foreign.simulation import ForeignAxis, ForeignRun
from bayes_hw.plant.foreign.unnamed import Imbalance
from bayes_hw.plant.kinds import KINDS, LABELS

KIND = replace(KINDS["mujoco"], durations_s=(20.0,), rates_hz=(20.0,))
PLANT = ForeignPlant()


def drawn(seed: int) -> tuple[ForeignAxis, float, list[np.ndarray], Scales]:
    return drawn_axis(PLANT, KIND, seed)


@pytest.mark.parametrize("seed", range(8))
def test_without_a_fault_it_is_the_stated_system(seed: int) -> None:
    """Limits, delay, dead zone and G, of whatever train and loop: exact to rounding."""
    axis, _, commands, _ = drawn(seed)
    y = PLANT.run(axis, commands[0], (1,), []).measured()
    expected = PLANT.nominal_of(axis).simulate(commands[0])
    assert np.max(np.abs(y - expected)) < 1e-8 * np.ptp(expected)


@pytest.mark.slow
def test_shapes_differ() -> None:
    """Direct drives, one and two compliances, loops with and without integral, encoder at motor and load."""
    axes = [drawn(seed)[0].train for seed in range(30)]
    assert {a.motor == a.load for a in axes} == {True, False}
    assert {a.encoder == a.load for a in axes} == {True, False}
    assert {a.loop.kind for a in axes} >= {"P", "PI", "PI+FF"}
    assert len({len(a.inertias) for a in axes}) >= 4


def test_linear_system_keeps_the_angle_of_a_turned_axis() -> None:
    """One integrator: all bodies turned by the same angle stay there."""
    axis = drawn(3)[0]
    a, _, c = discrete_system(axis)
    turned = np.zeros(len(a))
    turned[: len(axis.train.inertias)] = 1.0
    np.testing.assert_allclose(a @ turned, turned, atol=1e-9)
    assert c @ turned == 1.0


@pytest.mark.parametrize("effect", [*CATALOGUE, *UNNAMED], ids=lambda e: e.__name__)
def test_every_fault_changes_the_record_and_more_of_it_more(effect: type) -> None:
    axis, sigma, commands, scales = drawn(4)
    fault = effect.draw(np.random.default_rng(2), scales)
    clean = PLANT.run(axis, commands[0], (1,), []).measured()
    largest = min(fault.largest, 30.0)
    weak, strong = (
        rms([PLANT.run(axis, commands[0], (1,), [(fault, s)]).measured() - clean])
        for s in (0.1 * largest, largest)
    )
    assert np.isfinite(strong)
    assert strong > 1.2 * weak
    assert strong > 0.05 * sigma


def test_labels_are_those_of_the_catalogue() -> None:
    assert tuple(e.label for e in CATALOGUE) == LABELS
    assert {e.label for e in UNNAMED} == {"other"}


def test_dry_friction_holds_a_slow_axis() -> None:
    """Friction above what the loop gives at once lets the axis start late."""
    axis, _, _, scales = drawn(6)
    axis = replace(axis, dead_zone=0.0)
    command = np.full(100, 0.02 * axis.upper)
    free = PLANT.run(axis, command, (1,), []).angle
    fault = replace(Friction.draw(np.random.default_rng(1), scales), detail="coulomb_motor")
    held = PLANT.run(axis, command, (1,), [(fault, 10.0)]).angle
    assert 0 <= held[20] < 0.3 * free[20]


def test_imbalance_is_trimmed_where_the_record_begins() -> None:
    axis, _, _, scales = drawn(6)
    run = ForeignRun(axis, np.zeros(100), (1,))
    Imbalance.draw(np.random.default_rng(1), scales).act(run, 3.0)
    assert np.max(np.abs(run.angles())) < 1e-9


@pytest.mark.slow
def test_case_states_the_gap_that_a_refit_leaves_and_repeats() -> None:
    case, again = (make_case(5, 1, KIND, ["friction"]) for _ in range(2))
    (gap,) = case.truth["gap_over_sigma"]  # type: ignore[misc]
    sigma = case.truth["base"]["noise.sigma"]  # type: ignore[index]
    assert 0.7 < gap < 5.3
    assert case.truth["gap_rms"]["train"] / sigma == pytest.approx(gap, rel=0.25)  # type: ignore[index]
    np.testing.assert_array_equal(case.train[0].measured, again.train[0].measured)
