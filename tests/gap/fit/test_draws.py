"""Posterior draws of an explanation: moments of its Laplace approximation, the same of one seed."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, simulated_with

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import TransportDelay
from bayes_hw.gap.fit import draws
from bayes_hw.gap.fit.draws import posterior_draws
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(600, 1)]


@pytest.fixture(scope="module")
def explanation() -> Explanation:
    measured = [y + white(600, SIGMA, 1) for y in simulated_with(TransportDelay(), (1.2,), INPUTS)]
    found = hypothesis(AXIS, INPUTS, TransportDelay())
    done = fit(found, measured, found.prior_means, Plain(SIGMA, 0.0))
    return Explanation(done, None, 0.0)


def test_draws_stand_about_the_fit(explanation: Explanation) -> None:
    """Means within half a standard deviation; spreads to a third where the record and not the prior tells."""
    drawn = posterior_draws(explanation, np.random.default_rng(2))
    coordinates, values = drawn.coordinates, drawn.values
    done = explanation.fit
    errors = np.sqrt(np.diag(np.linalg.inv(done.precision())))
    assert len(coordinates) == len(values) >= 500
    assert (np.abs(coordinates.mean(axis=0) - done.coordinates) < 0.5 * errors).all()
    told = errors < 0.5 * done.hypothesis.prior_sds
    assert told.sum() >= 6
    assert coordinates.std(axis=0)[told] == pytest.approx(errors[told], rel=0.35)
    np.testing.assert_allclose(done.hypothesis.to_values(coordinates[7]), values[7])


def test_same_seed_same_draws(explanation: Explanation) -> None:
    one, two, other = (posterior_draws(explanation, np.random.default_rng(s)).coordinates for s in (3, 3, 4))
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


@pytest.mark.slow
def test_draws_do_not_depend_on_how_many_threads_share_them(explanation: Explanation) -> None:
    """Not even where there are more threads than points."""
    one, many = (
        posterior_draws(explanation, np.random.default_rng(3), each=Each(jobs)).coordinates
        for jobs in (1, 40)
    )
    np.testing.assert_array_equal(one, many)


def test_a_rough_density_is_told_by_the_normal_one(
    explanation: Explanation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Under ripples of hundreds of nats a few points had all the weight, and every interval was theirs."""
    smooth = draws.PosteriorDensity.__call__

    def rough(self: draws.PosteriorDensity, points: FloatArray) -> FloatArray:
        return np.asarray(smooth(self, points) + 200 * np.sin(1e5 * points).sum(axis=1))

    monkeypatch.setattr(draws.PosteriorDensity, "__call__", rough)
    done = explanation.fit
    errors = np.sqrt(np.diag(np.linalg.inv(done.precision())))
    drawn = posterior_draws(explanation, np.random.default_rng(2)).coordinates
    told = errors < 0.5 * done.hypothesis.prior_sds
    assert drawn.std(axis=0)[told] == pytest.approx(errors[told], rel=0.2)
    apart = done.coordinates + 3 * errors
    wider = posterior_draws(explanation, np.random.default_rng(2), [apart]).coordinates
    assert (wider.std(axis=0)[told] > 2.5 * errors[told]).all()
