"""Slow errors of the axis do not show inside its dead zone: what is left out, and what tells causes apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, record, scale

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.slow_noise import WALK, WIND
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.effect_moves import with_slow_noise
from bayes_hw.gap.joint.search.hidden_zone import (
    CLEAR,
    clear_of_zone,
    deep_inside,
    likelier_cause,
    nats_inside,
    where_it_shows,
)
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

SAMPLES, HALF_WIDTH = 1920, 0.06
WIDE = JointValues(replace(CASCADE, half_width=HALF_WIDTH))
"""Of a dead zone that is several slow errors wide."""


def command() -> FloatArray:
    """To and fro through the zone, 16 s each way."""
    return 0.28 * np.sign(np.sin(np.pi * (np.arange(SAMPLES) + 160) / 320))


def slow(rng: np.random.Generator, memory: float = 0.9875) -> FloatArray:
    """Of four deviations of the readings' noise, remembered for four seconds, or a `memory` of a sample."""
    e, found = rng.standard_normal(SAMPLES), np.zeros(SAMPLES)
    for k in range(1, SAMPLES):
        found[k] = memory * found[k - 1] + np.sqrt(1 - memory**2) * e[k]
    return 4 * SIGMA * found


def shifted(
    *, of_axis: bool, size: float = 1.0, memory: float = 0.9875
) -> tuple[JointResponse, list[Record]]:
    """Records with a slow error of the axis, before its dead zone, or of its readings."""
    response, found = JointResponse(STRUCTURE, (), [], scale(SAMPLES)), []
    for seed in (1, 2):
        rng, u = np.random.default_rng(seed), command()
        w, off = response.simulate(WIDE, u).w, size * slow(rng, memory)
        inner = w + off if of_axis else w
        y = np.sign(inner) * np.maximum(np.abs(inner) - HALF_WIDTH, 0.0) + (0.0 if of_axis else off)
        found.append(replace(record(y + SIGMA * rng.standard_normal(SAMPLES), seed), u=u))
    return response, found


def fitted(response: JointResponse, records: Sequence[Record]) -> JointFit:
    own = replace(response, records=list(records))
    return JointFit(own, evaluate(own, own.coordinates(WIDE)))


def test_samples_in_reach_of_the_zone_are_left_out() -> None:
    response, records = shifted(of_axis=True)
    fit = fitted(response, records)
    clear = clear_of_zone(fit, records)
    assert clear is not None
    reach = HALF_WIDTH + CLEAR * fit.point.rms
    for whole, kept in zip(records, clear, strict=True):
        w = response.simulate(WIDE, whole.u).w
        np.testing.assert_array_equal(kept.measured_samples, np.abs(w) > reach)


def test_nothing_is_left_out_where_the_error_is_white() -> None:
    response, records = shifted(of_axis=True, size=0.0)
    assert clear_of_zone(fitted(response, records), records) is None


def test_large_innovations_at_the_edges_of_the_zone_are_told_from_those_of_readings() -> None:
    """What the axis does shows outside the zone alone; an error of the readings, and glitches, everywhere."""
    response, records = shifted(of_axis=True, size=2.0, memory=0.8)
    clear = where_it_shows(fitted(response, records), records)
    assert clear is not None
    whole = sum(int(r.measured_samples.sum()) for r in records)
    assert sum(int(r.measured_samples.sum()) for r in clear) < whole
    response, readings = shifted(of_axis=False, size=2.0, memory=0.8)
    assert where_it_shows(fitted(response, readings), readings) is None
    rare = 15 * SIGMA * (np.arange(SAMPLES) % 97 == 0)
    struck = [replace(r, y=r.y + rare) for r in records]
    fit = fitted(response, struck)
    assert clear_of_zone(fit, struck) is not None
    assert where_it_shows(fit, struck) is None


def test_no_record_is_left_without_any_sample() -> None:
    """As of one whose axis stands where the zone hides it."""
    response, records = shifted(of_axis=True)
    still = replace(records[1], u=np.zeros(SAMPLES))
    fit = fitted(response, records)
    assert clear_of_zone(fit, records) is not None
    assert clear_of_zone(fit, [records[0], records[0], still]) is None


@pytest.mark.parametrize("of_axis", [True, False], ids=["torque", "readings"])
def test_what_lies_inside_tells_a_torque_from_an_angle_that_walks(of_axis: bool) -> None:
    """Beyond what noise or chance could."""
    response, records = shifted(of_axis=of_axis)
    clear = clear_of_zone(fitted(response, records), records)
    assert clear is not None
    fits = [with_slow_noise(fitted(response, clear), cause) for cause in (WIND, WALK)]
    inside = deep_inside(fits[0], records)
    torque, walk = (nats_inside(fit, records, inside) for fit in fits)
    assert (torque - walk > 30) if of_axis else (walk - torque > 30)


@pytest.mark.parametrize(
    "of_axis", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["torque", "readings"]
)
def test_the_likelier_cause_is_the_one_at_work(of_axis: bool) -> None:
    """Whichever the fit had; clear of the zone alone neither leads by as much as ten nats."""
    response, records = shifted(of_axis=of_axis)
    clear = clear_of_zone(fitted(response, records), records)
    assert clear is not None
    begun = with_slow_noise(fitted(response, clear), WALK if of_axis else WIND)
    found, lead, caused = likelier_cause(begun, records)
    assert found.labels == ((WIND,) if of_axis else (WALK,))
    assert {one.labels for one in caused} == {(WIND,), (WALK,)}
    assert abs(caused[0].score - caused[1].score) < 10 < 30 < lead


def test_the_model_is_right_without_what_the_zone_hides() -> None:
    """Limits, zone and path of the axis after a descent; with all samples, and a slow error of six deviations
    of the readings' noise, they are farther off."""
    response, records = shifted(of_axis=True, size=1.5)
    clear = clear_of_zone(fitted(response, records), records)
    assert clear is not None

    def off(some: Sequence[Record]) -> float:
        fit = with_slow_noise(fitted(response, some), WIND).descended()
        errors = [response.simulate(fit.values, r.u).y - response.simulate(WIDE, r.u).y for r in records]
        return float(np.sqrt(np.mean(np.square(errors))))

    assert off(clear) < 0.7 * off(records)
