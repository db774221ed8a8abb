"""Instants that are off by chance may be late on the whole, which is no delay of the axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import GIVEN_SAMPLES, RATE, measured, model

from bayes_hw.gap.joint.given.given_base import best_base, reweighted
from bayes_hw.gap.joint.given.given_response import DELAY, GivenFit
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.record import Record


def _read_late(lag: float, deviation: float) -> list[Record]:
    """Records read so many samples late, more or less by chance."""
    rng, found = np.random.default_rng(3), []
    for seed in (1, 2):
        (r,) = measured((), GIVEN_SAMPLES, (seed,))
        own = np.arange(len(r))
        found.append(replace(r, y=np.interp(own - lag - deviation * rng.standard_normal(len(r)), own, r.y)))
    return found


def _fitted(deviation: float) -> GivenFit:
    """Of readings 0.4 samples late, to readings that are said to be off by `deviation` samples."""
    base = best_base(_read_late(0.4, 0.6), model())
    told = {"timing_jitter.sd": deviation / RATE}
    return reweighted(base, replace(read_faults(base), nats={"timing_jitter": 100.0}, parameters=told))


def test_a_lag_within_the_deviation_of_the_instants_is_theirs() -> None:
    found = _fitted(0.6)
    assert found.labels == ()
    assert abs(found.delay - 0.4) < 0.15


def test_a_longer_one_is_a_delay() -> None:
    found = _fitted(0.6)
    assert replace(found, response=replace(found.response, late=0.1)).labels == (DELAY,)
    assert best_base(_read_late(0.4, 0.6), model()).delay == 0
