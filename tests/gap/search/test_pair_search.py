"""The search for two effects: both are found, each part stands for itself."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy, of_records

from bayes_hw.gap.effects.drive import LoadRipple
from bayes_hw.gap.effects.input import CommandBias
from bayes_hw.gap.effects.linear import TransportDelay
from bayes_hw.gap.effects.sensor import GainAsymmetry
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.fit.joint_fits import JointFits
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.pair_search import PairSearch
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(700, 1), command(700, 2)]
BASE = hypothesis(AXIS, INPUTS)
EFFECTS = (TransportDelay(), CommandBias(), GainAsymmetry())
TRUTH = (1.6, 8e-4)


@pytest.fixture(scope="module")
def found() -> tuple[PairSearch, list[Explanation]]:
    both = hypothesis(AXIS, INPUTS, TransportDelay()).with_effect(CommandBias())
    clean = both.simulate(np.concatenate([BASE.builder.axis.nominal, TRUTH]))
    measured = noisy(clean)
    joint = JointFits(measured, Plain(SIGMA), Each(1))
    host = of_records(measured, BASE)
    origin = Screen(host, joint.plain.widened(host.rmse))
    starts = [(host, forms[:1]) for effect in EFFECTS if (forms := origin.candidates(effect))]
    singles = joint.in_two_rounds(starts, len(starts))
    forms = [origin.candidates(effect) for effect in EFFECTS]
    search = PairSearch(BASE, origin, EFFECTS, joint, forms)
    return search, search.first(singles, singles)


def test_both_effects_are_found_at_their_sizes(found: tuple[PairSearch, list[Explanation]]) -> None:
    best = max(found[1], key=lambda e: e.log_evidence)
    assert best.labels == ("command_bias", "transport_delay")
    own = dict(zip(best.fit.hypothesis.labels, best.fit.values[BASE.base_count :], strict=True))
    assert abs(own["transport_delay"] - TRUTH[0]) < 0.05
    assert abs(own["command_bias"] - TRUTH[1]) < 2e-4


def test_a_pair_is_ahead_of_its_parts(found: tuple[PairSearch, list[Explanation]]) -> None:
    search, explanations = found
    best = max(explanations, key=lambda e: e.log_evidence)
    parts = search.parts([best])
    assert {part.labels for part in parts} == {("command_bias",), ("transport_delay",)}
    assert all(part.log_evidence < best.log_evidence - 20 for part in parts)


def test_no_label_stands_beside_itself(found: tuple[PairSearch, list[Explanation]]) -> None:
    assert all(len(set(e.fit.hypothesis.labels)) == len(e.fit.hypothesis.labels) for e in found[1])


def test_without_a_single_fit_the_pair_is_found_too(found: tuple[PairSearch, list[Explanation]]) -> None:
    """With no single fit to begin from: from the starts screened together alone."""
    search, explanations = found
    best = max(explanations, key=lambda e: e.log_evidence)
    alone = search.first([], [])
    assert max(alone, key=lambda e: e.log_evidence).labels == best.labels
    assert max(e.log_evidence for e in alone) == pytest.approx(best.log_evidence, abs=2)


def test_a_periodic_partner_is_found() -> None:
    """An uneven rail beside a delay, from the fit of the delay alone."""
    period = 0.31
    both = hypothesis(AXIS, INPUTS, TransportDelay()).with_effect(LoadRipple())
    clean = both.simulate(np.concatenate([BASE.builder.axis.nominal, (1.6, 4.0, 3.0, period)]))
    measured = noisy(clean)
    effects = (TransportDelay(), LoadRipple())
    delayed = hypothesis(AXIS, INPUTS, TransportDelay())
    start = delayed.to_coordinates(np.append(BASE.builder.axis.nominal, 1.6))
    plain = Plain(SIGMA)
    host = fit(delayed, measured, start, plain)
    origin = Screen(of_records(measured, BASE), plain.widened(host.rmse))
    forms = [origin.candidates(effect) for effect in effects]
    search = PairSearch(BASE, origin, effects, JointFits(measured, plain, Each(1)), forms)
    best = max(search.beside(host, []), key=lambda e: e.log_evidence)
    assert best.labels == ("torque_ripple", "transport_delay")
    assert best.fit.values[-1] == pytest.approx(period, rel=0.01)
