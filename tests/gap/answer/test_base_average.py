"""Base parameters averaged over explanations: whose draws they are, how many, and how wide."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from blind_check.tails import Tails
from decision_constants import CONSTANTS

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.base_average import DRAWS, averaged_base

SD = np.array([0.1, 0.2])
NOISE = 0.05


def explanation(
    labels: tuple[str, ...], at: tuple[float, float], log_evidence: float, prior_sd: float = 1e3
) -> Any:
    """Two base parameters at `at` with standard deviations SD, in coordinates that are the values; the prior
    is centred at 4."""
    fit = SimpleNamespace(
        coordinates=np.array(at),
        covariance=lambda: np.diag(SD**2),
        hypothesis=SimpleNamespace(
            base_count=2,
            to_values=lambda coordinates: coordinates,
            to_coordinates=lambda values: values,
            prior_deviations=lambda coordinates: (coordinates - 4.0) / prior_sd,
        ),
        readings=1000,
    )
    return SimpleNamespace(
        labels=labels,
        fit=fit,
        log_evidence=log_evidence,
        encoder_sigma=NOISE,
        chaotic=False,
        cannot_be_predicted=False,
        chaotic_response=False,
    )


BASE = explanation((), (0.0, 0.0), 0.0)
FRICTION = explanation(("friction",), (4.0, 4.0), 50.0)
BACKLASH = explanation(("backlash",), (-4.0, 8.0), 49.0)
CHOSEN = np.array([[4.0, 4.0, NOISE]])


def averaged(
    sets: dict[tuple[str, ...], float],
    other: float,
    chosen: FloatArray | None = CHOSEN,
    base: Any = BASE,
    astray: tuple[float, float] = (0.0, 1.0),
    floor: float = np.inf,
) -> FloatArray:
    attribution: Any = SimpleNamespace(explanations=(FRICTION, BACKLASH, base), base=base)
    decision: Any = SimpleNamespace(explanation=FRICTION, sets=sets, probability={"other": other})
    constants = replace(CONSTANTS, astray_share=astray[0], astray_scale=astray[1])
    return averaged_base(attribution, decision, chosen, 0.04, floor, constants, np.random.default_rng(1))


def test_a_sure_answer_keeps_its_posterior() -> None:
    found = averaged({("friction",): 1.0, ("backlash",): 1e-6}, 0.0)
    assert found.shape == (DRAWS, 3) and np.all(found == CHOSEN)


def test_explanations_count_by_their_probability() -> None:
    found = averaged({("friction",): 0.75, ("backlash",): 0.25}, 0.0)
    second = found[found[:, 0] != 4.0]
    assert len(second) == pytest.approx(0.25 * DRAWS, abs=1)
    np.testing.assert_allclose(second[:, :2].mean(axis=0), [-4, 8], atol=0.05)
    np.testing.assert_allclose(second[:, :2].std(axis=0), SD, rtol=0.15)
    np.testing.assert_allclose(second[:, 2].std(), NOISE / np.sqrt(2000), rtol=0.15)


def test_where_none_explains_the_gap_they_are_as_far_off_as_the_failed_ones() -> None:
    """Twice the root mean square distance (4.6 and 3.3) from the best; the noise between two statements."""
    found = averaged({("friction",): 0.0}, 1.0)
    np.testing.assert_allclose(found[1:, :2].mean(axis=0), [4, 4], atol=0.8)
    apart = np.sqrt(np.array([8.0**2 + 2 * 4.0**2, 4.0**2 + 2 * 4.0**2]) / 4)
    np.testing.assert_allclose(found[1:, :2].std(axis=0), 2 * apart, rtol=0.05)
    assert np.median(found[:, 2]) == pytest.approx(np.sqrt(0.04 * NOISE), rel=0.03)
    assert np.std(np.log(found[:, 2])) == pytest.approx(0.25, rel=0.06)


def test_where_none_explains_the_gap_the_nominal_model_still_holds() -> None:
    """No draw is farther than four of its standard deviations, however far off a failed explanation ran."""
    runaway = explanation((), (1e6, 0.0), 0.0, prior_sd=0.5)
    found = averaged({("friction",): 0.0}, 1.0, base=runaway)[1:, :2]
    np.testing.assert_allclose(np.abs(found - 4.0).max(), 2.0)
    assert np.mean(np.abs(found[:, 0] - 4.0) > 1.9) > 0.9


def test_without_posterior_draws_the_normal_approximation_is_drawn() -> None:
    found = averaged({("friction",): 1.0}, 0.0, chosen=None)
    np.testing.assert_allclose(found[:, :2].std(axis=0), SD, rtol=0.1)


def test_tails_are_those_that_are_fitted_and_leave_the_noise_alone() -> None:
    """Of normal draws; one factor for all parameters of a draw, so that large errors come together."""
    known = np.random.default_rng(2).normal([4.0, 4.0, NOISE], [*SD, 0.001], (20_000, 3))
    found = averaged({("friction",): 1.0}, 0.0, known, astray=(0.2, 3.0))
    errors, width = (found[:, 0] - 4) / SD[0], Tails(0.2, 3.0).half_width
    for level in (0.5, 0.8, 0.94):
        assert np.mean(np.abs(errors) < width(level)) == pytest.approx(level, abs=0.025)
    assert found[:, 2].std() == pytest.approx(0.001, rel=0.05)
    far = np.abs(found[:, :2] - 4.0) / SD > 2.0
    assert np.mean(far[far[:, 0], 1]) > 2 * np.mean(far[:, 1])


def test_tails_end_where_the_nominal_model_cannot_be() -> None:
    tight = explanation((), (4.0, 4.0), 0.0, prior_sd=0.06)
    known = np.random.default_rng(2).normal([4.0, 4.0, NOISE], [*SD, 0.001], (20_000, 3))
    found = averaged({("friction",): 1.0}, 0.0, known, base=tight, astray=(0.5, 2.0))
    assert np.abs(found[:, :2] - 4.0).max() == pytest.approx(4 * 0.06, rel=0.1)


def test_what_repeats_do_not_share_bounds_the_noise_where_none_explains_the_gap() -> None:
    """Half way between 0.04 and the least of what is left, 0.05, and of the floor."""
    found = averaged({("friction",): 0.0}, 1.0, floor=0.03)
    assert np.median(found[:, 2]) == pytest.approx(np.sqrt(0.04 * 0.03), rel=0.03)
