"""The twin's records are what its docstring says."""

from __future__ import annotations

import numpy as np
import pytest
from twin import coloured_noise, twin_records

from bayes_hw.identify.validation import fit_percent

TWIN = twin_records(np.random.default_rng(1))


def test_three_records_to_train_and_two_to_validate() -> None:
    assert [len(record) for record in (*TWIN.train, *TWIN.validation)] == [2400] * 5
    assert {record.sample_rate_hz for record in (*TWIN.train, *TWIN.validation)} == {20.0}


def test_both_limits_are_reached_and_both_sides_of_the_dead_zone() -> None:
    for record in (*TWIN.train, *TWIN.validation):
        assert record.u.min() < TWIN.truth.saturation.lower
        assert record.u.max() > TWIN.truth.saturation.upper
    w = np.concatenate([TWIN.truth.simulate(record.u).w for record in TWIN.train])
    half_width = TWIN.truth.dead_zone.half_width
    assert w.max() > 2 * half_width
    assert w.min() < -2 * half_width
    assert np.mean(np.abs(w) < half_width) > 0.03


def test_the_true_model_fits_the_validation_records_as_the_papers_did() -> None:
    fits = [fit_percent(r.y, TWIN.truth.simulate(r.u).y) for r in TWIN.validation]
    assert np.mean(fits) == pytest.approx(94.6, abs=0.5)


def test_records_repeat_with_the_seed() -> None:
    again = twin_records(np.random.default_rng(1))
    np.testing.assert_array_equal(again.train[2].y, TWIN.train[2].y)


def test_noise_has_the_size_and_correlation_asked_for() -> None:
    e = coloured_noise(np.random.default_rng(2), 100_000, 0.3, 0.6)
    assert e.std() == pytest.approx(0.3, rel=0.02)
    assert np.corrcoef(e[1:], e[:-1])[0, 1] == pytest.approx(0.6, abs=0.02)
