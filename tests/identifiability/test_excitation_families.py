"""Every family makes a command at every corner of its settings."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bayes_hw.identifiability.excitation_families import Circumstances, Setting, families
from bayes_hw.identifiability.motion_limits import MotionLimits
from bayes_hw.model.blocks import Saturation


@pytest.mark.parametrize(("rate", "duration"), [(20.0, 30.0), (1000.0, 2.0), (10.0, 12.0)])
def test_commands_at_the_corners(rate: float, duration: float) -> None:
    limits = MotionLimits(1.0, 10.0, -1.0, 1.0)
    circumstances = Circumstances(rate, duration, limits, Saturation(-0.8, 1.0))
    found = families(circumstances)
    assert {family.name for family in found} == {
        "plain_sweep",
        "amplitude_modulated_sweep",
        "phase_modulated_sweep",
        "random_phase_multisine",
        "staircase",
    }
    for family in found:
        for corner in itertools.product((0.0, 1.0), repeat=len(family.settings)):
            u = family.make(family.values(np.array(corner)))
            assert u.shape == (circumstances.samples,), family.name
            assert np.isfinite(u).all()
            assert np.ptp(u) > 0


def test_modulation_of_no_depth_is_the_plain_sweep() -> None:
    circumstances = Circumstances(20.0, 30.0, MotionLimits(1.0, 10.0, -1.0, 1.0), Saturation(-0.8, 1.0))
    plain, modulated, *_ = families(circumstances)
    settings = {"amplitude": 0.7, "stop_hz": 4.0, "offset_share": 0.5}
    np.testing.assert_array_equal(
        plain.make(settings), modulated.make(settings | {"modulation_hz": 0.1, "depth": 0.0})
    )


@pytest.mark.parametrize("logarithmic", [True, False])
def test_shares_and_values_are_inverse(logarithmic: bool) -> None:
    setting = Setting("x", 0.1, 8.0, logarithmic)
    assert (setting.value(0.0), setting.value(1.0)) == pytest.approx((0.1, 8.0))
    assert setting.share(setting.value(0.3)) == pytest.approx(0.3)
