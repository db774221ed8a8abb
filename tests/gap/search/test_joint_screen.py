"""Two effects screened at once: the true pair promises most, and what a pair promises is what it reduces."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy

from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.friction import CoulombFrictionAtMotor
from bayes_hw.gap.effects.input import CommandBias, EarlyRateLimit, RateLimit
from bayes_hw.gap.effects.linear import TransportDelay
from bayes_hw.gap.effects.sensor import GainAsymmetry
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.fit.hypothesis import Candidate
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.joint_screen import (
    FEWEST_TIMES,
    FORMS_OF_A_PAIR,
    MOST_TIMES,
    joint_reductions,
    promising_pairs,
)
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(700, 1), command(700, 2)]
BASE = hypothesis(AXIS, INPUTS)
EFFECTS: tuple[Effect, ...] = (TransportDelay(), CommandBias(), GainAsymmetry(), CoulombFrictionAtMotor())


@pytest.fixture(scope="module")
def screen() -> Screen:
    """That of the base model, its modes as given, of records with a delay and unequal gains."""
    both = hypothesis(AXIS, INPUTS, TransportDelay()).with_effect(GainAsymmetry())
    measured = noisy(both.simulate(np.concatenate([BASE.builder.axis.nominal, (1.6, 1.02)])))
    host = fit(BASE, measured, BASE.prior_means, Plain(SIGMA), free=np.arange(8) < 4)
    return Screen(host, Plain(SIGMA).widened(host.rmse))


def test_the_true_pair_promises_most(screen: Screen) -> None:
    pairs = promising_pairs(screen, [screen.candidates(e) for e in EFFECTS], Each(1))
    assert {c.effect.label for c in pairs[0][1]} == {"transport_delay", "gain_asymmetry"}
    promised = [reduction for reduction, _ in pairs]
    assert promised == sorted(promised, reverse=True)
    assert all(a.effect.label != b.effect.label for _, (a, b) in pairs)


def test_the_best_start_of_every_pair_of_forms(screen: Screen) -> None:
    """Not the best starts of one form: where the forms differ, the other may be the right one."""
    forms = (TransportDelay(), RateLimit(), EarlyRateLimit(), CommandBias())
    pairs = promising_pairs(screen, [screen.candidates(e) for e in forms], Each(1))
    names = [frozenset(c.effect.name for c in pair) for _, pair in pairs]
    assert len(set(names)) == len(names)
    ramps = [pair for _, pair in pairs if {c.effect.label for c in pair} == {"transport_delay", "rate_limit"}]
    assert len(ramps) == FORMS_OF_A_PAIR


def test_one_effect_makes_no_pair(screen: Screen) -> None:
    assert promising_pairs(screen, [screen.candidates(TransportDelay()), []], Each(1)) == []


def test_responses_are_those_of_each_candidate(screen: Screen) -> None:
    candidates = screen.candidates(TransportDelay())[:3]
    together = screen.responses(candidates)
    for column, candidate in enumerate(candidates):
        np.testing.assert_allclose(together[:, column], screen.response(candidate), rtol=1e-9, atol=1e-9)


def test_a_simulation_that_runs_away_responds_with_nothing(screen: Screen) -> None:
    good, *_ = screen.candidates(CommandBias())
    wild = Candidate(good.effect, (1e12,), 0.0)
    found = screen.responses([good, wild])
    assert np.any(found[:, 0] != 0) and not np.any(found[:, 1])


def test_joint_reductions_are_those_of_least_squares_within_their_factors() -> None:
    """Against a fit of either pair of columns, and against the columns as they are where it would scale them
    by more than they may be."""
    rng = np.random.default_rng(1)
    responses = rng.standard_normal((400, 5)) + 0.5 * rng.standard_normal((400, 1))
    residual = responses @ np.array([1.0, 0.7, 1.4, 0.02, -0.8]) + rng.standard_normal(400)
    found = joint_reductions(responses, residual)
    checked = set()
    for i in range(5):
        for j in range(5):
            if i != j:
                two = responses[:, [i, j]]
                times, _, _, _ = np.linalg.lstsq(two, residual, rcond=None)
                fair = bool(np.all((times > FEWEST_TIMES) & (times < MOST_TIMES)))
                left = residual - two @ (times if fair else np.ones(2))
                assert found[i, j] == pytest.approx(residual @ residual - left @ left, rel=1e-6)
                checked.add(fair)
    assert checked == {True, False}
