"""The notch takes off what it says at its frequency and nothing far away."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.control.controller import Controller
from bayes_hw.control.notch import Notch
from bayes_hw.errors import InputError


def test_depth_at_its_frequency_and_none_far_away() -> None:
    controller = Controller("c", 20.0, 1.0, notches=(Notch(3.3, 0.03, 0.3),))
    size = np.abs(controller.response(np.array([1e-3, 3.3, 10.0])))
    np.testing.assert_allclose(size, [1, 0.1, 1], rtol=1e-5)


@pytest.mark.parametrize("values", [(0, 0.1, 0.2), (1, -0.1, 0.2), (1, 0.1, 0), (np.nan, 0.1, 0.2)])
def test_refuses_what_is_no_notch(values: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="notches"):
        Notch(*values)
