"""The closed fraction: worked by hand, and its interval over many records."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from drive_axis import white
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.shrink import (
    Closure,
    _positive_normal,
    closure,
    measured_closure,
    rounded_outward,
    without_glitches,
)
from bayes_hw.gap.noise.random_cause import RANDOM_CAUSES

N = 4000
SIGMA = 0.1
T = 2 * np.pi * np.arange(N) / N
TRUTH = np.cos(3 * T)


def closed(
    before: FloatArray,
    after: FloatArray,
    draws: list[FloatArray],
    measured: FloatArray,
    seed: int = 0,
    hidden: bool = False,
) -> Closure:
    return closure(
        before=[before],
        after=[after],
        draws=[[draw] for draw in draws],
        measured=[measured],
        shown=[after],
        noise_sigma=SIGMA,
        correlation=0.0,
        rng=np.random.default_rng(seed),
        hidden=hidden,
    )


def test_a_gap_removed_whole() -> None:
    """Root mean squares as measured, nearly all closed, the interval near one."""
    measured = TRUTH + white(N, SIGMA, 1)
    found = closed(TRUTH + 0.5 * np.sqrt(2) * np.sin(20 * T), TRUTH, [TRUTH] * 60, measured)
    assert found.rmse_before == pytest.approx(np.sqrt(0.5**2 + SIGMA**2), rel=0.02)
    assert found.rmse_after == pytest.approx(SIGMA, rel=0.04)
    assert found.noise_floor == SIGMA
    assert found.closed > 0.99 and found.closed_hdi94[0] > 0.985 and found.closed_hdi94[1] <= 1


def test_what_stays_on_the_record_counts() -> None:
    """Error of four parts removed, one part left: 0.8 of the squared error."""
    left, removed = np.sqrt(2) * np.sin(7 * T), 2 * np.sqrt(2) * np.cos(11 * T)
    measured = TRUTH + white(N, SIGMA, 2)
    found = closed(TRUTH + left + removed, TRUTH + left, [TRUTH + left] * 60, measured)
    assert found.closed == pytest.approx(0.8, abs=0.01)
    assert found.closed_hdi94[0] < 0.8 < found.closed_hdi94[1]


@pytest.mark.parametrize(("before", "after"), [(3.0, 1.0), (1.0, -0.4)])
def test_what_is_left_may_lie_along_what_was_removed(before: float, after: float) -> None:
    """An effect of the right shape and the wrong size, as on a record beyond the training travel."""
    shape = np.sqrt(2) * np.sin(7 * T)
    measured = TRUTH + white(N, SIGMA, 6)
    found = closed(TRUTH + before * shape, TRUTH + after * shape, [TRUTH + after * shape] * 60, measured)
    assert found.closed == pytest.approx(1 - (after / before) ** 2, abs=0.02)


def test_what_no_one_can_track_stays() -> None:
    """Half of the reducible error is a disturbance, which the record alone tells."""
    measured = TRUTH + white(N, SIGMA, 3) + white(N, 0.5, 4)
    before = TRUTH + 0.5 * np.sqrt(2) * np.sin(20 * T)
    found = measured_closure(
        [before], [TRUTH], [measured], SIGMA, 0.01 * SIGMA, 0.0, np.random.default_rng(0)
    )
    assert found.closed == pytest.approx(0.5, abs=0.06)
    assert found.closed_hdi94[0] < found.closed < found.closed_hdi94[1]


def test_intervals_of_records_alone_cover() -> None:
    """A slow disturbance over half of the error removed: 88 % or more of 150 intervals hold the truth."""
    rng, hits = np.random.default_rng(8), []
    before = TRUTH + 0.5 * np.sqrt(2) * np.sin(20 * T)
    for _ in range(150):
        slow = np.convolve(rng.normal(size=N + 40), np.ones(40) / 40, "valid")[:N]
        moved = TRUTH + 3 * slow
        estimated = SIGMA * (1 + 0.02 * rng.normal())
        measured = [moved + SIGMA * rng.normal(size=N)]
        found = measured_closure([before], [TRUTH], measured, estimated, 0.02 * SIGMA, 0.0, rng)
        true = 1 - np.mean((moved - TRUTH) ** 2) / np.mean((moved - before) ** 2)
        hits.append(found.closed_hdi94[0] <= true <= found.closed_hdi94[1])
    assert 0.88 <= np.mean(hits) <= 0.995


@pytest.mark.parametrize(("counted", "least", "most"), [(0.8, 0.88, 0.995), (0.0, 0.0, 0.8)])
def test_memory_of_the_noise_counts(counted: float, least: float, most: float) -> None:
    """Noise of correlation 0.8 beside a slow disturbance: the intervals hold where that is counted."""
    rng, hits = np.random.default_rng(11), []
    before = TRUTH + 2 * SIGMA * np.sin(7 * T)
    for _ in range(150):
        moved = TRUTH + 0.5 * SIGMA * np.sin(5 * T + rng.uniform(0, 6))
        noise = lfilter([1.0], [1.0, -0.8], 0.6 * SIGMA * rng.normal(size=N + 100))[100:]
        error = 0.0 if counted else 0.001 * SIGMA
        found = measured_closure([before], [TRUTH], [moved + noise], SIGMA, error, counted, rng)
        true = 1 - np.mean((moved - TRUTH) ** 2) / np.mean((moved - before) ** 2)
        hits.append(found.closed_hdi94[0] <= true <= found.closed_hdi94[1])
    assert least <= np.mean(hits) <= most


def test_a_drift_taken_off_the_readings_is_as_sure_as_its_draws() -> None:
    """A ramp estimated with an error of a noise at its end: 88 % or more of 150 intervals hold the truth,
    few where the draws are not given."""
    rng, ramp, hits = np.random.default_rng(12), np.arange(N) / N, {True: [], False: []}
    before = TRUTH + 2 * SIGMA * np.sin(7 * T) + SIGMA * ramp
    for _ in range(150):
        off = SIGMA * rng.normal()
        moved = TRUTH + SIGMA * np.sin(5 * T + rng.uniform(0, 6))
        readings = [moved + SIGMA * rng.normal(size=N) + off * ramp]
        drifts = [[SIGMA * rng.normal() * ramp] for _ in range(64)]
        true = 1 - np.mean((moved - TRUTH) ** 2) / np.mean((moved - before) ** 2)
        for known in hits:
            found = measured_closure(
                [before], [TRUTH], readings, SIGMA, 0.01 * SIGMA, 0.0, rng, drifts if known else ()
            )
            hits[known].append(found.closed_hdi94[0] <= true <= found.closed_hdi94[1])
    assert np.mean(hits[True]) >= 0.88
    assert np.mean(hits[False]) < 0.7


def test_a_drifting_encoder_does_not_count() -> None:
    """Drift of the readings much larger than the gap leaves the closure to the parameters."""
    drift = np.cumsum(white(N, 0.05, 9))
    before = TRUTH + 0.2 * np.sin(20 * T)
    measured = TRUTH + drift + white(N, SIGMA, 10)
    assert closed(before, TRUTH, [TRUTH] * 60, measured, hidden=True).closed_hdi94 == (1.0, 1.0)
    assert closed(before, TRUTH, [TRUTH] * 60, measured).closed < 0.1


def test_intervals_cover() -> None:
    """y = theta x + noise with theta estimated: 88 % or more of 60 intervals hold the true fraction."""
    rng, n, hits = np.random.default_rng(5), 300, []
    x, theta = rng.normal(size=n), 0.5 * SIGMA
    error = SIGMA / np.sqrt(np.sum(x**2))
    for seed in range(60):
        estimate = theta + rng.normal(0, error)
        draws = [(estimate + rng.normal(0, error)) * x for _ in range(64)]
        held = theta * x + rng.normal(0, SIGMA, n)
        found = closed(0 * x, estimate * x, draws, held, seed=seed)
        true = 1 - (estimate - theta) ** 2 / theta**2
        hits.append(found.closed_hdi94[0] <= true <= found.closed_hdi94[1])
    assert np.mean(hits) >= 0.88


@pytest.mark.parametrize(
    ("interval", "rounded"),
    [
        ((0.99974, 0.99997), (0.999, 1.0)),
        ((0.7, 0.9), (0.7, 0.9)),
        ((-0.0123, -0.0004), (-0.013, 0.0)),
        ((1.0, 1.0), (1.0, 1.0)),
    ],
)
def test_ends_are_rounded_outward(interval: tuple[float, float], rounded: tuple[float, float]) -> None:
    assert rounded_outward(*interval) == rounded


def test_as_in_the_verdict() -> None:
    found = Closure(2.0, 1.0, 0.5, 0.8, (0.7, 0.9)).to_dict()
    assert found == {
        "rmse_before": 2.0, "rmse_after": 1.0, "noise_floor": 0.5, "closed": 0.8, "closed_hdi94": [0.7, 0.9],
    }  # fmt: skip


def named(label: str) -> Any:
    """What stands for an explanation by a random cause."""
    return SimpleNamespace(stochastic=SimpleNamespace(isolates=RANDOM_CAUSES[label].isolated))


def test_glitches_do_not_count_as_motion() -> None:
    """Readings far off are put to where the encoder is expected; other records are left as they are."""
    rng = np.random.default_rng(5)
    shown = [np.zeros(400)]
    glitches = np.zeros(400)
    glitches[[50, 130, 300]] = 2.0
    measured = [0.01 * rng.normal(size=400) + glitches]
    (cleaned,) = without_glitches(named("outliers"), measured, shown)
    assert np.abs(cleaned).max() < 0.05
    np.testing.assert_array_equal(cleaned[glitches == 0], measured[0][glitches == 0])
    plain: Any = SimpleNamespace(stochastic=None)
    assert without_glitches(plain, measured, shown)[0] is measured[0]


def test_a_normal_cut_off_at_zero_has_its_moments() -> None:
    """Means of a half normal, sd sqrt(2 / pi), and of one of mean and sd one, 1 + 0.2420 / 0.8413; without
    spread there is nothing to draw."""
    rng = np.random.default_rng(5)
    for mean, sd, expected in ((0.0, 2.0, 2.0 * np.sqrt(2 / np.pi)), (1.0, 1.0, 1 + 0.2420 / 0.8413)):
        drawn = np.array([_positive_normal(mean, sd, rng) for _ in range(2000)])
        assert drawn.min() >= 0
        assert drawn.mean() == pytest.approx(expected, rel=0.05)
    assert _positive_normal(1.0, 0.0, rng) == 0.0
