"""An axis with effects in its drive train, in a position loop: the same motion as in open loop."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import RATE, command, drive_axis, hypothesis
from numba import typeof

from bayes_hw.arrays import FloatArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.simulator import simulate_loop
from bayes_hw.gap.answer.train_axis import TrainLoop
from bayes_hw.gap.effects.catalogue import catalogue
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate import chain_batch
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.controller_kernel import LoopSignals
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SAMPLES = 400
CONTROLLER = Controller("PI", RATE, 0.8, 0.2, rate_of_change_limit=2.0)
REFERENCE = 0.3 * np.sin(np.arange(SAMPLES) / 15)


def base_of(model: HammersteinWiener) -> FloatArray:
    return AxisParameters(model).nominal


def looped(
    model: HammersteinWiener, found: Hypothesis, values: FloatArray, controller: Controller, **given: object
) -> LoopSignals:
    """The loop around draws `values` (draws, size) of a hypothesis."""
    axis = AxisParameters(model)
    plain = AxisDraws.of_values(axis, np.repeat(axis.nominal[:, None], len(values), axis=1))
    draws = AxisDraws(**{**plain.__dict__, "effect": TrainLoop(found, values)})
    return simulate_loop(draws, controller, REFERENCE, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("effect", catalogue(), ids=lambda effect: effect.name)
@pytest.mark.parametrize("delay", [0, 2])
def test_the_loop_moves_as_the_open_axis_does_under_its_command(effect: Effect, delay: int) -> None:
    """Every entry: the command that the loop gave, played to the open chain, gives the same w and y."""
    model = drive_axis(delay=delay)
    found = hypothesis(model, [command(SAMPLES, 1)], effect)
    values = np.append(base_of(model), effect.test_values)
    loop = looped(model, found, values[None], CONTROLLER)
    ((w, y),) = found.simulate_signals(values, [loop.u[0]])
    assert np.ptp(loop.w) > 0.02
    np.testing.assert_allclose(loop.w[0], w, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(loop.y[0], y, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("ratio", [1, 2])
def test_without_effects_it_is_the_plain_loop(ratio: int) -> None:
    """Of several draws at once, with noise, from a start away from zero, a slower controller with a delay."""
    model = drive_axis()
    controller = Controller("PI", RATE / ratio, 0.8, 0.2, delay_samples=ratio - 1)
    values = np.repeat(base_of(model)[None], 3, axis=0)
    values[:, 2] *= 1.0, 1.5, 2.0
    noise = 0.01 * np.random.default_rng(1).standard_normal((3, SAMPLES))
    start = np.array([0.42, 0.40, 0.41])
    found = hypothesis(model, [command(SAMPLES, 1)])
    one = looped(model, found, values, controller, noise=noise, initial_position=start)
    plain = AxisDraws.of_values(AxisParameters(model), np.ascontiguousarray(values.T))
    other = simulate_loop(plain, controller, REFERENCE, noise=noise, initial_position=start)
    for mine, theirs in zip(one, other, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-7, atol=1e-9)


@pytest.mark.compiles("chains")
def test_friction_makes_the_loop_lag() -> None:
    """More than the plain axis: the effect is really in the loop."""
    (effect,) = [e for e in catalogue() if e.name == "friction (Coulomb, load)"]
    model = drive_axis()
    values = np.append(base_of(model), effect.test_values)
    bare = looped(model, hypothesis(model, [command(SAMPLES, 1)]), base_of(model)[None], CONTROLLER)
    found = hypothesis(model, [command(SAMPLES, 1)], effect)
    assert np.abs(looped(model, found, values[None], CONTROLLER).y - bare.y).max() > 1e-4


def test_no_loop_is_of_the_same_type_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the simulator of chains is compiled once for both."""
    given: list[object] = []
    monkeypatch.setattr(chain_batch, "simulate_lanes", lambda *arguments: given.append(arguments[-1]))
    model = drive_axis()
    looped(model, hypothesis(model, [command(SAMPLES, 1)]), base_of(model)[None], CONTROLLER)
    assert [typeof(one) for one in given] == [typeof(chain_batch.OPEN)]
