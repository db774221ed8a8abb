"""Importance sampling judges proposals as a chain would, and flattens weights no more than it must."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special
from targets import Gaussian

from bayes_hw.infer.ensemble import advance, start_ensemble
from bayes_hw.infer.importance import acceptance_from_weights, flattening, independence_share
from bayes_hw.infer.mixture import laplace_proposal
from bayes_hw.infer.moves import IndependenceMove


def test_expected_acceptance_is_that_of_a_chain() -> None:
    """Of a proposal half a width off and twice too wide, within two per cent of a stationary chain's."""
    target, rng = Gaussian(4), np.random.default_rng(1)
    off = target.mean + 0.5 * np.sqrt(np.diag(target.covariance))
    proposal = laplace_proposal(off, 2 * target.covariance)
    draws = proposal.sample(20_000, rng)
    weights = np.exp(target(draws) - proposal.log_density(draws))
    expected = acceptance_from_weights(weights, np.full(len(draws), 1 / len(draws)))
    state = start_ensemble(target.draw(400, rng), target, seed=2)
    _, _, achieved, _ = advance(state, target, [(IndependenceMove(proposal), 1.0)], 100)
    assert expected == pytest.approx(achieved, abs=0.02)


@pytest.mark.parametrize("weights", [[1.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
def test_acceptance_of_equal_and_of_useless_weights(weights: list[float]) -> None:
    assert acceptance_from_weights(np.array(weights), np.full(3, 1 / 3)) == pytest.approx(
        1.0 if weights[0] else 1 / 3
    )


def test_expected_acceptance_from_the_draws_of_another_proposal() -> None:
    """Draws of a wider proposal, with masses, say of a narrower one what its own draws say."""
    target, rng = Gaussian(4), np.random.default_rng(8)
    wide, narrow = (laplace_proposal(target.mean, width * target.covariance) for width in (2.0, 0.5))
    own, others = narrow.sample(20_000, rng), wide.sample(20_000, rng)
    weights = np.exp(target(own) - narrow.log_density(own))
    direct = acceptance_from_weights(weights, np.full(len(own), 1 / len(own)))
    log_masses = narrow.log_density(others) - wide.log_density(others)
    weights = np.exp(target(others) - narrow.log_density(others))
    assert acceptance_from_weights(weights, special.softmax(log_masses)) == pytest.approx(direct, abs=0.015)
    wrong = acceptance_from_weights(weights, np.full(len(others), 1 / len(others)))
    assert wrong != pytest.approx(direct, abs=0.03)


def test_flattened_weights_leave_the_draws_asked_for() -> None:
    """A power below one where few draws have all the weight; one where there are enough, or equal ones."""
    log_weights = -0.5 * np.random.default_rng(7).normal(0, 30, 5000) ** 2
    exponent = flattening(log_weights, 400.0)
    weights = np.exp(exponent * log_weights)
    assert 0 < exponent < 1
    assert weights.sum() ** 2 / np.sum(weights**2) == pytest.approx(400, rel=1e-3)
    assert flattening(1e-3 * log_weights / 30, 400.0) == 1.0
    assert flattening(np.zeros(500), 400.0) == 1.0


def test_share_of_independence_proposals_follows_their_acceptance() -> None:
    shares = [independence_share(acceptance) for acceptance in (0.0, 0.02, 0.1, 0.2, 0.5, 1.0)]
    assert shares == sorted(shares) and shares[0] == 0.1 and shares[-1] == pytest.approx(0.95)
