"""The search for an explanation: finds the effect that is there, both of two, and rounding beside one."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, noisy, simulated_with

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.criticism.residual_diagnostics import leaves_structure
from bayes_hw.gap.effects.catalogue import CommandBias, GainAsymmetry, TransportDelay
from bayes_hw.gap.effects.drive import TorqueRipple, TorqueRippleWithOvertone
from bayes_hw.gap.fit.explanation import with_coloured_noise, with_stochastic
from bayes_hw.gap.fit.fit import evaluated
from bayes_hw.gap.noise.slow_noise import random_walk
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.attribute import Attribution, attribute
from bayes_hw.gap.search.candidate_models import best_of
from bayes_hw.gap.search.state import Search
from bayes_hw.gap.search.strategies import apart, finish_the_best
from bayes_hw.time_budget import at_most

INPUTS = [command(700, 1), command(700, 2)]
BASE = hypothesis(AXIS, INPUTS)
EFFECTS = (TransportDelay(), CommandBias(), GainAsymmetry())


def attribution(measured: Sequence[FloatArray], stochastic: frozenset[str] = frozenset()) -> Attribution:
    return attribute(Search(BASE, measured, EFFECTS, stochastic, np.random.default_rng(5)))


def test_the_effect_that_is_there_is_the_best() -> None:
    """A delay of 1.6 samples; the same seed gives the same evidences."""
    measured = noisy(simulated_with(TransportDelay(), (1.6,), INPUTS))
    found = attribution(measured)
    assert found.best.labels == ("transport_delay",)
    assert found.best.log_evidence > found.base.log_evidence + 50
    again = attribution(measured)
    assert [e.log_evidence for e in again.explanations] == [e.log_evidence for e in found.explanations]


def test_where_nothing_is_missing_nothing_gains_much() -> None:
    found = attribution(noisy(BASE.simulate(BASE.to_values(BASE.prior_means))))
    assert found.best.log_evidence < found.base.log_evidence + 5


def test_rounding_is_held_against_the_response_beside_it() -> None:
    """Readings in steps of eight times the noise of an axis with a delay: both are in one explanation."""
    step = 8 * SIGMA
    measured = [step * np.round(y / step) for y in noisy(simulated_with(TransportDelay(), (1.6,), INPUTS))]
    found = attribution(measured, frozenset({"encoder_quantization"}))
    rounded = [e for e in found.explanations if "encoder_quantization" in e.labels]
    best = max(rounded, key=lambda e: e.log_evidence)
    assert best.labels == ("encoder_quantization", "transport_delay")
    assert abs(best.fit.values[-1] - 1.6) < 0.1


@pytest.mark.parametrize(
    "label", ["encoder_quantization", pytest.param("timing_jitter", marks=pytest.mark.slow)]
)
def test_a_display_that_explains_all_ends_the_search(label: str) -> None:
    """Readings in coarse steps, or one in three repeated, of an axis without a fault in its response: a free
    form would follow some of either, but pairs of responses are not sought."""
    measured = noisy(BASE.simulate(BASE.to_values(BASE.prior_means)))
    rng = np.random.default_rng(6)
    if label == "encoder_quantization":
        measured = [8 * SIGMA * np.round(y / (8 * SIGMA)) for y in measured]
    else:
        measured = [held(y, rng.random(len(y)) < 0.33) for y in measured]
    stages: list[str] = []
    attribute(Search(BASE, measured, EFFECTS, frozenset({label}), rng, tell=stages.append))
    assert "single effects" in stages and not any("pairs" in stage for stage in stages)


def held(y: FloatArray, repeats: BoolArray) -> FloatArray:
    """y with the sample before in the place of those in `repeats`."""
    return y[np.maximum.accumulate(np.where(repeats, 0, np.arange(len(y))))]


class SearchGoesOnError(Exception):
    """Ends a search that has come to where it is told from one that is over."""


@pytest.mark.slow
def test_the_search_goes_on_while_what_would_be_chosen_leaves_structure() -> None:
    """A delay leaves nothing: the search is over, unless the answer would be without it."""
    delayed = hypothesis(AXIS, INPUTS, TransportDelay())
    measured = noisy(delayed.simulate(np.concatenate([BASE.builder.axis.nominal, (1.6,)])))
    effects, rng = (TransportDelay(), CommandBias()), np.random.default_rng(7)

    def until_pairs(stage: str) -> None:
        if stage == "pairs of effects":
            raise SearchGoesOnError

    for chosen, goes_on in ((best_of, False), (lambda found: found[0], True)):
        search = Search(BASE, measured, effects, frozenset({"wind"}), rng, tell=until_pairs, chosen=chosen)
        with pytest.raises(SearchGoesOnError) if goes_on else nullcontext():
            attribute(search)


def test_a_search_without_time_begins_no_strategy_and_says_so() -> None:
    """The base is fitted all the same: there is something to answer with."""
    measured = noisy(BASE.simulate(BASE.to_values(BASE.prior_means)))
    stages: list[str] = []
    rng = np.random.default_rng(8)
    with at_most(0.0):
        found = attribute(Search(BASE, measured, EFFECTS, frozenset(), rng, tell=stages.append))
    assert found.cut_short
    assert stages == ["base model"]
    assert found.best is found.base


def test_nothing_but_noise_in_the_catalogue() -> None:
    """A delay where no effect of the response may be tried: the search ends, whatever is left."""
    delayed = hypothesis(AXIS, INPUTS, TransportDelay())
    measured = noisy(delayed.simulate(np.concatenate([BASE.builder.axis.nominal, (3.0,)])))
    found = attribute(Search(BASE, measured, (), frozenset({"outliers"}), np.random.default_rng(8)))
    assert all(not e.fit.hypothesis.effects for e in found.explanations)


@pytest.mark.slow
def test_a_second_slow_effect_does_not_pass_for_noise() -> None:
    """An offset of the drive beside a delay: a wandering encoder would take it up, and leave nothing."""
    both = hypothesis(AXIS, INPUTS, TransportDelay()).with_effect(CommandBias())
    measured = noisy(both.simulate(np.concatenate([BASE.builder.axis.nominal, (1.6, 8e-4)])))
    found = attribution(measured, frozenset({"sensor_drift"}))
    assert found.best.labels == ("command_bias", "transport_delay")
    assert any(e.labels == ("sensor_drift", "transport_delay") for e in found.explanations)


@pytest.mark.slow
def test_a_richer_form_does_not_pass_for_noise() -> None:
    """A constant torque beside a ripple: slow wind would take it up, but that less wind would do is seen."""
    values = (20.0, 10.0, 0.3, 0.0, 0.0, 30.0)
    measured = noisy(simulated_with(TorqueRippleWithOvertone(), values, INPUTS))
    found = attribute(
        Search(BASE, measured, (TorqueRipple(),), frozenset({"wind"}), np.random.default_rng(5))
    )
    assert found.best.name == "torque_ripple (motor, with overtone)"
    beside_wind = [e for e in found.explanations if e.labels == ("torque_ripple", "wind")]
    assert leaves_structure(max(beside_wind, key=lambda e: e.log_evidence), INPUTS)


def test_an_effect_of_no_size_is_not_ahead_of_the_noise_alone() -> None:
    """A wandering encoder found beside a command bias of nothing: alone, from the same base model, it says as
    much with a parameter less."""
    walks = [np.cumsum(white(len(u), 0.1 * SIGMA, 20 + i)) for i, u in enumerate(INPUTS)]
    clean = noisy(BASE.simulate(BASE.to_values(BASE.prior_means)))
    measured = [y + walk for y, walk in zip(clean, walks, strict=True)]
    labels, rng = frozenset({"sensor_drift"}), np.random.default_rng(5)
    search = Search(BASE, measured, EFFECTS, labels, rng)
    with_bias = hypothesis(AXIS, INPUTS, CommandBias())
    host = evaluated(with_bias, measured, np.append(BASE.prior_means, 1e-9), Plain(SIGMA))
    noise = random_walk(host)
    assert noise is not None
    beside = with_stochastic(noise, host)
    _, alone = apart(search, beside)
    assert beside.labels == ("command_bias", "sensor_drift") and alone.labels == ("sensor_drift",)
    assert alone.log_evidence > beside.log_evidence


def test_an_effect_of_a_pair_is_begun_alone_where_the_pair_found_it() -> None:
    """A delay beside a bias of nothing, the single fits all lost: the delay alone says as much."""
    measured = noisy(simulated_with(TransportDelay(), (1.6,), INPUTS))
    search = Search(BASE, measured, EFFECTS, frozenset(), np.random.default_rng(5))
    search.begin()
    both = hypothesis(AXIS, INPUTS, TransportDelay(), CommandBias())
    start = both.to_coordinates(np.concatenate([BASE.to_values(BASE.prior_means), [1.6, 1e-9]]))
    pair = with_coloured_noise(evaluated(both, measured, start, Plain(SIGMA)), measured)
    search.found.append(pair)
    finish_the_best(search)
    assert set(pair.labels) == {"transport_delay", "command_bias"}
    assert search.best.labels == ("transport_delay",)
    assert search.best.log_evidence > pair.log_evidence
