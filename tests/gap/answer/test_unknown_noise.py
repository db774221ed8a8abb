"""Where no noise level is given: plain estimates with honest spread, small seconds dropped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from own_simulators import RATE, motor, motor_speed, record, steps
from simulated_records import coloured_noise

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.unknown_noise import (
    of_the_gap,
    plain_estimate,
    with_plain_estimates,
    without_small_seconds,
)
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic
from bayes_hw.gap.effects.any_simulator import DeadZone, UnequalDeadZone
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.input import CommandBias
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import Fit, evaluated, first_sigma, fit, plain_fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.plain_noise import CorrelatedPlain
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder, simulator_scale

U = steps(800, 8, 9.0)
TRUTH = np.array([[33.0, 0.27]])


def measured(lower: float, upper: float, noise: FloatArray) -> list[FloatArray]:
    v = np.maximum(U - upper, 0) + np.minimum(U + lower, 0)
    return [motor_speed(TRUTH, v)[0] + noise]


def base(y: FloatArray) -> Hypothesis:
    scale = simulator_scale(motor(), [record("r", U, y, RATE)], 1.0)
    return Hypothesis(SimulatorBuilder(motor()), scale, [U])


def white(sigma: float) -> FloatArray:
    return np.random.default_rng(9).normal(0, sigma, len(U))


def explained(outputs: list[FloatArray], *effects: Effect) -> Explanation:
    hypothesis = base(outputs[0])
    values = np.array([p.nominal for p in hypothesis.parameters])
    for effect in effects:
        hypothesis = hypothesis.with_effect(effect)
        values = np.concatenate([values, effect.starts(hypothesis.scale)[0]])
    found = fit(hypothesis, outputs, hypothesis.to_coordinates(values), Plain(5.0), 60)
    found = replace(found, whitener=autoregression(found))
    return Explanation(found, None, found.log_evidence())


def test_the_first_noise_is_a_third_of_what_the_base_leaves() -> None:
    outputs = measured(0.0, 0.0, white(2.0))
    assert first_sigma(base(outputs[0]), outputs) == pytest.approx(2.0 / 3, rel=0.06)


def test_the_spread_of_plain_estimates_under_coloured_noise_is_the_true_one() -> None:
    """Gains from 200 records with noise of correlation 0.9 scatter as the precision says, within 15 %."""
    rng = np.random.default_rng(1)
    hypothesis = base(measured(0.0, 0.0, white(1.0))[0])
    start = hypothesis.to_coordinates(np.array([33.0, 0.27]))
    slow = steps(800, 8, 9.0, length=200)
    hypothesis = replace(hypothesis, inputs=[slow])
    clean = motor_speed(TRUTH, slow)[0]
    gains, said = [], []
    for _ in range(200):
        noise = coloured_noise(len(slow), 1.0, 0.9, rng)
        found = fit(hypothesis, [clean + noise], start, Plain(1.0), 6)
        spread: Fit = replace(found, whitener=CorrelatedPlain.of(0.9, found))
        gains.append(found.coordinates[0])
        said.append(np.sqrt(np.linalg.inv(spread.precision())[0, 0]))
    assert np.std(gains) == pytest.approx(np.mean(said), rel=0.15)


def test_unequal_edges_are_taken_where_plain_residuals_ask_for_them() -> None:
    """The label stays; from an explanation by equal edges the form goes to the one that was there."""
    outputs = measured(1.5, 2.5, white(0.5))
    equal, unequal = explained(outputs, DeadZone()), explained(outputs, UnequalDeadZone())
    chosen = plain_estimate(equal, [unequal.fit], outputs)
    assert chosen.labels == ("dead_zone",)
    assert chosen.fit.hypothesis.effects[0].form == "unequal edges"
    np.testing.assert_allclose(chosen.fit.values[2:], [1.5, 2.5], atol=0.03)
    outputs = measured(2.0, 2.0, white(0.5))
    equal, unequal = explained(outputs, DeadZone()), explained(outputs, UnequalDeadZone())
    assert plain_estimate(equal, [unequal.fit], outputs) is equal


def test_parameters_go_back_to_the_plain_fit_that_coloured_noise_left() -> None:
    """An explanation whose plain error has grown by half is not kept."""
    outputs = measured(2.0, 2.0, white(0.5))
    good = explained(outputs, DeadZone())
    away = evaluated(
        good.fit.hypothesis, outputs, good.fit.coordinates + np.array([0.05, 0, 0]), good.fit.whitener
    )
    found = plain_estimate(replace(good, fit=away), (), outputs)
    assert found.fit.rmse == pytest.approx(plain_fit(good.fit, outputs).rmse, rel=1e-4)


def test_a_second_effect_beside_one_that_leaves_little_is_dropped() -> None:
    """Pairs stay where no single label of theirs closes the gap."""
    outputs = measured(2.0, 2.0, white(0.5))
    alone, pair = explained(outputs, DeadZone()), explained(outputs, DeadZone(), CommandBias())
    nothing = explained(outputs)
    attribution = Attribution(nothing, (pair, alone, nothing), (0.0,), ())
    kept = without_small_seconds(attribution, 0.2).explanations
    assert [e.labels for e in kept] == [("dead_zone",), ()]
    bias = explained(outputs, CommandBias())
    attribution = Attribution(nothing, (pair, bias, nothing), (0.0,), ())
    assert without_small_seconds(attribution, 0.2).explanations == attribution.explanations


def test_leftovers_are_shares_of_the_gap() -> None:
    outputs = measured(2.0, 2.0, white(0.5))
    alone, nothing = explained(outputs, DeadZone()), explained(outputs)
    left = [ResidualDiagnostic("step", 50.0, 0.8)]
    (found,) = of_the_gap(left, alone, nothing)
    assert found.size == pytest.approx(0.8 * alone.fit.rmse / nothing.fit.rmse)
    assert of_the_gap(left, nothing, nothing) == left


def test_plain_estimates_stand_wherever_the_explanation_did() -> None:
    """In the decision and among the explanations, base and chosen; the others stay."""
    outputs = measured(2.0, 2.0, white(0.5))
    good, nothing, bias = (
        explained(outputs, DeadZone()),
        explained(outputs),
        explained(outputs, CommandBias()),
    )
    moved = good.fit.coordinates + np.array([0.05, 0, 0])
    away = replace(good, fit=evaluated(good.fit.hypothesis, outputs, moved, good.fit.whitener))
    decision = Decision(away.labels, away, {}, (), {}, {})
    attribution = Attribution(nothing, (away, bias, nothing), (0.0,), (good.fit,))
    found, decided = with_plain_estimates(attribution, decision, outputs)
    assert decided.explanation is found.explanations[0] is not away
    assert decided.explanation.fit.rmse < away.fit.rmse
    assert found.explanations[1] is bias
    assert found.explanations[2] is found.base
