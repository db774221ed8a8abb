"""Moves around a given model that begin with two labels, of which neither alone shows what it is worth."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import SIGMA, form, measured, model

from bayes_hw.gap.joint.given.free_shape import free_shape
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_moves import both_over_position
from bayes_hw.gap.joint.given.given_search import _with_what_only_all_show
from bayes_hw.gap.joint.response.joint_values import Effect

SAMPLES = 700


def test_both_errors_of_the_reading_over_position_are_found_beside_each_other() -> None:
    """They have far fewer numbers than the function of position that explains as much."""
    period = float(np.ptp(measured((), SAMPLES, (1,))[0].y)) / 4
    planted = (
        Effect(form("gain_asymmetry"), np.array([0.1])),
        Effect(form("encoder_eccentricity"), np.array([0.012, 0.006, 2 * np.pi / period])),
    )
    base = best_base(measured(planted, SAMPLES, (1, 2)), model())
    best = max(both_over_position(base), key=lambda fit: fit.score)
    assert sorted(best.labels) == ["encoder_eccentricity", "gain_asymmetry"]
    assert best.score > free_shape(base).score > base.score + 50
    of_disc = next(e for e in best.values.effects if e.form.label == "encoder_eccentricity")
    assert 2 * np.pi / of_disc.values[-1] == pytest.approx(period, rel=0.02)


@pytest.mark.slow
def test_what_only_all_samples_show_is_found_beside_what_others_did() -> None:
    """A drift of the sensor beside an eccentricity; an explanation that leaves white noise stays as it is."""
    wavenumber = 8 * np.pi / float(np.ptp(measured((), SAMPLES, (1,))[0].y))
    disc = Effect(form("encoder_eccentricity"), np.array([6 * SIGMA, 0.0, wavenumber]))
    drift = Effect(form("sensor_drift", "ramp"), np.array([2e-5]))
    for planted, expected in (((disc, drift), 2), ((disc,), 1)):
        base = best_base(measured(planted, SAMPLES, (1, 2)), model())
        alone = base.with_effect(disc.form, (0.0, 0.0, wavenumber)).descended()
        whole = _with_what_only_all_show(alone)
        assert len(whole.labels) == expected
        assert (whole is alone) == (expected == 1)
