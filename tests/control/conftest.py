"""Fixtures of the tests of controllers: a hundred or so axes around a small one, and a loop around them."""

from __future__ import annotations

import numpy as np
import pytest
from spread_axis import spread_posterior

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener


@pytest.fixture(scope="session")
def posterior(small_axis: HammersteinWiener) -> Posterior:
    return spread_posterior(small_axis)


@pytest.fixture(scope="session")
def axis(posterior: Posterior) -> AxisDraws:
    """120 draws."""
    return AxisDraws.of_posterior(posterior, posterior.draws(120, np.random.default_rng(2)))


@pytest.fixture(scope="session")
def nominal(posterior: Posterior) -> AxisDraws:
    return AxisDraws.nominal(posterior)


@pytest.fixture(scope="session")
def controller() -> Controller:
    """A PI of moderate gain: stable around every draw."""
    return Controller("PI", 20.0, 1.2, 0.3)
