"""Which explanations matter for the next step, told from made-up evidences."""

from __future__ import annotations

from dataclasses import replace

from drive_axis import SIGMA, white
from fitted import SAMPLES, with_residuals

from bayes_hw.gap.effects.catalogue import TransportDelay
from bayes_hw.gap.effects.drive import KinematicBacklash, LoadRipple, TorqueRipple
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.search.candidate_models import (
    CLOSE_PART,
    SLIGHT,
    best_of,
    later,
    leaders,
    may_hide_a_cause,
    with_parts,
    worth_refining,
)

FIT = with_residuals([white(SAMPLES, SIGMA, 0)])
DELAY, PLAY, RIPPLE, OTHER_RIPPLE = TransportDelay(), KinematicBacklash(), TorqueRipple(), LoadRipple()


def explanation(log_evidence: float, *effects: Effect, noise: str = "") -> Explanation:
    """One of `effects` beside slow `noise` of a size, if any."""
    hypothesis = replace(FIT.hypothesis, effects=effects)
    whitener = autoregression(FIT)
    stochastic = StochasticFit(noise, "", whitener, 0.0, {}, size=SIGMA) if noise else None
    return Explanation(replace(FIT, hypothesis=hypothesis), stochastic, log_evidence)


def test_rounding_is_a_fact_and_comes_before_evidence() -> None:
    rounded = explanation(1.0, DELAY, noise="encoder_quantization")
    assert best_of([explanation(9.0, DELAY), rounded]) is rounded
    alone = explanation(9.0, DELAY)
    assert best_of([explanation(1.0, PLAY), alone]) is alone


def test_parts_of_a_pair_come_with_it_where_they_are_close() -> None:
    pair = explanation(500.0, DELAY, PLAY)
    close, far = explanation(501.0 - CLOSE_PART, DELAY), explanation(499.0 - CLOSE_PART, PLAY)
    assert with_parts([far, pair, close]) == [pair, close]


def test_slow_noise_may_hide_a_cause_where_both_are_worth_a_label() -> None:
    both = explanation(100.0, DELAY, noise="wind")
    assert may_hide_a_cause([both, explanation(99.0 - SLIGHT, DELAY), explanation(0.0, noise="wind")])
    assert not may_hide_a_cause([both, explanation(101.0 - SLIGHT, DELAY)])
    assert not may_hide_a_cause([explanation(100.0, noise="wind")])
    assert not may_hide_a_cause([explanation(100.0, DELAY, PLAY)])


def test_the_best_of_every_label_leads() -> None:
    singles = [explanation(float(e), effect) for e, effect in enumerate((DELAY, RIPPLE, OTHER_RIPPLE, PLAY))]
    assert leaders(singles) == [singles[3], singles[2], singles[0]]


def test_later_ones_are_single_and_of_a_new_name() -> None:
    first = explanation(5.0, DELAY)
    new = explanation(3.0, PLAY)
    noisy, pair = explanation(9.0, RIPPLE, noise="wind"), explanation(9.0, RIPPLE, PLAY)
    assert later([explanation(7.0, DELAY), explanation(2.0, PLAY), noisy, pair, new], [first]) == [new]


def test_the_best_by_name_and_the_best_pairs_are_refined_once() -> None:
    found = [explanation(9.0, DELAY), explanation(8.0, DELAY, PLAY), explanation(7.0, RIPPLE, PLAY)]
    found.append(explanation(6.0, RIPPLE))
    assert worth_refining(found) == found[:3]
