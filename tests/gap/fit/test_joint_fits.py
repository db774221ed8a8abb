"""Joint fits: of candidates begun far off, the right one ends at the truth and comes first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy, of_records

from bayes_hw.gap.effects.input import CommandBias
from bayes_hw.gap.effects.linear import TransportDelay
from bayes_hw.gap.effects.sensor import GainAsymmetry
from bayes_hw.gap.fit import joint_fits
from bayes_hw.gap.fit.explanation import with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, evaluated
from bayes_hw.gap.fit.hypothesis import Candidate
from bayes_hw.gap.fit.joint_fits import JointFits, candidate_of, cheapest_of_each, joined, part_of
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(700, 1), command(700, 2)]
BASE = hypothesis(AXIS, INPUTS)
DELAY = 1.6


@pytest.fixture(scope="module")
def fits() -> tuple[JointFits, list[Fit]]:
    """Fits to an axis with a delay, one a candidate: delays from two starts, a bias, an asymmetry."""
    truth = np.concatenate([BASE.builder.axis.nominal, [DELAY]])
    clean = hypothesis(AXIS, INPUTS, TransportDelay()).simulate(truth)
    measured = noisy(clean)
    joint = JointFits(measured, Plain(SIGMA), Each(1))
    host = of_records(measured, BASE)
    candidates = [
        Candidate(TransportDelay(), (0.7,), 0.0),
        Candidate(TransportDelay(), (2.5,), 0.0),
        Candidate(CommandBias(), (1e-4,), 0.0),
        Candidate(GainAsymmetry(), (1.01,), 0.0),
    ]
    return joint, joint.in_two_rounds([(host, [candidate]) for candidate in candidates], 3)


def test_the_effect_that_is_there_comes_first_at_its_true_size(fits: tuple[JointFits, list[Fit]]) -> None:
    _, found = fits
    candidate = candidate_of(found[0])
    assert candidate.effect.label == "transport_delay"
    assert abs(candidate.values[0] - DELAY) < 0.02
    assert found[0].rmse < 1.02 * SIGMA < found[1].rmse


@pytest.mark.parametrize("number", [0, 1, -1])
def test_a_part_keeps_the_base_and_its_own_numbers(fits: tuple[JointFits, list[Fit]], number: int) -> None:
    """It is what each effect was joined from."""
    joint, found = fits
    host = evaluated(BASE, joint.measured, found[0].coordinates[: BASE.base_count], joint.plain)
    two = [Candidate(CommandBias(), (1e-4,), 0.0), Candidate(GainAsymmetry(), (1.01,), 0.0)]
    both, coordinates = joined(host, two)
    hypothesis, part = part_of(evaluated(both, joint.measured, coordinates, joint.plain), number, BASE)
    alone, own = joined(host, [two[number]])
    assert hypothesis.labels == alone.labels
    np.testing.assert_allclose(part, own)


def test_every_combination_stands_once_best_first(fits: tuple[JointFits, list[Fit]]) -> None:
    _, found = fits
    assert sorted(f.hypothesis.labels[0] for f in found) == [
        "command_bias",
        "gain_asymmetry",
        "transport_delay",
    ]
    assert [f.cost for f in found] == sorted(f.cost for f in found)
    assert cheapest_of_each([*found, *found]) == found


def test_several_candidates_are_fitted_together(fits: tuple[JointFits, list[Fit]]) -> None:
    joint, found = fits
    host = of_records(list(joint.measured), BASE)
    both = [Candidate(TransportDelay(), (1.0,), 0.0), Candidate(CommandBias(), (1e-4,), 0.0)]
    (pair,) = joint.in_two_rounds([(host, both)], 1)
    assert pair.hypothesis.labels == ("transport_delay", "command_bias")
    assert pair.rmse <= found[0].rmse * 1.0001


def test_a_fit_that_is_behind_goes_on_for_what_it_promises(
    fits: tuple[JointFits, list[Fit]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of starts not yet fitted the nearest is the wrong effect; the right one is finished all the same."""
    monkeypatch.setattr(joint_fits, "FIRST_ITERATIONS", 0)
    joint, _ = fits
    host = of_records(joint.measured, BASE)
    wrong = [Candidate(CommandBias(), (bias,), 0.0) for bias in (1e-6, 2e-6)]
    right = Candidate(TransportDelay(), (6.0,), 0.0)
    found = joint.in_two_rounds([(host, [c]) for c in [*wrong, right]], 1)
    assert candidate_of(found[0]).effect.label == "transport_delay"
    assert abs(candidate_of(found[0]).values[0] - DELAY) < 0.02


def test_fits_of_one_minimum_are_explained_once(fits: tuple[JointFits, list[Fit]]) -> None:
    """By the explanation of the first; another minimum and another combination have their own."""
    joint, found = fits
    fresh = JointFits(joint.measured, joint.plain, joint.each)
    same = replace(found[0], cost=found[0].cost + 0.5 * joint_fits.SAME)
    elsewhere = replace(found[0], cost=found[0].cost + 2 * joint_fits.SAME)
    first, second, other, third = fresh.explained([found[0], same, found[1], elsewhere])
    assert first is second and third is not first
    direct = with_coloured_noise(found[0], joint.measured)
    assert first.log_evidence == direct.log_evidence
    assert other.labels == found[1].hypothesis.labels
    assert fresh.explained([found[1]]) == [other]


def test_a_fit_on_its_way_to_a_known_minimum_is_not_finished(fits: tuple[JointFits, list[Fit]]) -> None:
    """The known fit stands in its place; one that promises better goes on."""
    joint, _ = fits
    host = of_records(joint.measured, BASE)
    fresh = JointFits(joint.measured, joint.plain, joint.each)
    start = [(host, [Candidate(TransportDelay(), (1.2,), 0.0)])]
    (first,) = fresh.in_two_rounds(start, 1)
    (again,) = fresh.in_two_rounds(start, 1)
    assert again is first
    (minimum,) = fresh.known[frozenset(("transport_delay",))]
    minimum.fit = replace(first, cost=first.cost + 5)
    (better,) = fresh.in_two_rounds(start, 1)
    assert better.cost == pytest.approx(first.cost, abs=0.05)
