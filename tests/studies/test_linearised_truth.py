"""The estimate linearised at the truth is what descents begun at the truth find, and its intervals hold."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from linearised_truth import linearised_at_truth, solved, without
from scipy import stats
from stepped_axis import stepped_axis
from true_axis import KnownAxis, TrueNoise
from wide_axes import in_motion

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.holes import without_past
from bayes_hw.identify.output_error import fit_output_error
from bayes_hw.infer.inference import axis_for
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

NAMES = (
    "saturation.lower",
    "saturation.upper",
    "dead_zone.half_width",
    "velocity_gain",
    "mode1.frequency_hz",
)

Cut = Callable[[KnownAxis], KnownAxis]


def at_rest(axis: KnownAxis) -> KnownAxis:
    return axis


def fitted_error(axis: KnownAxis) -> FloatArray:
    """Errors of NAMES of a least-squares fit of everything, initial states too, begun at the truth."""
    start = "free" if axis.earlier else "rest"
    records = axis.records
    if axis.earlier:
        records = without_past(records, axis.model.linear.delay_samples)
    parameters = axis_for(axis.model, axis.records, "all", start)
    fit = fit_output_error(parameters, records, parameters.nominal, max_evaluations=12)
    found = dict(zip(parameters.names, fit.values, strict=True))
    return np.array([found[name] - axis.true_values()[name] for name in NAMES])


@pytest.mark.parametrize("cut", [at_rest, pytest.param(in_motion, marks=pytest.mark.slow)])
def test_it_is_the_fit_begun_at_the_truth(small_axis: HammersteinWiener, cut: Cut) -> None:
    """Of the same records, within a third of a standard deviation, for forty draws of the noise; and fits
    spread as its deviations say, within three standard errors."""
    noise = TrueNoise(0.002)
    axes = [cut(stepped_axis(small_axis, noise, seed)) for seed in range(40)]
    best = [linearised_at_truth(axis) for axis in axes]
    deviation = np.array([best[0][name].deviation for name in NAMES])
    errors = np.array([[each[name].error for name in NAMES] for each in best])
    fitted = np.array([fitted_error(axis) for axis in axes])
    assert np.sqrt(np.mean(((fitted - errors) / deviation) ** 2, axis=0)) == pytest.approx(0, abs=0.33)
    assert np.std(fitted, axis=0) / deviation == pytest.approx(1, rel=3 / np.sqrt(80))


@pytest.mark.parametrize(
    "noise",
    [TrueNoise(0.01, (0.7, -0.3)), pytest.param(TrueNoise(0.01, (0.5,), 4.0), marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("cut", [at_rest, in_motion])
def test_its_intervals_hold_as_often_as_they_say(
    small_axis: HammersteinWiener, noise: TrueNoise, cut: Cut
) -> None:
    draws = 150
    best = [linearised_at_truth(cut(stepped_axis(small_axis, noise, seed))) for seed in range(draws)]
    z = np.array([[each[name].error / each[name].deviation for name in NAMES] for each in best])
    least, most = stats.binom.ppf([0.0005, 0.9995], draws, 0.94)
    for column in z.T:
        assert least <= np.count_nonzero(np.abs(column) <= stats.norm.ppf(0.97)) <= most
        assert np.mean(column**2) == pytest.approx(1, abs=3.3 * np.sqrt(2 / draws))


def test_states_that_nobody_knows_cost_information(small_axis: HammersteinWiener) -> None:
    """An axis cut in motion tells less than its whole records do, by more than the samples lost."""
    axis = stepped_axis(small_axis, TrueNoise(0.01))
    whole, rest = linearised_at_truth(axis), linearised_at_truth(in_motion(axis))
    assert all(rest[name].deviation > whole[name].deviation for name in NAMES)


def test_no_information_is_no_bound() -> None:
    information = np.array([[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e12]])
    errors, deviations = solved(information, np.array([2.0, 0.0, 1e6]))
    np.testing.assert_allclose(deviations, [0.5, np.inf, 1e-6])
    np.testing.assert_allclose(errors, [0.5, 0.0, 1e-6])


def test_what_others_explain_is_taken_out() -> None:
    rows = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 1.0], [0.3, 0.3, 1e-9]])
    left = without(rows, np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(left, [[-0.5, 0.5, 3.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], atol=1e-12)
    assert not left[2].any()
