"""A delay beyond the model's is found across whole samples, whatever the modes took up of it before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import GIVEN_SAMPLES, SIGMA, measured, model

from bayes_hw.gap.joint.given.base_starts import with_nominal_modes
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_moves import later
from bayes_hw.gap.joint.given.given_response import GivenFit


def _late(whole: int, part: float) -> tuple[GivenFit, GivenFit]:
    """The base of records that come so many samples late, and the fit that descends from the true delay."""
    records = measured((), GIVEN_SAMPLES, (1, 2))
    true = best_base(records, model()).with_delay(whole, part)
    late = []
    for number, record in enumerate(records):
        noise = SIGMA * np.random.default_rng(50 + number).standard_normal(len(record))
        late.append(replace(record, y=true.response.along(true.values, number).y + noise))
    base = best_base(late, model())
    return base, with_nominal_modes(base).with_delay(whole, part).descended()


def test_a_descent_goes_on_beyond_a_whole_sample() -> None:
    base, nearest = _late(1, 0.4)
    assert nearest.delay == pytest.approx(1.4, abs=0.1)
    for whole, part in ((0, 0.9), (2, 0.1)):
        found = with_nominal_modes(base).with_delay(whole, part).descended()
        assert found.score == pytest.approx(nearest.score, abs=0.1)
        assert found.delay == pytest.approx(nearest.delay, abs=0.02)


def test_modes_that_took_up_a_delay_give_it_back() -> None:
    base, nearest = _late(2, 0.67)
    (found,) = later(base)
    assert base.noise_order > 0
    assert found.noise_order == 0
    assert found.score == pytest.approx(nearest.score, abs=0.1)
    assert found.delay == pytest.approx(2.67, abs=0.15)
