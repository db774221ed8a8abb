"""The prior in coordinates is a density, and a vector of values goes there and back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

from bayes_hw.model.parameters import Parameter, ParameterVector, as_coordinates, as_values, log_prior
from bayes_hw.model.priors import (
    HalfNormal,
    HyperbolicTangent,
    Identity,
    Logarithm,
    LogNormal,
    Normal,
    Prior,
    Transform,
    Uniform,
)

COORDINATES: list[tuple[Prior, Transform]] = [
    (Normal(1.5, 0.4), Identity()),
    (LogNormal(2.0, 0.3), Logarithm()),
    (LogNormal(-0.335, 0.3), Logarithm(-1.0)),
    (HalfNormal(0.7), Logarithm()),
    (Uniform(-1.0, 1.0), HyperbolicTangent()),
]


@pytest.mark.parametrize(("prior", "transform"), COORDINATES)
def test_prior_in_coordinates_integrates_to_one(prior: Prior, transform: Transform) -> None:
    parameters = (Parameter("x", "", 1.0, prior, transform),)
    total, _ = integrate.quad(
        lambda q: float(np.exp(log_prior(parameters, np.array([[q]])))[0]), -30, 30, limit=400, points=[0.0]
    )
    assert total == pytest.approx(1, abs=1e-6)


def test_prior_of_several_parameters_is_their_product() -> None:
    parameters = tuple(Parameter(str(i), "", 1.0, p, t) for i, (p, t) in enumerate(COORDINATES))
    q = np.random.default_rng(1).normal(0, 0.5, size=(5, 7))
    parts = [log_prior((parameter,), q[[i]]) for i, parameter in enumerate(parameters)]
    np.testing.assert_allclose(log_prior(parameters, q), np.sum(parts, axis=0), rtol=1e-12)
    np.testing.assert_allclose(as_coordinates(parameters, as_values(parameters, q)), q, rtol=1e-10)


def test_vector_of_parameters_gives_what_each_gives_alone() -> None:
    """Also where a log-normal prior has the other sign: impossible everywhere."""
    parameters = tuple(Parameter(str(i), "", 1.0, p, t) for i, (p, t) in enumerate(COORDINATES))
    q = np.random.default_rng(2).normal(0, 1, size=(5, 9))
    vector = ParameterVector(parameters)
    values = vector.values(q)
    np.testing.assert_array_equal(values, as_values(parameters, q))
    np.testing.assert_allclose(vector.log_prior(q, values), log_prior(parameters, q), rtol=1e-12)
    wrong = ParameterVector((Parameter("x", "", 1.0, LogNormal(-1.0, 0.3), Logarithm()),))
    assert (wrong.log_prior(q[:1], wrong.values(q[:1])) == -np.inf).all()


@pytest.mark.parametrize(("prior", "transform"), COORDINATES)
def test_spread_of_a_coordinate_is_that_of_its_draws(prior: Prior, transform: Transform) -> None:
    draws = transform.to_coordinate(prior.quantile(np.linspace(0.0005, 0.9995, 1000)))
    middle = np.quantile(draws, [0.158655, 0.841345])
    found = Parameter("x", "", 1.0, prior, transform).coordinate_sd
    assert found == pytest.approx(float(np.diff(middle)[0]) / 2, rel=0.01)


def test_spread_of_a_normal_coordinate_is_its_standard_deviation() -> None:
    cases = zip(COORDINATES[:3], (0.4, 0.3, 0.3), strict=True)
    for (prior, transform), sd in cases:
        assert Parameter("x", "", 1.0, prior, transform).coordinate_sd == pytest.approx(sd)
