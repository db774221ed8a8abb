"""Weights follow the rest: marginal widths for a normal posterior, for an axis the whole posterior."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.infer import reweighting
from bayes_hw.infer.following_weights import DensityAlong, Following
from bayes_hw.infer.inference import Inference, infer
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

NAMES = ("dead_zone.half_width", "mode1.cosine", "real_pole2.value", "real_pole2.weight")
LEADING = [0, 2]


class NormalDensity:
    """A normal log-density of four correlated coordinates, two of them leading."""

    names = NAMES
    non_finite = 0

    def __init__(self) -> None:
        rng = np.random.default_rng(1)
        mixing = rng.standard_normal((4, 4))
        self.centre = rng.standard_normal(4)
        self.covariance = mixing @ mixing.T
        self.precision = np.linalg.inv(self.covariance)

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        away = coordinates - self.centre
        return np.asarray(-0.5 * np.einsum("ni,ij,nj->n", away, self.precision, away))


@pytest.fixture(scope="module")
def normal() -> tuple[NormalDensity, Following]:
    density = NormalDensity()
    laplace = Laplace([(density.centre, density.covariance)], [density])
    return density, Following.of(laplace, NAMES)


def test_along_the_line_the_density_is_the_marginal_one(normal: tuple[NormalDensity, Following]) -> None:
    """Its curvature is that of the marginal, by a known factor below that with the others held."""
    density, following = normal
    assert [NAMES[row] for row in following.leading] == list(DensityAlong(density, following).names)
    along = DensityAlong(density, following)
    points = density.centre[LEADING] + np.random.default_rng(2).standard_normal((20, 2))
    marginal = np.linalg.inv(density.covariance[np.ix_(LEADING, LEADING)])
    away = points - density.centre[LEADING]
    np.testing.assert_allclose(along(points), -0.5 * np.einsum("ni,ij,nj->n", away, marginal, away))
    held = np.repeat(density.centre[None], 20, axis=0)
    held[:, LEADING] = points
    conditional = density.precision[np.ix_(LEADING, LEADING)]
    np.testing.assert_allclose(density(held), -0.5 * np.einsum("ni,ij,nj->n", away, conditional, away))
    assert np.all(np.linalg.eigvalsh(conditional - marginal) > 0.01)


def test_draws_about_the_line_have_the_whole_covariance(normal: tuple[NormalDensity, Following]) -> None:
    """Leading coordinates from their marginal, the others standard normal aside; and the density of such
    draws is that of the whole, up to a constant."""
    density, following = normal
    rng = np.random.default_rng(3)
    marginal = np.linalg.cholesky(following.covariance)
    leading = following.mode + rng.standard_normal((200_000, 2)) @ marginal.T
    aside = rng.standard_normal((200_000, 2))
    points = following.completed(leading, aside)
    np.testing.assert_array_equal(points[:, LEADING], leading)
    np.testing.assert_allclose(np.cov(points.T), density.covariance, rtol=0.02, atol=0.03)
    completed = DensityAlong(density, following)(leading) - 0.5 * np.sum(aside**2, axis=1)
    assert np.ptp(completed - density(points)) < 1e-8


@pytest.fixture(scope="module")
def record(small_axis: HammersteinWiener) -> Record:
    return measured(small_axis, 300, seed=21)


def inferred(model: HammersteinWiener, record: Record, free: str, **settings: float) -> Inference:
    return infer(
        model,
        [record],
        np.random.default_rng(4),
        free=free,  # type: ignore[arg-type]
        settings=SamplerSettings(**settings),  # type: ignore[arg-type]
    )


def test_dominant_parameters_have_the_posterior_of_everything(
    small_axis: HammersteinWiener, record: Record
) -> None:
    """All means within four standard errors, all widths within four per cent; with the other roots held the
    interval of the damping is a fifth narrower."""
    everything = inferred(small_axis, record, "all").posterior
    found = inferred(small_axis, record, "dominant")
    posterior = found.posterior
    assert posterior.converged and everything.converged and posterior.names == everything.names
    assert posterior.conditional_on == () and found.sampling.plan.proposal.dimension == 8
    assert posterior.reweighting is not None and posterior.reweighting.holds
    assert posterior.to_dict()["following_weights"]["effective"] > 20_000
    for name, summary in everything.reported.items():
        other = posterior.reported[name]
        error = np.hypot(summary.mcse_mean, other.mcse_mean)
        assert abs(other.mean - summary.mean) < 4 * error, name
        assert other.sd == pytest.approx(summary.sd, rel=0.04), name
    held = inferred(small_axis, record, "conditional").posterior
    damping = "mode1.damping_ratio"
    assert held.conditional_on and held.summaries[damping].sd < 0.8 * everything.summaries[damping].sd


@pytest.mark.slow
def test_everything_is_sampled_where_the_weights_do_not_hold(
    small_axis: HammersteinWiener, record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reweighting, "LARGEST_PARETO_K", -np.inf)
    found = inferred(small_axis, record, "dominant", max_steps=50)
    assert found.posterior.reweighting is None and "following_weights" not in found.posterior.to_dict()
    assert found.sampling.plan.proposal.dimension == len(found.posterior.names) > 8
