"""Fits begun elsewhere: a second peak is left for the higher one near it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, simulated_with

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import TransportDelay
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import FARTHEST, evaluated, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.multistart import Restarts, square_errors
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(700, 1), command(700, 2)]
PLAIN = Plain(SIGMA)
CLEAN = simulated_with(TransportDelay(), (1.6,), INPUTS)
MEASURED = [y + white(len(y), SIGMA, i) for i, y in enumerate(CLEAN)]
BASE = hypothesis(AXIS, INPUTS)


def restarts(measured: list[FloatArray] = MEASURED, plain: Plain = PLAIN) -> Restarts:
    each = Each(1)
    search = StochasticSearch(measured, frozenset(), SIGMA, each)
    return Restarts(BASE, measured, plain, search, each, seed=3)


def explained_at(iterations: int) -> Explanation:
    found = BASE.with_effect(TransportDelay())
    start = found.to_coordinates(np.array([*found.builder.axis.nominal, 0.4]))
    return with_coloured_noise(fit(found, MEASURED, start, PLAIN, iterations), MEASURED, 0)


def test_errors_are_those_of_the_simulation() -> None:
    nominal = BASE.prior_means[None]
    simulated = BASE.simulate(BASE.to_values(nominal)[0])
    expected = sum(np.sum(((y - s) / SIGMA) ** 2) for y, s in zip(MEASURED, simulated, strict=True))
    assert square_errors(BASE, MEASURED, PLAIN, BASE.to_values(nominal))[0] == pytest.approx(expected)


def test_near_an_unfinished_fit_a_better_one_is_found() -> None:
    """From an unfinished delay of 0.4 samples to that of 1.6; the same seed gives the same."""
    begun = explained_at(0)
    (found,) = restarts().near(begun)
    assert found.log_evidence > begun.log_evidence + 100
    assert found.fit.values[-1] == pytest.approx(1.6, abs=0.05)
    (again,) = restarts().near(begun)
    np.testing.assert_array_equal(again.fit.coordinates, found.fit.coordinates)


def test_a_mode_that_ended_far_off_is_begun_again_as_given() -> None:
    """All else as fitted; one that ended near is left where it is."""
    search, found = restarts(), BASE.with_effect(TransportDelay())
    names = [parameter.name for parameter in found.parameters]
    frequency, damping = names.index("mode2.frequency_hz"), names.index("mode2.damping_ratio")
    at = found.to_coordinates(np.array([*found.builder.axis.nominal, 1.6]))
    at[0] += 3 * found.prior_sds[0]
    at[damping] += 0.5 * found.prior_sds[damping]
    host = evaluated(found, MEASURED, at, PLAIN)
    assert search._modes_as_given(host) == []
    off = at.copy()
    off[frequency] += 3 * found.prior_sds[frequency]
    (start,) = search._modes_as_given(evaluated(found, MEASURED, off, PLAIN))
    np.testing.assert_allclose(start, at)


def test_no_fit_is_begun_again_twice() -> None:
    """Neither from where it was begun again before nor from where that led to."""
    search, begun = restarts(), explained_at(0)
    (found,) = search.near(begun)
    assert search.near(begun) == [] and search.near(found) == []
    worse = replace(begun, log_evidence=begun.log_evidence - 1)
    assert len(search.near(worse)) == 1


def test_a_fit_beside_which_the_response_explodes_is_not_begun_again() -> None:
    """Its derivative by one parameter has no square: without curvature no start can be drawn near it."""
    begun = explained_at(0)
    jacobians = [jacobian.copy() for jacobian in begun.fit.jacobians]
    jacobians[0][5, 1] = 4e307
    exploding = replace(begun, fit=replace(begun.fit, jacobians=jacobians))
    with np.errstate(over="ignore", invalid="ignore"):
        assert exploding.fit.ran_away
        assert restarts().near(exploding) == []
    assert not begun.fit.ran_away


def test_every_record_in_turn_is_left_out_of_a_start() -> None:
    """Of two records with delays of 2.4 and 1.6 samples each start holds that of the other; samples that are
    masked anyway stay so."""
    late = simulated_with(TransportDelay(), (2.4,), INPUTS)[0] + white(len(MEASURED[0]), SIGMA, 7)
    late[300] += 1e3 * SIGMA
    masks = tuple(np.zeros(len(y), dtype=np.bool_) for y in MEASURED)
    masks[0][300] = True
    starts = restarts([late, MEASURED[1]], replace(PLAIN, masked=masks))._without_a_record(
        explained_at(4).fit
    )
    delays = [BASE.with_effect(TransportDelay()).to_values(start)[-1] for start in starts]
    assert delays == pytest.approx([1.6, 2.4], abs=0.05)


def test_no_restart_is_farther_off_than_a_fit_may_move(monkeypatch: pytest.MonkeyPatch) -> None:
    """However poorly a parameter is determined: a user's simulator is not asked for the absurd."""
    host = explained_at(4)
    monkeypatch.setattr(type(host.fit), "covariance", lambda fit: 1e6 * np.eye(len(fit.coordinates)))
    asked: list[float] = []
    simulate = type(BASE).simulate_batch

    def watched(self: Hypothesis, values: FloatArray, *given: object) -> list[FloatArray]:
        away = np.abs(self.to_coordinates(values) - self.prior_means) / self.prior_sds
        asked.append(float(away[:, self.base_count :].max()))
        return simulate(self, values, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(type(BASE), "simulate_batch", watched)
    restarts().near(host)
    assert FARTHEST - 1 < max(asked) < FARTHEST + 0.1


def test_nothing_to_restart_without_an_effect() -> None:
    base = with_coloured_noise(fit(BASE, MEASURED, BASE.prior_means, PLAIN, 2), MEASURED, 0)
    assert restarts().near(base) == []


def test_elsewhere_keeps_the_effect_and_draws_the_limits() -> None:
    """Three fits a host, none worse than where it began by far, of the same effects."""
    host = explained_at(6).fit
    found = restarts().elsewhere([host, replace(host)])
    assert len(found) == 6
    assert all(f.hypothesis.labels == ("transport_delay",) for f in found)
    assert min(f.cost for f in found) < 1.05 * host.cost
