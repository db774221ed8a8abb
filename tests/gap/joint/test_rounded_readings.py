"""Rounding before the noise is taken off the readings: the base is held, and no slow error is found in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, form, measured
from test_given_search import model

from bayes_hw.gap.joint.given_search import base_and_readings, best_base, reweighted
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.joint_values import Effect
from bayes_hw.gap.joint.readings import read_faults
from bayes_hw.gap.joint.rounded_readings import readings_of, without_rounding
from bayes_hw.record import Record

SAMPLES, STEP, OFF = 1500, 3.2 * SIGMA, 0.3
ROUNDING = "encoder_quantization"


def rounded(seeds: tuple[int, ...], effects: tuple[Effect, ...] = ()) -> list[Record]:
    """Angles rounded to a lattice that zero is not on, then noise."""
    found = []
    for seed, plain in zip(seeds, measured(effects, SAMPLES, seeds), strict=True):
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


def test_an_offset_alone_is_no_rounding() -> None:
    shifted = [replace(r, y=r.y + 2 * SIGMA) for r in measured((), SAMPLES, (1, 2))]
    base = best_base(shifted, model())
    faults = replace(read_faults(base), step=STEP, nats={ROUNDING: 90.0}, rounded_first=True)
    fit, told = without_rounding(base, faults)
    assert fit is base
    assert not told.taken_off


def test_rounding_has_no_slow_error_beside_it() -> None:
    records = rounded((1, 2, 3))
    found = diagnose_records(records[:2], records[2:], np.random.default_rng(1), model=model())
    assert found.verdict.answer == (ROUNDING,)
    low, high = found.verdict.base["noise.sigma"].hdi94
    assert low < SIGMA < high


def test_an_effect_beside_rounding_has_its_strength_and_leaves_white_noise() -> None:
    uneven = Effect(form("gain_asymmetry"), np.array([0.12]))
    base, readings = base_and_readings(rounded((1, 2), (uneven,)), model())
    fit = base.with_effect(form("gain_asymmetry"), (0.0,)).descended()
    assert readings.taken_off
    assert fit.point.whitener.order <= 1
    assert fit.values.effects[0].values[0] == pytest.approx(0.12, rel=0.05)
