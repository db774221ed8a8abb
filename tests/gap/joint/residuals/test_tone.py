"""A line in time is found at its frequency, whatever the phase of each record, and none where none is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, RATE, SIGMA, STRUCTURE, measured, scale

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.tone import tone_in
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

SAMPLES = 700


def fitted(records: list[Record]) -> JointFit:
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()


def test_a_line_of_any_phase_is_taken_out_and_priced() -> None:
    records = measured((), SAMPLES, (1, 2))
    k = np.arange(SAMPLES)
    humming = [
        replace(r, y=r.y + 3 * SIGMA * np.sin(2 * np.pi * 0.43 * k / RATE + phase))
        for r, phase in zip(records, (0.3, 2.0), strict=True)
    ]
    base = fitted(humming)
    found = tone_in(base)
    assert found is not None
    assert abs(found.frequency_hz - 0.43) < 0.003
    assert abs(found.amplitude / (3 * SIGMA) - 1) < 0.1
    assert found.without.score > base.score + 100
    assert found.without.taken == 5
    assert abs(found.without.point.rms / SIGMA - 1) < 0.1


def test_noise_has_no_line() -> None:
    found = tone_in(fitted(measured((), SAMPLES, (1, 2))))
    assert found is None or found.without.score < fitted(measured((), SAMPLES, (1, 2))).score


def test_a_line_that_moves_the_axis_is_hidden_by_its_dead_zone() -> None:
    k = np.arange(SAMPLES)
    hidden, shown = [], []
    for r, phase in zip(measured((), SAMPLES, (1, 2)), (0.3, 2.0), strict=True):
        response = JointResponse(STRUCTURE, (), [r], scale(SAMPLES))
        run = response.simulate(JointValues(CASCADE), r.u)
        line = 0.5 * CASCADE.half_width * np.sin(2 * np.pi * 0.43 * k / RATE + phase)
        moved = run.w + line
        hidden.append(
            replace(r, y=r.y - run.y + moved - np.clip(moved, -CASCADE.half_width, CASCADE.half_width))
        )
        shown.append(line)
    base = fitted(hidden)
    found = tone_in(base)
    assert found is not None
    assert abs(found.frequency_hz - 0.43) < 0.003
    assert abs(found.amplitude / float(np.sqrt(2 * np.mean(np.concatenate(shown) ** 2))) - 1) < 0.2
    assert found.without.point.rms < 1.3 * SIGMA
