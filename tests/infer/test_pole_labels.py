"""Poles may pass each other: the density is spread over exchanges of names, and adds up to what it was."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.importance import importance_trial
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.pole_labels import PoleLabels
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.model.parameters import as_coordinates, as_values

NARROW, BROAD = 0.02, 0.7
FREQUENCY_HZ = np.geomspace(0.01, 9.0, 30)


@pytest.fixture(scope="module")
def axis(small_axis: HammersteinWiener) -> AxisParameters:
    """Two modes, two further pairs, five real poles of which one is held between the others."""
    rate = small_axis.sample_rate_hz
    modes = (Mode(2.0, 0.05), Mode(2.6, 0.06))
    pairs = [mode.pole(rate) for mode in (*modes, Mode(1.0, 0.4), Mode(1.25, 0.5))]
    poles = np.array([1.0, 0.2, 0.6, 0.7, 0.8, 0.9, *pairs, *np.conj(pairs)])
    model = HammersteinWiener(
        "passing", rate, small_axis.saturation, LinearBlock(np.array([0.3]), poles, 1e-6, 1),
        small_axis.dead_zone, modes,
    )  # fmt: skip
    return AxisParameters(model, "all", held_poles=("real_pole3",))


@pytest.fixture(scope="module")
def labels(axis: AxisParameters) -> PoleLabels:
    centre = as_coordinates(axis.parameters, axis.nominal)
    found = PoleLabels.of(axis, centre, 0.2**2 * np.eye(len(centre)))
    assert found is not None
    return found


def scattered(axis: AxisParameters, count: int = 60) -> FloatArray:
    """Coordinates (count, parameters), many with poles that have passed each other."""
    middle = as_coordinates(axis.parameters, axis.nominal)
    return middle + 0.5 * np.random.default_rng(5).standard_normal((count, len(middle)))


def test_a_point_put_in_order_is_the_same_axis(axis: AxisParameters, labels: PoleLabels) -> None:
    points = scattered(axis)
    plain, change = labels.to_plain(points)
    kept = np.isfinite(change)
    before, after = (as_values(axis.parameters, x[kept].T) for x in (points, plain))
    assert kept.sum() > 40
    assert np.mean(axis.in_order(before)) < 0.5
    assert axis.in_order(after).all()
    responses = [axis.frequency_response(values, FREQUENCY_HZ) for values in (before, after)]
    np.testing.assert_allclose(responses[1], responses[0], rtol=1e-8)


def test_points_in_order_stay_where_they_are(axis: AxisParameters, labels: PoleLabels) -> None:
    plain, change = labels.to_plain(scattered(axis))
    plain = plain[np.isfinite(change)]
    np.testing.assert_allclose(labels.to_plain(labels.from_plain(plain))[0], plain, rtol=0, atol=1e-9)


def exchanges(axis: AxisParameters, labels: PoleLabels, plain: FloatArray) -> list[FloatArray]:
    """All points that `plain` (parameters,) in order comes from when its real poles, modes and pairs change
    names; weights of real poles stay, which moves no volume."""
    values = as_values(axis.parameters, plain[:, None])[:, 0]
    kinds = [labels.values[:, None], *labels.pairs]
    found = []
    for orders in product(*(permutations(range(len(rows))) for rows in kinds)):
        other = values.copy()
        for rows, order in zip(kinds, orders, strict=True):
            other[rows] = values[rows[list(order)]]
        found.append(as_coordinates(axis.parameters, other[:, None])[:, 0])
    return found


def test_the_density_over_all_exchanges_is_that_of_the_point_in_order(
    axis: AxisParameters, labels: PoleLabels
) -> None:
    """Per unit of value, in which an exchange moves no volume, the changes are the logarithms of shares."""
    rows = [int(row) for row in labels.values]

    def volume(point: FloatArray) -> float:
        """log |d value / d coordinate|."""
        return sum(float(axis.parameters[row].transform.log_jacobian(point[row])) for row in rows)

    for plain in labels.to_plain(scattered(axis, 5))[0]:
        points = exchanges(axis, labels, plain)
        shares = [
            np.exp(change - volume(x) + volume(plain))
            for x, change in zip(points, labels.to_plain(np.array(points))[1], strict=True)
        ]
        assert len(shares) == 24 * 2 * 2
        assert sum(shares) == pytest.approx(1, rel=1e-9)


def test_poles_with_nothing_to_exchange_have_none(small_axis: HammersteinWiener) -> None:
    poles = np.array([1.0, 0.5, Mode(2.0, 0.05).pole(small_axis.sample_rate_hz)])
    poles = np.append(poles, poles[-1].conjugate())
    linear = LinearBlock(np.array([0.3]), poles, 0.01, 1)
    axis = AxisParameters(replace(small_axis, linear=linear, dominant_modes=()), "all")
    assert PoleLabels.of(axis, axis.nominal, np.eye(len(axis.nominal))) is None


class Corner:
    """Two real poles about one place, one told within NARROW and one within BROAD, as a density of both in
    order; all other coordinates normal of width NARROW."""

    def __init__(self, axis: AxisParameters) -> None:
        self.names = axis.names
        self.non_finite = 0
        self.rows = [axis.names.index(f"real_pole{i}.value") for i in (1, 2)]
        self.centre = as_coordinates(axis.parameters, axis.nominal)
        self.centre[self.rows[0]] = self.centre[self.rows[1]]

    def __call__(self, points: FloatArray) -> FloatArray:
        away = points - self.centre
        first, second = away[:, self.rows[0]], away[:, self.rows[1]]
        others = np.delete(away, self.rows, axis=1) / NARROW
        both = np.logaddexp(-0.5 * ((first / BROAD) ** 2 + (second / NARROW) ** 2),
                            -0.5 * ((second / BROAD) ** 2 + (first / NARROW) ** 2))  # fmt: skip
        return np.where(first < second, both - 0.5 * np.sum(others**2, axis=1), -np.inf)


def test_a_pole_that_may_lie_on_either_side_of_another_is_sampled_straight(
    small_axis: HammersteinWiener,
) -> None:
    """In order the density is a corner, which no proposal follows; under names it is normal."""
    linear = LinearBlock(np.array([0.3]), np.array([0.7, 0.8, 1.0]), 0.01, 1)
    axis = AxisParameters(replace(small_axis, linear=linear, dominant_modes=()), "all")
    density = Corner(axis)
    covariance = NARROW**2 * np.eye(len(density.centre))
    covariance[density.rows[0], density.rows[0]] = BROAD**2
    labels = PoleLabels.of(axis, density.centre, covariance)
    assert labels is not None
    corner = Laplace([(density.centre, covariance)], [density])
    accepted = [
        importance_trial(one, np.random.default_rng(2)).plan.expected_acceptance
        for one in (corner, corner.carried(labels))
    ]
    assert accepted[0] < 0.7
    assert accepted[1] > 0.85
