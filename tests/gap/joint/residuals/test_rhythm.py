"""Readings that are worse at every m-th sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, measured, scale
from scipy.signal import lfilter

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.reading_parts import EVERY, TIMING, Fault, Looked, held, mistimed
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.rhythm import PRESENT_NATS, rhythm
from bayes_hw.gap.joint.residuals.speed_noise import speeds
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

SAMPLES = 600


def _all(white: list[FloatArray]) -> list[BoolArray]:
    return [np.ones(len(e), dtype=bool) for e in white]


def test_a_rhythm_is_told_from_even_noise_a_burst_and_heavy_tails() -> None:
    rng = np.random.default_rng(2)
    even = [rng.standard_normal(2000) for _ in range(2)]
    burst = [e.copy() for e in even]
    burst[0][300:400] *= 3
    heavy = [[rng.standard_t(2.5, 2000)] for _ in range(20)]
    assert rhythm(even, _all(even)).nats < 10
    assert not any(rhythm(white, _all(white)).present for white in (burst, *heavy))
    beat = [e.copy() for e in even]
    for e in beat:
        e[::5] *= 1.5
    assert rhythm(beat, _all(beat)).nats > 30


def test_samples_of_which_none_counts_are_as_good_as_the_best() -> None:
    """As where every second reading repeats the one before."""
    white = [np.random.default_rng(6).standard_normal(3000)]
    white[0][::4] *= 2
    found = rhythm(white, [np.arange(3000) % 2 == 0])
    assert found.present
    assert found.every == 4
    np.testing.assert_allclose(found.deviations, [2, 1, 1, 1], rtol=0.1)


def test_deviations_and_where_they_repeat_are_found() -> None:
    """Also where records have holes: a sample's number counts, not how many were measured before it."""
    rng = np.random.default_rng(3)
    white = [rng.standard_normal(3000) for _ in range(2)]
    for e in white:
        e[2::5] *= 1.6
    masks = [rng.random(3000) < 0.8 for _ in white]
    found = rhythm(white, masks)
    assert found.present
    assert found.every == 5
    np.testing.assert_allclose(found.deviations, [1, 1, 1.6, 1, 1], rtol=0.1)
    assert found.weights(7).tolist() == found.deviations[[0, 1, 2, 3, 4, 0, 1]].tolist()


@pytest.mark.slow
def test_false_rhythms_are_as_rare_as_their_nats_say() -> None:
    """Of noise that follows itself too: its classes differ less by chance than those of white noise."""
    rng = np.random.default_rng(4)
    for memory in (0.0, 0.9):
        shown = [lfilter([1.0], [1.0, -memory], rng.standard_normal(1500))[500:] for _ in range(2000)]
        assert max(rhythm([e], _all([e])).nats for e in shown) < PRESENT_NATS


def _fitted(records: Sequence[Record]) -> JointFit:
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))


def test_beside_a_rhythm_no_error_of_timing_is_looked_for() -> None:
    """Of readings whose instants are off, which alone are told."""
    rng = np.random.default_rng(7)
    records = measured((), SAMPLES, (1, 2))
    late = [
        replace(record, y=record.y + 4 * moves * rng.standard_normal(SAMPLES))
        for record, moves in zip(records, speeds(_fitted(records)), strict=True)
    ]
    looked = Looked.at(_fitted(late))
    alone = mistimed(looked)
    assert alone is not None and alone.label == TIMING
    assert mistimed(looked.beside(Fault(OTHER, 100.0, {EVERY: 3.0}))) is None
    assert held(looked.beside(Fault(OTHER, 100.0, {EVERY: 3.0}))) is None


def test_a_rhythm_of_the_readings_has_no_name_and_weights_them() -> None:
    records = []
    for seed, record in enumerate(measured((), SAMPLES, (1, 2))):
        worse = np.zeros(SAMPLES)
        worse[::3] = 2 * SIGMA * np.random.default_rng(seed).standard_normal(len(worse[::3]))
        records.append(replace(record, y=record.y + worse))
    readings = read_faults(_fitted(records).descended())
    assert readings.nats.keys() == {OTHER}
    assert readings.parameters == {EVERY: 3.0}
    for weights in readings.weights:
        np.testing.assert_allclose(weights[:3], [np.sqrt(5), 1, 1], rtol=0.15)
