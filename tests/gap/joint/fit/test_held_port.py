"""A port that is held to the way of what the loop misreads: the way itself, its descent, its price."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import (
    CASCADE,
    STRUCTURE,
    assert_derivatives,
    command,
    form,
    measured,
    model,
    record,
    response_with,
    scale,
)
from scipy.signal import cont2discrete

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.held_port import HeldResponse, held_ways, nats_lost, numbers_saved
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.joint_forms import AS_READING
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.search.law_exchange import misread
from bayes_hw.identify.growth.descent import evaluate

RIPPLE = form("torque_ripple")
SAMPLES, SEEDS, NOISE = 900, range(12), 1e-3


def _held(numerator: list[float], denominator: list[float]) -> tuple[FloatArray, FloatArray]:
    """Numerator without delay and denominator of a strictly proper system with its input held, by scipy."""
    top, bottom, _ = cont2discrete((numerator, denominator), 1.0)
    return np.asarray(top).ravel()[-(len(denominator) - 1) :], bottom


def test_the_way_is_the_rate_of_the_command_s() -> None:
    """Of a pole and a pair, by the discretisation of s G(s) and s^2 G(s) without what passes at once."""
    pole, damping, squared = 0.3, 0.2, 0.5
    real_top, real_bottom = _held([1.7], [1.0, pole])
    one, two = 0.4, -0.9
    pair_top, pair_bottom = _held([one, two], [1.0, damping, squared])
    cascade = replace(
        CASCADE,
        real=np.array([[-real_bottom[1]], [real_top[0]]]),
        sections=np.array([[-pair_bottom[1]], [pair_bottom[2]], [pair_top[0]], [pair_top[1]]]),
    )
    found = held_ways(JointValues(cascade), 2)
    for power in range(2):
        one, two = two - damping * one, -squared * one
        expected = [
            1.7 * (-pole) ** (power + 1) * real_top[0] / 1.7,
            *_held([one, two], [1.0, damping, squared])[0],
        ]
        np.testing.assert_allclose(found[:-1, power], expected, rtol=1e-9)
    assert not found[-1].any()


def test_a_pole_of_no_continuous_one_passes_its_difference() -> None:
    values = JointValues(replace(CASCADE, real=np.array([[-0.5, 0.0], [2.0, 3.0]])))
    assert held_ways(values, 1)[:2, 0] == pytest.approx([-3.0, -3.0])


def _ripple(weights: FloatArray) -> Effect:
    ports = replace(Ports.none(0, 1), sections=weights[:2].reshape(2, 1))
    return Effect(RIPPLE, np.array([30.0, 0.7]), ports)


def _beside_the_poles() -> Effect:
    """A ripple whose torque moves the reading beside the poles of G."""
    ports = replace(Ports.none(0, 1), direct=np.array([0.006, 0.8]))
    return replace(_ripple(np.zeros(2)), ports=ports)


def _fitted(planted: Effect, seed: int) -> JointFit:
    response, values = response_with((planted,), SAMPLES)
    noise = NOISE * np.random.default_rng(seed).standard_normal(SAMPLES)
    seen = record(response.simulate(values, command(SAMPLES, 1)).y + noise, 1)
    explained = JointResponse(STRUCTURE, (planted,), [seen], scale(SAMPLES))
    begun = JointFit(explained, evaluate(explained, explained.coordinates(JointValues(CASCADE, (planted,)))))
    return begun.descended_under(0, 60)


def test_what_holding_loses_is_chance_where_it_is_true() -> None:
    """Twice the nats are chi-squared: of three weights one is free, so that two degrees are left."""
    planted = _ripple(2.0 * held_ways(JointValues(CASCADE), 1)[:, 0])
    lost = [nats_lost(fit.response, fit.point, 0) for fit in (_fitted(planted, seed) for seed in SEEDS)]
    assert 0.8 < np.mean(2 * np.array(lost)) < 4.0


def test_derivatives_of_what_is_held() -> None:
    """Against central differences; G moves the port with it."""
    response = _fitted(_beside_the_poles(), 1).response
    held = HeldResponse(response, 0)
    assert_derivatives(
        held, np.array([-0.34, 0.31, 0.02, 0.005, 0.9, 0.8, 1e-3, -8e-4, 3.3, 0.7, 2.0]), "held"
    )


def test_the_torque_of_another_way_is_no_reading() -> None:
    fit = _fitted(_beside_the_poles(), 1)
    assert nats_lost(fit.response, fit.point, 0) > 10
    (read,) = misread(fit)
    assert read.labels == ("other",)
    assert read.score < fit.score - 10
    of_port = HeldResponse(read.response, 0)
    assert of_port.is_held(read.point) and not of_port.is_held(fit.point)
    assert nats_lost(read.response, read.point, 0) == 0.0
    ways = held_ways(read.values, 1)
    own = read.point.coordinates[-4:-1]
    np.testing.assert_allclose(own, ways[:, 0] * (own @ ways[:, 0] / np.sum(ways**2)), atol=1e-12)


def test_beside_a_free_g_a_reading_is_as_likely_as_a_torque_at_most() -> None:
    fit = _fitted(_ripple(2.0 * held_ways(JointValues(CASCADE), 1)[:, 0]), 2)
    (read,) = misread(fit)
    assert read.free_count == fit.free_count
    assert fit.score - 3 < read.score <= fit.score + 0.5
    assert read.values.effects[0].form is AS_READING[RIPPLE]
    assert [slot.name for slot in read.values.effects[0].form.slots(scale(SAMPLES))] == [
        "reading_wavenumber",
        "reading_phase",
    ]


def test_a_port_that_is_free_again_is_worth_no_more() -> None:
    """What another descent gains by freeing it does not count."""
    fit = _fitted(_beside_the_poles(), 1)
    (read,) = misread(fit)
    freed = replace(read, point=fit.point)
    assert freed.log_likelihood > read.log_likelihood + 10
    assert freed.score == pytest.approx(read.score, abs=1.0)


def test_around_a_model_a_held_port_counts_by_its_numbers() -> None:
    records = measured((), 300, (1,))
    base = best_base(records, model())
    free = base.with_effect(RIPPLE, (30.0, 0.7))
    held = base.with_effect(AS_READING[RIPPLE], (30.0, 0.7))
    weights = free.structure.real_poles + 2 * free.structure.sections + 2
    assert free.free_count - held.free_count == numbers_saved(held.response) == weights - 2


def test_only_a_ripple_may_be_misread() -> None:
    records = measured((), 300, (1,))
    response = JointResponse(STRUCTURE, (), records, scale(300))
    assert misread(JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))) == []


def test_a_reading_is_begun_over_the_motion_of_g_where_a_free_port_bent_it() -> None:
    """Descents that keep how the port bends it end where less is explained."""
    planted = _ripple(2.0 * held_ways(JointValues(CASCADE), 1)[:, 0])
    response, values = response_with((planted,), SAMPLES)
    noise = NOISE * np.random.default_rng(4).standard_normal(SAMPLES)
    seen = record(response.simulate(values, command(SAMPLES, 1)).y + noise, 1)
    bent = replace(
        planted.ports or Ports.none(0, 1), signal=True, signal_sections=np.array([[80.0], [-80.0]])
    )
    own = replace(planted, ports=bent)
    explained = JointResponse(STRUCTURE, (own,), [seen], scale(SAMPLES))
    fit = JointFit(explained, evaluate(explained, explained.coordinates(JointValues(CASCADE, (own,)))))
    assert fit.point.rms > 1.5 * NOISE
    lost, found = misread(fit)
    assert all(one.values.effects[0].looks_at_states for one in (lost, found))
    assert found.point.rms < 1.05 * NOISE
    assert found.score > lost.score + 10
