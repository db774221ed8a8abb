"""The freed axis is the paper's where its gains are nominal, and eq. 5 with two thresholds elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.identifiability.freed_gains import ALL_FREED, ASYMMETRIES, SLOPE, FreedGains, with_unit_slopes
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.blocks import GainNormalization
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def values_with(axis: FreedGains, **changes: float) -> np.ndarray:
    values = axis.nominal
    for name, value in changes.items():
        values[axis.names.index(name.replace("__", "."))] = value
    return values


@pytest.mark.parametrize("positions", [None, np.array([0.7]), np.array([-0.7])], ids=str)
def test_nominal_gains_are_the_papers_axis(
    small_axis: HammersteinWiener, swinging_record: Record, positions: np.ndarray | None
) -> None:
    plain = AxisParameters(small_axis, start_positions=positions)
    freed = FreedGains(small_axis, start_positions=positions)
    expected = simulated_outputs(plain, plain.nominal[:, None], [swinging_record])[0]
    np.testing.assert_allclose(
        simulated_outputs(freed, freed.nominal[:, None], [swinging_record])[0], expected, atol=1e-13
    )


def test_unequal_gains_and_thresholds_follow_equations_1_and_5(
    small_axis: HammersteinWiener, swinging_record: Record
) -> None:
    """Against numpy on the model's own linear block."""
    freed = FreedGains(small_axis)
    values = values_with(
        freed,
        saturation__gain=1.3,
        dead_zone__gain_positive=0.8,
        dead_zone__gain_negative=1.7,
        dead_zone__half_width=0.05,
        dead_zone__half_width_negative=0.11,
    )
    v = np.clip(1.3 * swinging_record.u, -0.8, 1.0)
    w = small_axis.linear.filter(v)
    expected = np.where(w > 0.05, 0.8 * (w - 0.05), np.where(w < -0.11, 1.7 * (w + 0.11), 0.0))
    assert min(np.mean(w > 0.05), np.mean(w < -0.11)) > 0.05
    found = simulated_outputs(freed, values[:, None], [swinging_record])[0][0]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_unit_slopes_change_no_output(small_axis: HammersteinWiener, swinging_record: Record) -> None:
    scaled = small_axis.normalized(GainNormalization(1.4, 0.6, 0.9))
    unit = with_unit_slopes(scaled)
    assert (unit.normalization.c1, unit.normalization.c2) == (1.0, 1.0)
    np.testing.assert_allclose(
        unit.simulate(swinging_record.u).y, scaled.simulate(swinging_record.u).y, atol=1e-13
    )


def test_only_the_gains_asked_for_are_parameters(small_axis: HammersteinWiener) -> None:
    assert set(FreedGains(small_axis, ALL_FREED).names) - set(AxisParameters(small_axis).names) == set(
        ALL_FREED
    )
    assert FreedGains(small_axis, ASYMMETRIES).freed == ASYMMETRIES
    with pytest.raises(InputError, match=r"choose from saturation\.gain"):
        FreedGains(small_axis, ("gain",))


def test_embedding_takes_values_by_name(small_axis: HammersteinWiener) -> None:
    plain, freed = AxisParameters(small_axis), FreedGains(small_axis)
    found = dict(zip(freed.names, freed.embedded(2 * plain.nominal, plain.names), strict=True))
    assert found["gain"] == 2 * small_axis.linear.gain
    assert found["dead_zone.half_width_negative"] == found["dead_zone.half_width"] == 0.04
    assert found[SLOPE] == 1.0


def test_no_dead_zone_still_has_a_threshold_to_free(small_axis: HammersteinWiener) -> None:
    none = replace(small_axis, dead_zone=replace(small_axis.dead_zone, half_width=0.0))
    assert np.all(FreedGains(none, output_scale=2.0).nominal[2] > 0)
