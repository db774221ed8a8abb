"""Profiles against Gaussian theory, open sides, and falls that another parameter's bound causes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from identifiability.conftest import swinging

from bayes_hw.identifiability import profile
from bayes_hw.identifiability.profile import (
    THRESHOLD,
    Misfit,
    Point,
    Profile,
    both_sides,
    parted,
    profile_likelihoods,
)
from bayes_hw.identifiability.sensitivity import fisher_information
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import as_coordinates
from bayes_hw.record import Record

AUTOREGRESSION = np.array([0.5])
INNOVATION_SIGMA = 0.01 * np.sqrt(0.75)


def profiles_of(
    model: HammersteinWiener, record: Record, names: Sequence[str] | None = None
) -> dict[str, Profile]:
    axis = AxisParameters(model)
    found = profile_likelihoods(axis, axis.nominal, [record], AUTOREGRESSION, INNOVATION_SIGMA, names)
    return {each.name: each for each in found}


def test_gaussian_parameters_have_gaussian_profiles(
    small_axis: HammersteinWiener, swinging_record: Record
) -> None:
    """95 % ends at 1.96 marginal standard deviations of the Fisher information, others re-estimated."""
    found = profiles_of(small_axis, swinging_record)
    axis = AxisParameters(small_axis)
    estimate = found["gain"].nuisance[np.argmax(found["gain"].log_likelihood)]
    information = fisher_information(
        axis, estimate[:, None], [swinging_record], AUTOREGRESSION[:, None], np.array([INNOVATION_SIGMA])
    )[0]
    sd = np.sqrt(np.diag(np.linalg.inv(information)))
    for name in ("gain", "mode1.frequency_hz", "saturation.upper", "saturation.lower"):
        row = axis.names.index(name)
        low, high = found[name].interval()
        assert low is not None and high is not None
        expected = 2 * np.sqrt(2 * THRESHOLD) * sd[row]
        assert np.log(high / low) * np.sign(high) == pytest.approx(expected, rel=0.12), name
        assert (found[name].lower, found[name].upper) == ("falls", "falls")
        assert not any(found[name].at_bound)


def test_limits_never_reached_are_open(small_axis: HammersteinWiener) -> None:
    found = profiles_of(small_axis, swinging(small_axis, 3, share=0.4))
    assert found["saturation.upper"].upper == "open"
    assert found["saturation.lower"].lower == "open"
    assert found["saturation.upper"].interval()[1] is None
    assert found["saturation.upper"].fall(above=True) < THRESHOLD
    assert (found["gain"].lower, found["gain"].upper) == ("falls", "falls")


def test_nuisance_paths_are_kept(small_axis: HammersteinWiener, swinging_record: Record) -> None:
    """Along the gain's profile the limits give way: less limit for more gain."""
    gain = profiles_of(small_axis, swinging_record, ["gain"])["gain"]
    assert gain.nuisance.shape == (len(gain.values), len(gain.names))
    np.testing.assert_array_equal(gain.nuisance[:, gain.names.index("gain")], gain.values)
    upper = gain.nuisance[:, gain.names.index("saturation.upper")]
    assert np.corrcoef(gain.values, upper)[0, 1] < -0.9
    assert np.all(np.diff(gain.values) > 0)


def test_a_fall_at_another_parameters_bound_says_so(
    small_axis: HammersteinWiener, swinging_record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With all others held within a hair, the gain's likelihood falls because they cannot follow."""
    monkeypatch.setattr(profile, "BOUND", 2e-3)
    monkeypatch.setattr(profile, "AT_BOUND", 1e-4)
    gain = profiles_of(small_axis, swinging_record, ["gain"])["gain"]
    assert "falls at a bound" in (gain.lower, gain.upper)
    above = gain.upper == "falls at a bound"
    assert gain.bound_partner(above) in gain.names
    assert any(gain.at_bound)


def test_a_dead_zone_that_may_be_absent_has_a_zero_side(small_axis: HammersteinWiener) -> None:
    none = replace(small_axis, dead_zone=replace(small_axis.dead_zone, half_width=1e-4))
    found = profiles_of(small_axis, swinging(none, 4), ["dead_zone.half_width"])
    assert found["dead_zone.half_width"].lower == "zero"
    assert found["dead_zone.half_width"].upper == "falls"


def test_points_are_parted_at_an_estimate_that_moved() -> None:
    """A better likelihood found beyond the points of one side: they lie on the other side of it."""

    def point(at: float) -> Point:
        return Point(np.array([0.0, at]), -at, ())

    sides = [[point(at) for at in (0.9, 0.5, 0.2)], [point(at) for at in (1.1, 2.0)]]
    below, above = parted(sides, point(0.4), 1)
    assert [float(each.coordinates[1]) for each in below] == [0.2]
    assert [float(each.coordinates[1]) for each in above] == [0.5, 0.9, 1.1, 2.0]


def test_a_side_that_the_last_restart_left_empty_is_followed(
    small_axis: HammersteinWiener, swinging_record: Record
) -> None:
    """A better estimate below every point: what lies below it was never looked at, so it is not open."""
    axis = AxisParameters(small_axis)
    misfit = Misfit(axis, [swinging_record], AUTOREGRESSION, INNOVATION_SIGMA)
    best = misfit.minimised(as_coordinates(axis.parameters, axis.nominal), None)
    row = axis.names.index("gain")
    further = best.coordinates.copy()
    further[row] += 0.1
    sides = both_sides(misfit, best, row, [[], [Point(further, best.log_likelihood - 9.0, ())]])
    below, above = parted(sides, best, row)
    assert len(above) == 1
    assert best.log_likelihood - below[-1].log_likelihood > THRESHOLD
    assert both_sides(misfit, best, row, sides) is sides
