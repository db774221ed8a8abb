"""The closed fraction: worked by hand, and its interval over many records."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from drive_axis import white

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.shrink import Closure, closure, untracked_variance, without_reading_errors

N = 4000
SIGMA = 0.1
T = 2 * np.pi * np.arange(N) / N
TRUTH = np.cos(3 * T)


def closed(
    before: FloatArray,
    after: FloatArray,
    draws: list[FloatArray],
    measured: FloatArray,
    untracked: float = 0.0,
    seed: int = 0,
) -> Closure:
    return closure(
        before=[before],
        after=[after],
        draws=[[draw] for draw in draws],
        measured=[measured],
        shown=[after],
        untracked=untracked,
        noise_sigma=SIGMA,
        correlation=0.0,
        rng=np.random.default_rng(seed),
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
    """Half of the reducible error is a disturbance."""
    measured = TRUTH + white(N, SIGMA, 3) + white(N, 0.5, 4)
    found = closed(TRUTH + 0.5 * np.sqrt(2) * np.sin(20 * T), TRUTH, [TRUTH] * 60, measured, 0.25)
    assert found.closed == pytest.approx(0.5, abs=0.06)


def test_intervals_cover() -> None:
    """y = theta x + noise with theta estimated: 88 % or more of 120 intervals hold the true fraction."""
    rng, n, hits = np.random.default_rng(5), 300, []
    x, theta = rng.normal(size=n), 0.5 * SIGMA
    error = SIGMA / np.sqrt(np.sum(x**2))
    for seed in range(120):
        estimate = theta + rng.normal(0, error)
        draws = [(estimate + rng.normal(0, error)) * x for _ in range(64)]
        held = theta * x + rng.normal(0, SIGMA, n)
        found = closed(0 * x, estimate * x, draws, held, seed=seed)
        true = 1 - (estimate - theta) ** 2 / theta**2
        hits.append(found.closed_hdi94[0] <= true <= found.closed_hdi94[1])
    assert np.mean(hits) >= 0.88


def test_as_in_the_verdict() -> None:
    found = Closure(2.0, 1.0, 0.5, 0.8, (0.7, 0.9)).to_dict()
    assert found == {
        "rmse_before": 2.0, "rmse_after": 1.0, "noise_floor": 0.5, "closed": 0.8, "closed_hdi94": [0.7, 0.9],
    }  # fmt: skip


def stochastic(label: str, form: str, **parameters: float) -> SimpleNamespace:
    scale = SimpleNamespace(rate=20.0)
    values = {f"{label}.{name}": (value, 0.0, "") for name, value in parameters.items()}
    return SimpleNamespace(
        stochastic=SimpleNamespace(label=label, form=form, parameters=values),
        fit=SimpleNamespace(hypothesis=SimpleNamespace(scale=scale)),
    )


def test_disturbances_that_belong_to_the_motion() -> None:
    """Wind whole; clock jitter by the speed; held samples by the geometric ages; none of an encoder's own."""
    ramp = [0.05 * np.arange(200.0)]

    def variance(explanation: SimpleNamespace) -> float:
        return untracked_variance(explanation, ramp)  # type: ignore[arg-type]

    assert variance(SimpleNamespace(stochastic=None)) == 0
    assert variance(stochastic("wind", "", sd=0.3)) == pytest.approx(0.09)
    assert variance(stochastic("timing_jitter", "clock", clock_sd=0.02)) == pytest.approx(0.02**2)
    ages = np.random.default_rng(0).geometric(0.6, 200_000) - 1
    expected = np.var(ages) * 0.05**2
    held = variance(stochastic("timing_jitter", "held samples", repeated_share=0.4))
    assert held == pytest.approx(expected, rel=0.03)
    assert variance(stochastic("outliers", "", rate=0.01)) == 0


def test_glitches_do_not_count_as_motion() -> None:
    """Readings far off are put to where the encoder is expected; other records are left as they are."""
    rng = np.random.default_rng(5)
    shown = [np.zeros(400)]
    glitches = np.zeros(400)
    glitches[[50, 130, 300]] = 2.0
    measured = [0.01 * rng.normal(size=400) + glitches]
    named: Any = SimpleNamespace(stochastic=SimpleNamespace(label="outliers"))
    (cleaned,), sigma = without_reading_errors(named, measured, shown, 0.01)
    assert sigma == 0.01 and np.abs(cleaned).max() < 0.05
    np.testing.assert_array_equal(cleaned[glitches == 0], measured[0][glitches == 0])
    plain: Any = SimpleNamespace(stochastic=None)
    assert without_reading_errors(plain, measured, shown, 0.01)[0][0] is measured[0]


def test_rounding_is_noise_of_the_record() -> None:
    residuals = [np.array([0.03, -0.03, 0.03, -0.03])]
    rounded: Any = SimpleNamespace(
        stochastic=SimpleNamespace(label="encoder_quantization"), fit=SimpleNamespace(residuals=residuals)
    )
    assert without_reading_errors(rounded, residuals, residuals, 0.01)[1] == pytest.approx(0.03)
