"""Priors are normalised densities with the quantiles to match; transforms are inverted and differentiated."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate
from scipy.stats import norm

from bayes_hw.model.priors import (
    HalfNormal,
    HyperbolicTangent,
    Identity,
    Logarithm,
    LogNormal,
    Normal,
    NormalProbability,
    Prior,
    TimeConstant,
    TimeConstantLogarithm,
    Transform,
    Uniform,
)

PRIORS: list[tuple[Prior, float, float]] = [
    (Normal(1.5, 0.4), -np.inf, np.inf),
    (LogNormal(2.0, 0.3), 0.0, np.inf),
    (LogNormal(-0.335, 0.3), -np.inf, 0.0),
    (HalfNormal(0.7), 0.0, np.inf),
    (Uniform(-1.0, 1.0), -1.0, 1.0),
    (TimeConstant(8.0, 0.5), 0.0, 1.0),
    (TimeConstant(3.0, 0.6, -1.0), -1.0, 0.0),
]
TRANSFORMS: list[Transform] = [Identity(), Logarithm(), Logarithm(-1.0), HyperbolicTangent()]
NEAR_ONE: list[Transform] = [NormalProbability(), TimeConstantLogarithm(), TimeConstantLogarithm(-1.0)]
"""Whose values are rounded to one far out."""


def density(prior: Prior, value: float) -> float:
    return float(np.exp(prior.log_density(np.array([value]))[0]))


@pytest.mark.parametrize(("prior", "low", "high"), PRIORS)
def test_density_integrates_to_one(prior: Prior, low: float, high: float) -> None:
    total, _ = integrate.quad(lambda x: density(prior, x), low, high)
    assert total == pytest.approx(1, abs=1e-7)


@pytest.mark.parametrize(("prior", "low", "high"), PRIORS)
def test_quantile_inverts_the_integrated_density(prior: Prior, low: float, high: float) -> None:
    for probability in (0.01, 0.3, 0.5, 0.97):
        bound = float(prior.quantile(np.array(probability)))
        below, _ = integrate.quad(lambda x: density(prior, x), low, bound)
        assert below == pytest.approx(probability, abs=1e-7), high


@pytest.mark.parametrize(("prior", "outside"), [(p, x) for p, x in zip(
    [prior for prior, _, _ in PRIORS[1:]], (-0.1, 0.1, -1e-9, 1.0001, -0.2, 0.2), strict=True)])  # fmt: skip
def test_no_density_outside_the_support(prior: Prior, outside: float) -> None:
    assert prior.log_density(np.array([outside]))[0] == -np.inf


@pytest.mark.parametrize(("prior", "low", "high"), PRIORS)
def test_description_is_one_line_with_the_unit(prior: Prior, low: float, high: float) -> None:
    text = prior.describe("deg/s")
    assert "deg/s" in text and "\n" not in text and low < high
    assert prior.describe("") == prior.describe("").strip()


@settings(max_examples=60, deadline=None)
@given(coordinate=st.floats(-8, 8))
@pytest.mark.parametrize("transform", TRANSFORMS)
def test_transform_round_trips_and_its_jacobian_is_its_slope(transform: Transform, coordinate: float) -> None:
    q = np.array([coordinate])
    np.testing.assert_allclose(transform.to_coordinate(transform.to_value(q)), q, rtol=1e-8, atol=1e-8)
    step = 1e-5
    slope = (transform.to_value(q + step) - transform.to_value(q - step)) / (2 * step)
    np.testing.assert_allclose(np.exp(transform.log_jacobian(q)), np.abs(slope), rtol=1e-4, atol=1e-10)


@settings(max_examples=60, deadline=None)
@given(coordinate=st.floats(-1.5, 4))
@pytest.mark.parametrize("transform", NEAR_ONE)
def test_transforms_of_poles_round_trip(transform: Transform, coordinate: float) -> None:
    q = np.array([coordinate])
    np.testing.assert_allclose(transform.to_coordinate(transform.to_value(q)), q, rtol=1e-7, atol=1e-7)
    step = 1e-5
    slope = (transform.to_value(q + step) - transform.to_value(q - step)) / (2 * step)
    np.testing.assert_allclose(np.exp(transform.log_jacobian(q)), np.abs(slope), rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("transform", NEAR_ONE)
def test_a_pole_on_the_circle_has_a_finite_coordinate(transform: Transform) -> None:
    assert np.isfinite(transform.to_coordinate(np.array([-1.0, 0.0, 1.0]))).all()


def test_a_uniform_pole_is_a_standard_normal_coordinate() -> None:
    q = np.linspace(-4, 4, 9)
    np.testing.assert_allclose(np.exp(NormalProbability().log_jacobian(q)) / 2, norm.pdf(q), rtol=1e-12)


def test_far_coordinates_do_not_overflow_the_jacobian() -> None:
    found = HyperbolicTangent().log_jacobian(np.array([-400.0, 400.0]))
    np.testing.assert_allclose(found, 2 * np.log(2) - 800, rtol=1e-12)
