"""The Laplace approximation keeps a component a mode, and goes into straight coordinates with its density."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from simulated_records import measured
from targets import Banana, Gaussian, TwoModes

from bayes_hw.infer.laplace import Laplace, StraightDensity
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

LEFT, RIGHT = np.array([-3.0, 0, 0, 0]), np.array([3.0, 0, 0, 0])


def test_proposal_has_a_component_at_every_mode() -> None:
    """Of equal weight, and the covariance as scale matrix."""
    found = Laplace([(RIGHT, np.eye(4)), (LEFT, 4 * np.eye(4))], [TwoModes()]).proposal(2.0)
    np.testing.assert_array_equal(found.weights, [0.5, 0.5])
    np.testing.assert_array_equal(found.means, [RIGHT, LEFT])
    np.testing.assert_allclose(found.factors[1] @ found.factors[1].T, 8 * np.eye(4))


def test_places_on_one_ridge_are_one_mode_and_two_peaks_are_two() -> None:
    two = Laplace([(RIGHT, np.eye(4)), (LEFT, np.eye(4))], [TwoModes()])
    assert len(two.separated().modes) == 2
    ridge = Laplace([(np.zeros(2), np.eye(2)), (np.array([0.3, 0.1]), np.eye(2))], [Banana()])
    (kept,) = ridge.separated().modes
    np.testing.assert_array_equal(kept[0], np.zeros(2))


@pytest.fixture
def reparameterisation(small_axis: HammersteinWiener) -> Reparameterisation:
    records = [measured(small_axis, 400, seed=1), measured(small_axis, 300, seed=2)]
    found = Reparameterisation.of(AxisParameters(small_axis).parameters, records)
    assert found is not None
    return found


def test_probabilities_are_the_same_in_straight_coordinates(
    small_axis: HammersteinWiener, reparameterisation: Reparameterisation
) -> None:
    """Draws of a normal distribution, carried over, weighed by density over that of a normal fitted to them
    there: the mean weight is the ratio of the normalizing constants, without the Jacobian it is far off."""
    nominal = AxisParameters(small_axis).parameters
    centre = np.array([float(p.transform.to_coordinate(np.asarray(p.nominal))) for p in nominal])
    target = Gaussian(len(centre))
    target.mean, target.precision = centre, np.eye(len(centre)) / 0.02**2
    straight = Laplace([(centre, 0.02**2 * np.eye(len(centre)))], [target]).carried(reparameterisation)
    mode, covariance = straight.modes[0]
    proposal = stats.multivariate_normal(mode, 1.5 * covariance)
    x = proposal.rvs(20_000, random_state=np.random.default_rng(5))
    weights = np.exp(straight.densities[0](x) - proposal.logpdf(x))
    exact = (2 * np.pi * 0.02**2) ** (len(centre) / 2)
    assert weights.mean() == pytest.approx(exact, rel=5 * weights.std() / weights.mean() / np.sqrt(len(x)))


def test_what_could_not_be_evaluated_is_counted_through(reparameterisation: Reparameterisation) -> None:
    target = Gaussian(3)
    straight = StraightDensity(target, reparameterisation)
    straight.non_finite = 4
    assert target.non_finite == straight.non_finite == 4
    assert straight.names == target.names
