"""Effects sought on the stretches that fit best: a pair is found where one stretch goes its own way."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy, of_records

from bayes_hw.gap.effects.input import CommandBias
from bayes_hw.gap.effects.linear import CubicStiffness, TransportDelay
from bayes_hw.gap.effects.sensor import GainAsymmetry
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.search.trimmed_search import TrimmedSearch
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(900, 1), command(900, 2)]
BASE = hypothesis(AXIS, INPUTS)
EFFECTS = (TransportDelay(), CommandBias(), GainAsymmetry(), CubicStiffness())
DELAY, RATIO = 1.6, 1.06


@pytest.fixture(scope="module")
def found() -> list[Explanation]:
    both = hypothesis(AXIS, INPUTS, TransportDelay()).with_effect(GainAsymmetry())
    measured = noisy(both.simulate(np.concatenate([BASE.builder.axis.nominal, (DELAY, RATIO)])))
    measured[0][400:470] += 40 * SIGMA
    origin = of_records(measured, BASE)
    plain = Plain(SIGMA)
    screen = Screen(origin, plain.widened(origin.rmse))
    forms = [screen.candidates(effect) for effect in EFFECTS]
    return TrimmedSearch(origin, measured, EFFECTS, plain, Each(1)).run(forms)


def test_the_pair_is_found_beside_a_stretch_that_goes_its_own_way(found: list[Explanation]) -> None:
    best = max(found, key=lambda e: e.log_evidence)
    assert best.labels == ("gain_asymmetry", "transport_delay")
    own = dict(zip(best.fit.hypothesis.labels, best.fit.values[BASE.base_count :], strict=True))
    assert own["gain_asymmetry"] == pytest.approx(RATIO, abs=0.012)
    assert own["transport_delay"] == pytest.approx(DELAY, abs=0.25)


def test_singles_and_pairs_come_back_none_with_itself(found: list[Explanation]) -> None:
    assert {len(e.labels) for e in found} == {1, 2}
    assert all(len(set(e.fit.hypothesis.labels)) == len(e.fit.hypothesis.effects) for e in found)
    assert len({e.name for e in found}) == len(found)
