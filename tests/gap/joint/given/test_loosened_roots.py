"""What a further mode pays for the roots of G that it moves, and when it is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, form, measured, model

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_model import FURTHER, HEAVIEST, LIGHTEST
from bayes_hw.gap.joint.given.given_moves import further_modes, is_a_mode, modes_beside
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, QUIET = 500, 0.1 * SIGMA


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


def _with_mode(fit: GivenFit, damping_ratio: float) -> GivenFit:
    idle = fit.with_mode(1.2, damping_ratio)
    coordinates = idle.point.coordinates.copy()
    coordinates[len(idle.theta) - len(idle.response.given.loose_sd) - 2] += 0.4
    return replace(idle, point=evaluate(idle.response, coordinates))


def _base_of_what_it_does(moved: GivenFit) -> GivenFit:
    """The best base of what an axis does with little noise, its roots where the model has them."""
    rng = np.random.default_rng(3)
    records = [
        replace(r, y=moved.response.simulate(moved.values, r.u).y + QUIET * rng.standard_normal(SAMPLES))
        for r in moved.response.records
    ]
    return best_base(records, model())


def test_a_mode_that_is_as_damped_as_may_be_is_none(base: GivenFit) -> None:
    assert is_a_mode(_with_mode(base, 0.05))
    assert not is_a_mode(_with_mode(base, float(np.exp(HEAVIEST))))
    assert not is_a_mode(_with_mode(base, float(np.exp(LIGHTEST))))


def test_roots_of_g_that_are_not_the_models_are_a_mode_with_zeros_at_its_poles(base: GivenFit) -> None:
    """A member whose own swing does not show moves the others: all that it does is linear, and the name of
    what is linear and no delay is a mode."""
    idle = base.with_mode(1.2, 0.05)
    loose = idle.response.given.loose_sd
    end = len(idle.theta)
    coordinates = idle.point.coordinates.copy()
    coordinates[end - len(loose)] += np.log(1.4)
    moved = replace(idle, point=evaluate(idle.response, coordinates))
    off = _base_of_what_it_does(moved)
    assert off.point.rms > 1.3 * QUIET
    (found,) = further_modes(off)
    assert found.point.rms < 1.05 * QUIET
    assert found.score > off.score + 20


def test_a_mode_beside_a_label_counts_where_the_two_leave_nothing(base: GivenFit) -> None:
    """Of roots that are off and a bias: the bias with a mode, none of a wrong label with one."""
    bias, asymmetry = form("command_bias"), form("gain_asymmetry")
    idle = base.with_effect(bias, [0.1 * base.response.scale.speed]).with_mode(1.2, 0.05)
    end, loose = idle.response.first_of_mode + FURTHER, idle.response.given.loose_sd
    coordinates = idle.point.coordinates.copy()
    coordinates[end : end + len(loose)] += np.where(np.arange(len(loose)) == 0, np.log(1.4), 0.0)
    moved = replace(idle, point=evaluate(idle.response, coordinates))
    off = _base_of_what_it_does(moved)
    alone = [off.with_effect(law, [0.0]).descended() for law in (bias, asymmetry)]
    assert all(one.noise_order > 1 for one in alone)
    (found,) = modes_beside(alone)
    assert set(found.labels) == {"unmodelled_mode", "command_bias"}
    assert found.point.rms < 1.05 * QUIET
