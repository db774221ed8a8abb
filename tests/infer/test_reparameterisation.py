"""Straight coordinates are one to one, with the Jacobian that they say, and change no probability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.laplace import carried_covariance
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


@pytest.fixture(scope="module")
def records(small_axis: HammersteinWiener) -> list[Record]:
    return [measured(small_axis, 400, seed=1), measured(small_axis, 300, seed=2)]


@pytest.fixture(scope="module")
def reparameterisation(small_axis: HammersteinWiener, records: list[Record]) -> Reparameterisation:
    found = Reparameterisation.of(AxisParameters(small_axis).parameters, records)
    assert found is not None
    return found


def scattered(axis: HammersteinWiener, spread: float) -> FloatArray:
    """Coordinates (60, parameters); a wide spread puts limits beyond every command."""
    parameters = AxisParameters(axis).parameters
    nominal = [float(p.transform.to_coordinate(np.asarray(p.nominal))) for p in parameters]
    return nominal + spread * np.random.default_rng(3).standard_normal((60, len(nominal)))


@pytest.mark.parametrize("spread", [0.05, 1.0])
def test_there_and_back(
    small_axis: HammersteinWiener, reparameterisation: Reparameterisation, spread: float
) -> None:
    plain = scattered(small_axis, spread)
    back, _ = reparameterisation.to_plain(reparameterisation.from_plain(plain))
    np.testing.assert_allclose(back, plain, rtol=1e-9, atol=1e-9)


def test_jacobian_is_that_of_finite_differences(
    small_axis: HammersteinWiener, reparameterisation: Reparameterisation
) -> None:
    straight = reparameterisation.from_plain(scattered(small_axis, 0.05))
    _, log_jacobian = reparameterisation.to_plain(straight)
    for point, expected in zip(straight[:20], log_jacobian[:20], strict=True):
        steps = 1e-8 * np.eye(len(point))
        columns = (
            reparameterisation.to_plain(point + steps)[0] - reparameterisation.to_plain(point - steps)[0]
        ) / 2e-8
        assert np.linalg.slogdet(columns)[1] == pytest.approx(expected, abs=1e-4)


def test_definition(
    small_axis: HammersteinWiener, reparameterisation: Reparameterisation, records: list[Record]
) -> None:
    """s_lower is the gain times the mean of the limited command, s_upper the power of what is cut off."""
    u = np.concatenate([record.u for record in records])
    axis = AxisParameters(small_axis)
    coordinates = np.array([float(p.transform.to_coordinate(np.asarray(p.nominal))) for p in axis.parameters])
    straight = reparameterisation.from_plain(coordinates)
    gain = axis.nominal[axis.names.index("gain")]
    assert straight[0] == pytest.approx(gain * np.mean(np.clip(u, -0.8, 1.0)), rel=1e-3, abs=1e-7)
    assert straight[1] == pytest.approx(-(np.mean(np.maximum(u - 1.0, 0)) ** (2 / 3)), rel=1e-3)


def test_limits_of_the_wrong_sign_are_not_a_number(reparameterisation: Reparameterisation) -> None:
    """Coordinates of no axis: their density is zero, not an error."""
    straight = np.zeros((3, 6))
    straight[:, 1] = [-50.0, -0.01, -0.01]
    straight[:, 0] = [0.0, 50.0, 0.0]
    plain, _ = reparameterisation.to_plain(straight)
    assert np.isnan(plain[0, 1]) and np.isnan(plain[1, 0]) and np.isfinite(plain[2]).all()


def test_commands_on_one_side_have_none(small_axis: HammersteinWiener, records: list[Record]) -> None:
    parameters = AxisParameters(small_axis).parameters
    assert Reparameterisation.of(parameters, [replace(records[0], u=np.abs(records[0].u))]) is None


def test_covariance_is_carried_over(
    small_axis: HammersteinWiener, reparameterisation: Reparameterisation
) -> None:
    """Of a narrow normal cloud, in straight coordinates."""
    mode = scattered(small_axis, 0.0)[0]
    root = np.tril(np.random.default_rng(5).normal(0, 1e-3, (len(mode), len(mode))))
    cloud = mode + np.random.default_rng(4).standard_normal((40_000, len(mode))) @ root.T
    carried = carried_covariance(reparameterisation, mode, root @ root.T)
    found = np.cov(reparameterisation.from_plain(cloud).T)
    scale = np.sqrt(np.outer(np.diag(carried), np.diag(carried)))
    np.testing.assert_allclose(found / scale, carried / scale, atol=0.03)
