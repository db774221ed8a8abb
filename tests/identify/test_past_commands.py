"""Records begun in motion follow, for a delay, commands that nobody knows."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.four_steps import identify
from bayes_hw.identify.growth.delay import at_better_delay
from bayes_hw.identify.growth.extension import with_separate_pole
from bayes_hw.identify.growth.search import Grown, smallest_cascade
from bayes_hw.identify.holes import MOST_OF_RECORD, PAST_DELAYS, without_past
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.excitation import sine_sweep
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Record

RATE_HZ = 20.0
DELAY = 15
BEFORE = 200
SAMPLES = 400


@pytest.fixture(scope="module")
def records_in_motion() -> tuple[Record, ...]:
    """An integrator and a lag behind a delay, cut while the command sweeps."""
    linear = LinearBlock(np.zeros(0, complex), np.array([1.0, 0.8], complex), 0.2 * 0.5 / RATE_HZ, DELAY)
    model = HammersteinWiener("axis", RATE_HZ, Saturation(-0.6, 0.7), linear, DeadZone(0.0), ())
    rng = np.random.default_rng(5)
    found = []
    for name, phase in (("one", -0.8), ("two", 1.2)):
        samples = BEFORE + SAMPLES
        u = 0.9 * sine_sweep(RATE_HZ, samples / RATE_HZ, 1.0, 0.05, 2.0, start_phase_rad=phase)[:samples]
        y = model.simulate(u).y + 1e-3 * rng.standard_normal(samples)
        times = np.arange(SAMPLES) / RATE_HZ
        found.append(Record(name, times, u[BEFORE:], y[BEFORE:], RATE_HZ, model.units))
    return tuple(found)


@pytest.mark.slow
def test_delay_and_limits_are_found_where_the_past_is_unknown(records_in_motion: tuple[Record, ...]) -> None:
    """Held at its first value, the command before the record would be made up for by delay and poles."""
    model = identify(records_in_motion, max_order=3, free_start=True).model
    assert model.linear.total_delay == pytest.approx(DELAY + 1, abs=2)
    assert model.saturation.lower == pytest.approx(-0.6, rel=0.01)
    assert model.saturation.upper == pytest.approx(0.7, rel=0.01)


def test_a_poor_maximum_over_the_delay_is_left(records_in_motion: tuple[Record, ...]) -> None:
    """Poles, zeros and states stand in for a delay, and a descent that keeps it ends there."""
    told = without_past(records_in_motion, DELAY)
    structure = Structure(
        2, integrator=True, real_poles=0, sections=0, lower=True, upper=True, free_start=True
    )
    first = smallest_cascade(told, structure, 1e-3, most_noise=0)
    poor = Grown.at(*with_separate_pole(first.structure, first.values, 0.5), told, most_noise=0).descended()
    found = at_better_delay(poor)
    assert found.structure.delay_samples in (DELAY, DELAY + 1)
    assert found.log_likelihood > poor.log_likelihood + 500
    assert at_better_delay(found).log_likelihood < found.log_likelihood + 1


def test_outputs_of_two_delays_do_not_count(records_in_motion: tuple[Record, ...]) -> None:
    for record in without_past(records_in_motion, 7):
        assert not record.measured_samples[: 7 * PAST_DELAYS].any()
        assert record.measured_samples[7 * PAST_DELAYS :].all()


def test_a_long_delay_costs_only_part_of_a_record(records_in_motion: tuple[Record, ...]) -> None:
    for record in without_past(records_in_motion, 10 * SAMPLES):
        assert np.count_nonzero(~record.measured_samples) == int(MOST_OF_RECORD * SAMPLES)


def test_an_initial_state_costs_the_same_in_a_longer_record(
    records_in_motion: tuple[Record, ...],
) -> None:
    """Only what lasts costs the logarithm of the samples."""
    at_rest = Structure(DELAY + 2, integrator=True, real_poles=0, sections=0, lower=True, upper=True)
    free = smallest_cascade(records_in_motion, Structure(**{**vars(at_rest), "free_start": True}), 1e-3)
    lasting = free.parameters - len(records_in_motion)
    expected = lasting * np.log(free.point.samples) + 2 * len(records_in_motion)
    assert free.criterion + 2 * free.log_likelihood == pytest.approx(expected)
