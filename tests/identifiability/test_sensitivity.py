"""Sensitivities against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.identifiability.sensitivity import fisher_information, sensitivity
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def test_output_is_its_own_slope_in_the_log_gain(small_axis: HammersteinWiener, small_record: Record) -> None:
    """d y / d log g = w outside the dead zone and zero inside; the same of delta is -sign(w) delta there."""
    axis = AxisParameters(small_axis)
    w = small_axis.simulate(small_record.u).w
    outside = np.abs(w) > 0.02
    found = sensitivity(axis, axis.nominal, [small_record])
    assert found.kink < 1e-3
    np.testing.assert_allclose(
        found.matrix[:, axis.names.index("gain")], np.where(outside, w, 0.0), atol=1e-8
    )
    np.testing.assert_allclose(
        found.matrix[:, axis.names.index("dead_zone.half_width")],
        np.where(outside, -np.sign(w) * 0.02, 0.0),
        atol=1e-8,
    )


def test_a_sample_at_a_kink_is_reported(small_axis: HammersteinWiener, small_record: Record) -> None:
    axis = AxisParameters(small_axis)
    values = axis.nominal
    values[1] = np.sort(small_record.u)[-1]
    at_largest = replace(small_record, u=np.where(small_record.u > 1.0, values[1], small_record.u))
    assert sensitivity(axis, values, [at_largest]).kink > 0.1


def test_information_adds_records_and_scales_with_noise(
    small_axis: HammersteinWiener, small_record: Record
) -> None:
    axis = AxisParameters(small_axis)
    values = np.stack([axis.nominal, 1.01 * axis.nominal], axis=1)
    white = np.zeros((0, 2))
    one = fisher_information(axis, values, [small_record], white, np.array([0.01, 0.02]))
    two = fisher_information(axis, values, [small_record] * 2, white, np.array([0.01, 0.02]))
    np.testing.assert_allclose(two, 2 * one)
    slopes = sensitivity(axis, values[:, 1], [small_record]).matrix
    np.testing.assert_allclose(one[1], slopes.T @ slopes / 0.02**2, rtol=1e-6, atol=1e-3)


def test_correlated_noise_is_whitened(small_axis: HammersteinWiener, small_record: Record) -> None:
    """Against the dense inverse covariance of an AR(1); its first sample counts for 1 / (1 - phi^2) more."""
    axis = AxisParameters(small_axis)
    phi, n = 0.5, len(small_record)
    found = fisher_information(
        axis, axis.nominal[:, None], [small_record], np.array([[phi]]), np.array([0.01])
    )[0]
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    covariance = 0.01**2 * phi**lags / (1 - phi**2)
    slopes = sensitivity(axis, axis.nominal, [small_record]).matrix
    dense = slopes.T @ np.linalg.solve(covariance, slopes)
    np.testing.assert_allclose(found, dense, rtol=1e-3, atol=1e-3 * np.max(dense))
