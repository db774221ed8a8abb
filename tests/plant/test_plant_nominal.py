"""Without a fault the plant is the system that its model.json says; refits find it again."""

from __future__ import annotations

import numpy as np
import pytest
from plant_axes import an_axis

from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.plant.excitation import FAMILIES
from bayes_hw.plant.nominal import nominal_of, refit
from bayes_hw.plant.run import Run


@pytest.mark.parametrize(("seed", "rate"), [(1, 10.0), (2, 20.0), (3, 50.0), (4, 200.0)])
@pytest.mark.parametrize("excitation", ["steps_and_triangles", "pink_multisine"])
def test_plant_without_faults_is_its_model_json(seed: int, rate: float, excitation: str) -> None:
    """The integrated equations and bayes_hw's own simulation of model.json agree to 1e-8 deg."""
    axis = an_axis(seed, rate)
    command = 0.42 * FAMILIES[excitation](np.random.default_rng(seed), rate, round(60 * rate))
    run = Run(axis, command, (seed,))
    integrated = run.read(run.angles()).measured()
    model = HammersteinWiener.from_dict(nominal_of(axis).to_dict("axis", 0.01))
    assert np.ptp(integrated) > 0.2
    assert np.abs(integrated - model.simulate(command).y).max() < 1e-8
    assert np.abs(integrated - nominal_of(axis).simulate(command)).max() < 1e-8


def test_order_and_modes() -> None:
    """One integrator, two real poles of the velocity loop, two light modes, and as many zeros less one."""
    system = nominal_of(an_axis(5))
    assert len(system.poles()) == 7
    assert len(system.zeros) == 6
    assert system.fixed_poles[np.argmax(np.abs(system.fixed_poles))] == pytest.approx(1.0, abs=0)
    assert [f for f, _ in system.modes] == sorted(f for f, _ in system.modes)


def test_refit_finds_a_misjudged_base_again() -> None:
    """From 3 % off in limits and gain and 20 % in damping to a thousandth of the misfit, without noise."""
    axis = an_axis(6)
    true = nominal_of(axis)
    rng = np.random.default_rng(8)
    commands = [0.5 * FAMILIES[name](rng, 20.0, 2400) for name in ("modulated_sweep", "steps_and_triangles")]
    outputs = [true.simulate(u) for u in commands]
    off = true.with_vector(true.vector() * np.array([1.03, 0.97, 1.2, 1.03, 1.02, 0.8, 0.99, 1.2]))
    before = np.concatenate([off.simulate(u) for u in commands]) - np.concatenate(outputs)
    fitted = refit(off, commands, outputs)
    after = np.concatenate([fitted.simulate(u) for u in commands]) - np.concatenate(outputs)
    assert np.std(after) < 1e-3 * np.std(before)
