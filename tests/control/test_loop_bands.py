"""Bands of the sensitivities hold what they say, and S + T is one."""

from __future__ import annotations

import numpy as np

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.design import CURVES, loop_bands
from bayes_hw.control.loop import Loop


def test_bands(axis: AxisDraws, nominal: AxisDraws, controller: Controller) -> None:
    loop = Loop(axis, controller)
    bands = loop_bands(loop, Loop(nominal, controller))
    response = loop.response(bands.frequency_hz)
    size = 20 * np.log10(np.abs(1 / (1 + response)))
    inside = np.mean((size >= bands.sensitivity_db[0]) & (size <= bands.sensitivity_db[1]), axis=0)
    np.testing.assert_allclose(inside, 0.94, atol=0.03)
    np.testing.assert_array_equal(bands.curves, response[:CURVES])
    centre = bands.nominal_curve
    np.testing.assert_allclose(10 ** (bands.nominal_complementary_db / 20), np.abs(centre / (1 + centre)))
    assert (bands.complementary_db[0] <= bands.complementary_db[1]).all()
