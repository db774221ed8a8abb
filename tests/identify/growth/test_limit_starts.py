"""A limit that stands where it clips next to nothing is begun elsewhere, and one that clips is left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wide_axes import axis_of_task

from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.experiment import prepare
from bayes_hw.identify.growth.cascade_response import CascadeResponse, outermost_limits
from bayes_hw.identify.growth.search import (
    SHARES,
    Grown,
    beyond_all_commands,
    grow,
    smallest_cascade,
    with_least_squares,
    with_limits_anew,
)
from bayes_hw.identify.noise import MAX_ORDER
from bayes_hw.record import Record, Units

LOWER, UPPER, HALF_WIDTH, RESIDUE = -0.4, 0.7, 0.05, 0.02
STRUCTURE = Structure(1, True, 0, 0, lower=True, upper=True, dead_zone=True)


def records(noise: float, lower: float = LOWER, upper: float = UPPER) -> list[Record]:
    """Of an integrator behind the limits."""
    rng, t = np.random.default_rng(5), np.arange(800) / 20.0
    found = []
    for name in ("a", "b"):
        u = np.repeat(rng.normal(0, 0.8, 40), 20)
        w = RESIDUE * np.concatenate([[0.0, 0.0], np.cumsum(np.clip(u, lower, upper))[:-2]])
        y = np.sign(w) * np.maximum(np.abs(w) - HALF_WIDTH, 0) + noise * rng.standard_normal(len(t))
        found.append(Record(name, t, u, y, 20.0, Units()))
    return found


def values(lower: float, upper: float, residue: float = 0.01) -> CascadeValues:
    return CascadeValues(
        lower, upper, HALF_WIDTH, 0.0, residue, np.zeros((2, 0)), np.zeros((4, 0)), np.zeros((2, 1))
    )


def test_the_weights_of_a_known_axis_are_found_and_nothing_is_left() -> None:
    left, found = with_least_squares(STRUCTURE, values(LOWER, UPPER), records(0.0))
    assert left < 1e-20
    assert found.integrator_residue == pytest.approx(RESIDUE)


def test_a_limit_that_no_command_reaches_takes_nothing_off_the_angle() -> None:
    """Six commands stand out from all others, each farther; what a limit took off them would stay in the
    angle of an integrator to the end of the record."""
    noise, peaks = 1e-4, 1.0 + 0.05 * np.arange(6)
    t = np.arange(400) / 20.0
    u = 0.3 * np.sin(t)
    u[30:150:20] = peaks
    w = RESIDUE * np.concatenate([[0.0, 0.0], np.cumsum(u)[:-2]])
    y = np.sign(w) * np.maximum(np.abs(w) - HALF_WIDTH, 0)
    given = [Record("peaks", t, u, y, 20.0, Units())]
    response = CascadeResponse(STRUCTURE, given)
    outermost = response.outermost_limits
    assert peaks[-2] <= outermost[1] < peaks[-1]
    (left,) = response.residuals(response.coordinates(values(*outermost, residue=RESIDUE)))
    assert np.abs(left).max() < 0.1 * RESIDUE
    assert np.abs(left).max() > noise


@pytest.mark.parametrize("sides", [(True, False), (False, True), (True, True)])
def test_a_limit_that_clips_nothing_is_begun_near_the_true_one(sides: tuple[bool, bool]) -> None:
    given = records(0.001)
    outermost = outermost_limits(given)
    stuck = [at if side else true for at, side, true in zip(outermost, sides, (LOWER, UPPER), strict=True)]
    found = with_limits_anew(CascadeResponse(STRUCTURE, given), values(*stuck))
    assert found is not None
    step = SHARES[1] - SHARES[0]
    assert abs(found.lower - LOWER) <= step * abs(outermost[0])
    assert abs(found.upper - UPPER) <= step * abs(outermost[1])


def test_a_limit_that_clips_is_left_alone() -> None:
    assert with_limits_anew(CascadeResponse(STRUCTURE, records(0.001)), values(LOWER, UPPER)) is None
    stuck = replace(STRUCTURE, lower=False, upper=False)
    assert with_limits_anew(CascadeResponse(stuck, records(0.001)), values(-np.inf, np.inf)) is None


def test_limits_that_clip_what_none_did_are_begun_beyond_all_commands() -> None:
    """The angle of an axis without limits: from ones that clip, those beyond all commands leave the noise
    alone; from there nothing is begun."""
    noise = 1e-3
    free = records(noise, -np.inf, np.inf)
    outermost = outermost_limits(free)
    clipping = Grown.at(STRUCTURE, values(0.7 * outermost[0], 0.7 * outermost[1], RESIDUE), free, MAX_ORDER)
    found = beyond_all_commands(clipping)
    assert found.point.rms == pytest.approx(noise, rel=0.1)
    assert clipping.point.rms > 10 * noise
    assert (found.values.lower, found.values.upper) == pytest.approx(outermost, rel=0.01)
    there = Grown.at(STRUCTURE, values(*outermost, RESIDUE), free, MAX_ORDER)
    assert beyond_all_commands(there) is there


def test_growth_leaves_a_limit_that_a_smaller_cascade_put_out_of_reach() -> None:
    """An axis of three modes, slews and much noise: an integrator alone asks for no lower limit."""
    axis = axis_of_task({"source": "wide", "seed": 1001, "index": 21}).known
    experiment = prepare(list(axis.records), free_start=False)
    structure = replace(STRUCTURE, delay_samples=37)
    start = smallest_cascade(experiment.records, structure, experiment.noise_level)
    assert start.values.lower == pytest.approx(outermost_limits(experiment.records)[0])
    found = grow(start, 4)[4].values.lower * experiment.input_scale
    assert found == pytest.approx(axis.model.saturation.lower, rel=0.02)
