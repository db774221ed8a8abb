"""What a further mode pays for the roots of G that it moves, and when it is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, measured, model

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_model import HEAVIEST
from bayes_hw.gap.joint.given.given_moves import is_a_mode
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 500


@pytest.fixture(scope="module")
def base() -> GivenFit:
    return best_base(measured((), SAMPLES, (1, 2)), model())


def test_a_mode_pays_by_how_much_its_roots_posterior_is_narrower_than_their_prior(base: GivenFit) -> None:
    """Against the covariance of all coordinates, by the determinant of the roots' own block."""
    at_once = base.with_mode(2.0, 0.05)
    coordinates = at_once.point.coordinates.copy()
    coordinates[len(base.theta) + 2] += 0.3
    fit = replace(at_once, point=evaluate(at_once.response, coordinates))
    factor = fit.factor()
    precision = factor[:-1, :-1].T @ factor[:-1, :-1] / fit.point.variance_by(factor)
    loose = fit.response.given.loose_sd
    end = len(fit.theta)
    own = np.linalg.inv(precision)[end - len(loose) : end, end - len(loose) : end]
    expected = -0.5 * np.linalg.slogdet(own / np.outer(loose, loose))[1]
    paid = super(GivenFit, fit).score - fit.score
    assert paid == pytest.approx(expected, rel=1e-4)
    assert paid > 0.5


def test_nothing_is_paid_where_nothing_is_told_of_the_roots(base: GivenFit) -> None:
    """Without a mode, and by readings whose noise is a thousand times as large."""
    assert base.score == JointFit.score.__get__(base)
    fit = base.with_mode(2.0, 0.05)
    rng = np.random.default_rng(5)
    noisy = [replace(r, y=r.y + 1000 * SIGMA * rng.standard_normal(SAMPLES)) for r in fit.response.records]
    response = replace(fit.response, records=noisy)
    lost = replace(fit, response=response, point=evaluate(response, fit.point.coordinates))
    assert super(GivenFit, lost).score - lost.score == pytest.approx(0.0, abs=1e-3)


def _zeros_moved(fit: GivenFit, by: float) -> GivenFit:
    coordinates = fit.point.coordinates.copy()
    coordinates[len(fit.theta) - len(fit.response.given.loose_sd) - 2] += by
    return replace(fit, point=evaluate(fit.response, coordinates))


def _seen(truth: GivenFit, explained: GivenFit) -> GivenFit:
    """One explanation of what another one simulates, with noise."""
    rng = np.random.default_rng(3)
    records = [
        replace(
            r, y=truth.response.simulate(truth.values, r.u).y + 0.01 * SIGMA * rng.standard_normal(SAMPLES)
        )
        for r in truth.response.records
    ]
    response = replace(explained.response, records=records)
    return replace(explained, response=response, point=evaluate(response, explained.point.coordinates))


def test_a_mode_whose_zeros_stand_at_its_poles_is_none(base: GivenFit) -> None:
    """What it explains is done by the roots that it loosens; nor is one that is as damped as may be."""
    idle = base.with_mode(1.2, 0.05)
    mode = _zeros_moved(idle, 0.4)
    assert is_a_mode(_seen(mode, mode))
    assert not is_a_mode(_seen(idle, idle))
    assert not is_a_mode(_seen(idle, _zeros_moved(idle, 1e-4)))
    damped = _zeros_moved(base.with_mode(1.2, float(np.exp(HEAVIEST))), 0.4)
    assert not is_a_mode(_seen(damped, damped))
