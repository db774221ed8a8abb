"""Rounding before the noise is taken off the readings: the base is held, and no slow error is found in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import RATE, SIGMA, command, form, measured, model, record, response_with

from bayes_hw.gap.joint.given.given_base import base_and_readings, best_base, reweighted
from bayes_hw.gap.joint.given.given_response import LIMITS
from bayes_hw.gap.joint.given.given_trail import under
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.residuals.beside_fit import best_coefficients
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.rounded_readings import readings_of, without_rounding
from bayes_hw.gap.joint.search import beginning
from bayes_hw.gap.joint.search.joint_search import silent
from bayes_hw.record import Record

SAMPLES, STEP, OFF = 1500, 3.2 * SIGMA, 0.3
ROUNDING = "encoder_quantization"


def rounded(seeds: tuple[int, ...]) -> list[Record]:
    """Angles rounded to a lattice that zero is not on, then noise."""
    found = []
    for seed, plain in zip(seeds, measured((), SAMPLES, seeds), strict=True):
        noise = SIGMA * np.random.default_rng(seed + 100).standard_normal(SAMPLES)
        found.append(replace(plain, y=STEP * np.floor((plain.y - noise) / STEP + OFF) + noise))
    return found


def test_the_noise_and_the_base_are_left() -> None:
    records = rounded((1, 2))
    base = best_base(records, model())
    faults = read_faults(base)
    assert faults.rounded_first
    fit, told = without_rounding(reweighted(base, faults), faults)
    assert told.taken_off
    assert told.step == pytest.approx(STEP, rel=0.01)
    assert told.nats[ROUNDING] > 200
    assert fit.point.whitener.order <= 1
    assert fit.point.rms < 1.15 * SIGMA
    assert base.point.rms > 1.3 * SIGMA
    assert fit.values.cascade.upper == pytest.approx(0.3, rel=0.02)
    back = readings_of(records, fit)
    np.testing.assert_array_equal(back.response.records[0].y, records[0].y)
    assert back.point.rms > STEP / np.sqrt(12)


@pytest.mark.parametrize("before", [False, True])
def test_glitches_of_rounded_readings_are_found_beside_the_rounding(before: bool) -> None:
    """Whether the noise was there before the rounding or came after it; what is rounded alone has none."""
    plain = rounded((1, 2)) if not before else []
    plain = plain or [replace(r, y=STEP * np.round(r.y / STEP)) for r in measured((), SAMPLES, (1, 2))]
    base, told = base_and_readings(plain, model())
    assert told.nats.keys() == {ROUNDING}
    hit = np.arange(40, SAMPLES, 75)
    jumps = np.where(np.arange(len(hit)) % 2, 15 * STEP, -15 * STEP)
    far = [r.y.copy() for r in plain]
    for y in far:
        y[hit] += jumps
    base, told = base_and_readings([replace(r, y=y) for r, y in zip(plain, far, strict=True)], model())
    assert told.nats.keys() == {ROUNDING, "outliers"}
    assert told.step == pytest.approx(STEP, rel=0.01)
    for weights in told.weights:
        np.testing.assert_array_equal(np.flatnonzero(weights > 1), hit)
    assert base.values.cascade.upper == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("off", [0.0, 0.1])
def test_instants_that_are_off_are_found_beside_the_rounding(off: float) -> None:
    """What rounding adds grows as an axis begins to move, and is no error of timing."""
    rng, found = np.random.default_rng(12), []
    response, values = response_with((), SAMPLES)
    own, step = np.arange(SAMPLES), 0.05 * STEP
    for seed in (1, 2):
        angle = response.simulate(values, command(SAMPLES, seed)).y
        read = np.interp(own + off * np.clip(rng.standard_normal(SAMPLES), -3, 3), own, angle)
        noisy = read + 0.05 * SIGMA * rng.standard_normal(SAMPLES)
        found.append(record(step * np.round(noisy / step), seed))
    _, told = base_and_readings(found, model())
    assert told.nats.keys() == ({ROUNDING, "timing_jitter"} if off else {ROUNDING})
    if off:
        assert told.parameters["timing_jitter.sd"] * RATE == pytest.approx(off, rel=0.3)


def test_limits_that_no_command_reaches_are_left_to_their_prior() -> None:
    """The readings' offset is found beside them."""
    response, values = response_with((), SAMPLES)
    records = []
    for seed in (1, 2):
        u = 0.4 * command(SAMPLES, seed)
        noise = SIGMA * np.random.default_rng(seed + 100).standard_normal(SAMPLES)
        records.append(replace(record(response.simulate(values, u).y + 10 * SIGMA + noise, seed), u=u))
    base = best_base(records, model())
    assert np.all(base.theta[:LIMITS] > base.response.reach)
    ones = [np.ones((1, SAMPLES))] * 2
    (offset,) = best_coefficients(base, base, ones, base.point.whitener)
    assert offset == pytest.approx(10 * SIGMA, rel=0.2)


def test_an_offset_alone_is_no_rounding() -> None:
    shifted = [replace(r, y=r.y + 2 * SIGMA) for r in measured((), SAMPLES, (1, 2))]
    base = best_base(shifted, model())
    faults = replace(read_faults(base), step=STEP, nats={ROUNDING: 90.0}, rounded_first=True)
    fit, told = without_rounding(base, faults)
    assert fit is base
    assert not told.taken_off


@pytest.mark.slow
def test_rounding_has_no_slow_error_beside_it() -> None:
    records = rounded((1, 2, 3))
    rng = np.random.default_rng(1)
    found = diagnose_records(records[:2], records[2:], rng, model=model(), start="rest")
    assert found.verdict.answer == (ROUNDING,)
    low, high = found.verdict.base["noise.sigma"].hdi94
    assert low < SIGMA < high


def test_rounding_seen_on_the_way_is_taken_off_every_fit() -> None:
    base = best_base(rounded((1, 2)), model())
    fit = base.with_effect(form("gain_asymmetry"), (0.0,)).descended()
    faults = read_faults(fit)
    assert faults.rounded_first
    weighed, explained, whole, told = under(faults, base, fit, base)
    assert told.taken_off
    assert explained.point.whitener.order <= 1
    assert explained.point.rms < 1.15 * SIGMA
    assert whole is weighed
    assert weighed.response.records is explained.response.records


def test_without_a_model_the_search_begins_on_what_was_not_rounded() -> None:
    base, faults = beginning._begun(rounded((1, 2)), silent)
    assert faults.taken_off
    assert faults.step == pytest.approx(STEP, rel=0.01)
    assert base.noise_order <= 1
    assert base.point.rms < 1.15 * SIGMA
