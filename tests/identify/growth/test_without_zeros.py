"""Delays of a drive train in series are told by the phases of its modes; zeros that are there stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.growth.delay import begun_at
from bayes_hw.identify.growth.extension import with_section
from bayes_hw.identify.growth.search import Grown
from bayes_hw.identify.growth.without_zeros import in_series, without_slow_parts, without_zeros
from bayes_hw.record import Record, Units

RATE, SAMPLES, DELAY, SIGMA = 200.0, 6000, 20, 5e-4
STRUCTURE = Structure(DELAY, True, 0, 2, lower=True, upper=True, dead_zone=True)
MODES = ((2.6, 0.03), (4.9, 0.05))


def series(held: bool) -> CascadeValues:
    """Integrator and modes one behind the other, of unit velocity gain."""
    s = np.array([0.0, *(s for f, d in MODES for s in pair(f, d))])
    z = np.exp(s)
    x = s if held else z
    residues = 1 / np.prod(x[:, None] - x + np.eye(5), axis=1)
    if held:
        residues[1:] *= (z[1:] - 1) / s[1:]
    return values_of(z, residues / (residues[0] * RATE))


def pair(frequency_hz: float, damping_ratio: float) -> tuple[complex, complex]:
    """Poles of continuous time, per sample."""
    one = 2 * np.pi * frequency_hz / RATE * complex(-damping_ratio, np.sqrt(1 - damping_ratio**2))
    return one, one.conjugate()


def values_of(z: np.ndarray, residues: np.ndarray) -> CascadeValues:
    sections = [
        [(z[i] + z[i + 1]).real, (z[i] * z[i + 1]).real,
         (residues[i] + residues[i + 1]).real, -(residues[i] * z[i + 1] + residues[i + 1] * z[i]).real]
        for i in (1, 3)
    ]  # fmt: skip
    return CascadeValues(
        -0.45,
        0.4,
        0.03,
        0.0,
        float(residues[0].real),
        np.zeros((2, 0)),
        np.array(sections).T,
        np.zeros((2, 5)),
    )


def fitted(values: CascadeValues, delay: int) -> Grown:
    """Begun at the truth of DELAY, then at another delay that stands in for it."""
    rng = np.random.default_rng(5)
    records = []
    for number in range(2):
        u = np.repeat(rng.normal(0, 0.3, SAMPLES // 30), 30)
        blank = Record(f"r{number}", np.arange(SAMPLES) / RATE, u, np.zeros(SAMPLES), RATE, Units())
        y = -Grown.at(STRUCTURE, values, [blank, blank], 0).point.residuals[0]
        records.append(replace(blank, y=y + SIGMA * rng.standard_normal(SAMPLES)))
    return begun_at(Grown.at(STRUCTURE, values, records).descended(), delay)


@pytest.mark.parametrize("held", [False, True], ids=["of samples", "held"])
def test_a_delay_that_zeros_stand_in_for_is_found(held: bool) -> None:
    item = fitted(series(held), DELAY + 4)
    assert item.structure.delay_samples == DELAY + 4
    found = without_zeros(item)
    assert found.structure.delay_samples == DELAY
    assert found.log_likelihood > item.log_likelihood - 1


def test_slow_parts_say_nothing_of_it() -> None:
    """Two that are kept for what they have in common with a dead zone stay where they are."""
    item = fitted(series(True), DELAY + 4)
    slow = (0.9999, 0.9998)
    structure, values = with_section(item.structure, item.values, sum(slow), slow[0] * slow[1])
    larger = Grown.at(structure, values, item.response.records)
    assert without_slow_parts(larger).structure.order == item.structure.order
    found = without_zeros(larger)
    assert (found.structure.delay_samples, found.structure.order) == (DELAY, item.structure.order + 2)


def test_residues_in_series_stay_as_they_are() -> None:
    item = fitted(series(True), DELAY)
    truth = Grown.at(STRUCTURE, series(True), item.response.records)
    again = in_series(truth, True)
    assert again is not None
    np.testing.assert_allclose(again.values.sections, truth.values.sections, rtol=1e-7)


def test_zeros_that_are_there_stay() -> None:
    """Modes beside each other: no delay makes them one behind the other."""
    beside = series(True)
    weights: FloatArray = beside.sections.copy()
    weights[2:, 0] *= 0.5
    item = fitted(replace(beside, sections=weights), DELAY)
    assert without_zeros(item) is item
