"""Screening: of the whole catalogue the effect that is there promises most, and what it promises is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, simulated_with

from bayes_hw.gap.effects.catalogue import (
    CommandBias,
    CoulombFrictionAtMotor,
    EncoderEccentricity,
    GainAsymmetry,
    KinematicBacklash,
    RateLimit,
    TorqueRipple,
    TransportDelay,
    catalogue,
)
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.simulate.chain_builder import ChainBuilder

INPUTS = [command(600, seed) for seed in (11, 12)]


def base_fit(effect: Effect, values: tuple[float, ...]) -> Fit:
    """The base model fitted to records with an effect that it lacks, its modes as given."""
    measured = [y + white(600, SIGMA, 50 + i) for i, y in enumerate(simulated_with(effect, values, INPUTS))]
    found = hypothesis(AXIS, INPUTS)
    return fit(found, measured, found.prior_means, Plain(SIGMA), free=np.arange(8) < 4)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        (CommandBias(), (0.006,)),
        (TransportDelay(), (1.5,)),
        (KinematicBacklash(), (0.02,)),
        (CoulombFrictionAtMotor(), (25.0, 0.01)),
        (EncoderEccentricity(), (0.012, 0.006, 0.5)),
        (GainAsymmetry(), (1.06,)),
        (RateLimit(), (0.25,)),
        (TorqueRipple(), (30.0, 15.0, 0.3)),
    ],
    ids=lambda value: value.name if isinstance(value, Effect) else "",
)
def test_the_effect_that_is_there_promises_most(effect: Effect, values: tuple[float, ...]) -> None:
    """Its label comes first, or within a tenth of one that does nearly the same (a bias and a ramp)."""
    base = base_fit(effect, values)
    screen = Screen(base, Plain(base.rmse))
    promised = {e.name: max((c.reduction for c in screen.candidates(e)), default=0.0) for e in catalogue()}
    own = max(value for name, value in promised.items() if name.startswith(effect.label))
    best = sorted(promised.items(), key=lambda item: -item[1])[:4]
    assert own > 100 and own >= 0.9 * best[0][1], best


def test_periods_and_amplitudes_are_found() -> None:
    """A scan over periods starts a fit where the truth is."""
    base = base_fit(EncoderEccentricity(), (0.012, 0.006, 0.5))
    best = Screen(base, Plain(base.rmse)).candidates(EncoderEccentricity())[0]
    assert best.values[2] == pytest.approx(0.5, rel=0.05)
    assert np.hypot(*best.values[:2]) == pytest.approx(np.hypot(0.012, 0.006), rel=0.25)


def test_what_the_base_could_do_itself_is_not_promised() -> None:
    """A response in the span of the base tangents promises nothing; an orthogonal one what it removes."""
    base = base_fit(CommandBias(), (0.006,))
    screen = Screen(base, Plain(SIGMA))
    tangent = [jacobian[:, [3]] for jacobian in base.jacobians]
    assert np.abs(screen.project(tangent)).max() < 1e-6 * np.abs(np.concatenate(tangent) / SIGMA).max()
    itself = screen.residual[:, None]
    assert screen.reduction(itself) == pytest.approx(float(screen.residual @ screen.residual), rel=1e-6)


def test_a_residual_of_noise_promises_little() -> None:
    base = base_fit(CommandBias(), (0.0,))
    screen = Screen(base, Plain(SIGMA))
    for effect in (CommandBias(), GainAsymmetry(), KinematicBacklash()):
        assert max(c.reduction for c in screen.candidates(effect)) < 12


def test_small_responses_are_those_of_the_chain() -> None:
    """A pulse of the command as the chain answers it, others by convolution; the output door is itself."""
    found = hypothesis(AXIS, [np.zeros(200)])
    builder = ChainBuilder(AXIS)
    chain = builder.chain(builder.axis.nominal)
    pulse = np.zeros((200, 1))
    pulse[0] = 0.1
    w = found.simulate_signals(builder.axis.nominal, [pulse[:, 0]])[0][0]
    response = chain.small_responses("command", pulse)[:, 0]
    delayed = np.concatenate([np.zeros(AXIS.linear.delay_samples), response])[:200]
    np.testing.assert_allclose(w, delayed, atol=1e-12)
    signals = np.random.default_rng(0).normal(size=(200, 20))
    np.testing.assert_array_equal(chain.small_responses("output", signals), signals)
    expected = np.stack([np.convolve(response / 0.1, s)[:200] for s in signals.T], axis=1)
    np.testing.assert_allclose(chain.small_responses("command", signals), expected, atol=1e-12)


def test_a_torque_between_motor_and_load_is_in_one_path() -> None:
    """That of the load less that of the motor in the ratio of the stiffnesses."""
    builder = ChainBuilder(AXIS)
    chain = builder.chain(builder.axis.nominal)
    signals = np.random.default_rng(1).normal(size=(200, 3))
    on_motor, on_load = (chain.small_responses(door, signals) for door in ("motor_torque", "load_torque"))
    expected = on_load - chain.stiffness[0] / chain.stiffness[1] * on_motor
    found = chain.small_responses("gear_torque", signals)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_a_small_torque_moves_the_axis_by_its_torque_path() -> None:
    """The answer to a torque held at the motor is that of the path's partial fractions."""
    builder = ChainBuilder(AXIS)
    chain = builder.chain(builder.axis.nominal)
    path = chain.torque_path
    t = np.arange(400) / chain.rate
    expected = np.zeros(400)
    for i, (pole, gain) in enumerate(zip(path.poles, path.inputs[0] * path.outputs[0], strict=True)):
        times = 1 if i < path.real_count else 2
        expected += times * np.real(gain * (np.exp(pole * t) - 1) / pole)
    found = chain.small_responses("motor_torque", np.ones((400, 1)))[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_no_error_of_the_reading_is_sought_at_the_step_of_the_rounding() -> None:
    """A torque may be of any period: rounding is no torque."""
    base = base_fit(EncoderEccentricity(), (0.012, 0.006, 0.05))
    scale = replace(base.scale, shortest=0.15)
    rounded = replace(base, hypothesis=replace(base.hypothesis, scale=scale))

    def shortest(seen: Fit, effect: Effect) -> float:
        return min(c.values[-1] for c in Screen(seen, Plain(base.rmse)).candidates(effect, finely=True))

    assert shortest(base, EncoderEccentricity()) < 0.06
    assert shortest(rounded, EncoderEccentricity()) > 0.14
    assert shortest(rounded, TorqueRipple()) == shortest(base, TorqueRipple()) < 0.14
