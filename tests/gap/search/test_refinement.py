"""Effects in forms of more parameters: the one that the records hold is found from the simple one."""

from __future__ import annotations

import numpy as np
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, simulated_with

from bayes_hw.gap.effects.drive import TorqueRipple, TorqueRippleWithOvertone
from bayes_hw.gap.effects.input import CommandBias, EarlyRateLimit, RateLimit
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.refinement import Refinement
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(900, 1), command(900, 2)]
PLAIN = Plain(SIGMA)


def refined(measured: list[np.ndarray], start: Explanation) -> list[Explanation]:
    nominal = fit(hypothesis(AXIS, INPUTS), measured, start.fit.hypothesis.prior_means[:8], PLAIN, 0)
    each = Each(1)
    search = StochasticSearch(measured, frozenset(), SIGMA, each)
    screen = Screen(nominal, PLAIN.widened(nominal.rmse))
    return Refinement(screen, measured, PLAIN, search, each).of([start])


def test_an_overtone_is_found_from_its_fundamental() -> None:
    """Far more likely than the sine alone, its second harmonic as it was."""
    values = (20.0, 10.0, 0.3, 9.0, -7.0, 2.0)
    clean = simulated_with(TorqueRippleWithOvertone(), values, INPUTS)
    measured = [y + white(len(y), SIGMA, i) for i, y in enumerate(clean)]
    simple = hypothesis(AXIS, INPUTS, TorqueRipple())
    start = simple.to_coordinates(np.array([*simple.builder.axis.nominal, 20.0, 10.0, 0.3]))
    sine = with_coloured_noise(fit(simple, measured, start, PLAIN), measured)
    (found,) = refined(measured, sine)
    assert found.name == "torque_ripple (motor, with overtone)" and found.labels == sine.labels
    assert found.log_evidence > sine.log_evidence + 50
    np.testing.assert_allclose(found.fit.values[8:14], values, rtol=0.15, atol=0.6)


def test_a_ramp_is_found_behind_the_limiter_from_one_in_front_of_it() -> None:
    measured = [
        y + white(len(y), SIGMA, i) for i, y in enumerate(simulated_with(RateLimit(), (0.7,), INPUTS))
    ]
    early = hypothesis(AXIS, INPUTS, EarlyRateLimit())
    start = early.to_coordinates(np.array([*early.builder.axis.nominal, 0.7]))
    wrong = with_coloured_noise(fit(early, measured, start, PLAIN), measured)
    (found,) = refined(measured, wrong)
    assert found.name == "rate_limit" and found.labels == wrong.labels
    assert found.log_evidence > wrong.log_evidence + 50
    assert abs(found.fit.values[-1] - 0.7) < 0.05


def test_effects_without_richer_forms_are_left_alone() -> None:
    measured = [y + white(len(y), SIGMA, 3) for y in simulated_with(CommandBias(), (0.003,), INPUTS)]
    found = hypothesis(AXIS, INPUTS, CommandBias())
    done = with_coloured_noise(fit(found, measured, found.prior_means, PLAIN), measured)
    assert refined(measured, done) == []
