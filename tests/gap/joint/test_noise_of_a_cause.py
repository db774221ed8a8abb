"""Noise of a cause: as good as the exact predictor of a walk, and the right one of two is the likelier."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import GIVEN_SAMPLES, SIGMA, measured, model
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.given.clear_of_zone import away_from_zero
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.noise.slow_noise import WALK, WIND, SlowNoise
from bayes_hw.gap.joint.search.effect_moves import slow_causes
from bayes_hw.identify.growth.coloured import Whitener

RATE, LENGTH = 20.0, 3000
POLES = np.array([0.96 + 0.2j, 0.96 - 0.2j])


def walk(seed: int, step: float) -> FloatArray:
    """Unit white noise on a random walk of this step."""
    rng = np.random.default_rng(seed)
    return np.cumsum(step * rng.standard_normal(LENGTH)) + rng.standard_normal(LENGTH)


def blown(seed: int, size: float) -> FloatArray:
    """Unit white noise on what a steep slow torque does through a light pair of poles."""
    rng = np.random.default_rng(seed)
    torque = lfilter([1.0], np.convolve([1, -0.97], [1, -0.97]), rng.standard_normal(LENGTH))
    seen = lfilter([1.0], np.poly(POLES).real, torque)
    return np.asarray(size * seen / np.std(seen) + rng.standard_normal(LENGTH))


@pytest.mark.parametrize("step", [0.05, 0.3, 1.0])
def test_a_walk_is_predicted_as_well_as_by_the_exact_filter(step: float) -> None:
    e = [walk(seed, step) for seed in (1, 2, 3)]
    found = SlowNoise(WALK, RATE).of(e)
    squares = [found.apply(one[None, :])[0, 200:] ** 2 for one in e]
    exact = 1 + (step**2 + np.sqrt(step**4 + 4 * step**2)) / 2  # variance of the local level's innovations
    assert float(np.mean(np.concatenate(squares))) == pytest.approx(exact, rel=0.06)


def test_the_cause_at_work_is_the_likelier() -> None:
    for e, right, wrong in (
        ([walk(seed, 0.3) for seed in (4, 5)], WALK, WIND),
        ([blown(seed, 4.0) for seed in (4, 5)], WIND, WALK),
    ):
        score = {}
        for cause in (right, wrong):
            noise = SlowNoise(cause, RATE, (POLES,))
            price = 0.5 * noise.parameters * np.log(2 * LENGTH) + np.log(noise.choices)
            score[cause] = noise.of(e).log_likelihood(e) - price
        assert score[right] > score[wrong] + 0.2
        free = Whitener.of_residuals(e)
        assert score[right] > free.log_likelihood(e) - 0.5 * free.order * np.log(2 * LENGTH) + 5


def test_exact_noise_tells_a_small_walk_from_wind() -> None:
    """Which the wind's freer spectrum stands in for where what is older than 40 samples is forgotten."""
    e = [walk(seed, 0.03) for seed in (7, 8, 9)]
    likely = {
        (cause, exact): SlowNoise(cause, RATE, exact=exact).of(e).log_likelihood(e)
        for cause in (WALK, WIND)
        for exact in (False, True)
    }
    assert likely[WALK, True] > likely[WALK, False] + 10
    assert likely[WALK, True] - likely[WIND, True] > likely[WALK, False] - likely[WIND, False] + 2


def test_going_on_over_holes_is_never_less_likely() -> None:
    """Parameters are sought at a low order there, under which others are best than at the whole one."""
    noise, e = SlowNoise(WALK, RATE, exact=True), [walk(seed, 0.02) for seed in (7, 8)]
    for one in e:
        one[::7] = np.nan
    masks = [~np.isnan(one) for one in e]
    begun = noise._whitener(0.0, -1, np.array([np.log(0.02**2), 0.0]))
    assert noise.of(e, begun).log_likelihood(e, masks) >= begun.log_likelihood(e, masks)


def test_wind_of_a_low_corner_is_found_however_small_its_part_at_high_frequencies() -> None:
    """Of gusts with a corner of 0.03 Hz beneath white noise, at 50 Hz: as likely as at the true spectrum."""
    rate, samples, rng = 50.0, 6000, np.random.default_rng(11)
    f = np.maximum(np.fft.rfftfreq(1 << 15, 1 / rate), 1e-4)
    power = np.exp(-4.0) * ((1 + (rate / 40 / 0.03) ** 2) / (1 + (f / 0.03) ** 2)) ** 1.5
    e = []
    for _ in range(2):
        white = np.fft.rfft(rng.standard_normal(1 << 15))
        e.append(np.fft.irfft(np.sqrt(power) * white)[:samples] + rng.standard_normal(samples))
    cause = SlowNoise(WIND, rate, (POLES, POLES), exact=True)
    true = cause._whitener(1.5, -1, np.array([-4.0, np.log(0.03), 0.0]))
    found = cause.of(e).log_likelihood(e)
    assert found > true.log_likelihood(e) - 2
    assert found > SlowNoise(WALK, rate, exact=True).of(e).log_likelihood(e) + 3


def test_the_noise_of_the_readings_is_told_beneath_a_walk() -> None:
    """Coloured noise of the first order: its deviation, which is larger than that of the innovations."""
    rng = np.random.default_rng(3)
    plain = lfilter([0.8], [1.0, -0.6], rng.standard_normal(LENGTH))
    e = [plain + np.cumsum(0.05 * rng.standard_normal(LENGTH))]
    found = SlowNoise(WALK, RATE, exact=True).of(e)
    innovation = float(np.sqrt(found.sum_of_squares(e) / LENGTH))
    assert found.of_readings(innovation) == pytest.approx(np.std(plain), rel=0.1)


def test_noise_that_was_fitted_before_goes_on_from_there() -> None:
    """Of other residuals of the same noise: as likely as fitted from nothing."""
    before, now = [blown(4, 4.0)], [blown(5, 4.0)]
    fresh = SlowNoise(WIND, RATE, (POLES,))
    begun = replace(fresh, begun=fresh.of(before))
    assert begun.of(now).log_likelihood(now) > fresh.of(now).log_likelihood(now) - 3


def test_over_holes_the_noise_is_found_as_well() -> None:
    e = [blown(4, 4.0)[: LENGTH // 2]]
    rng = np.random.default_rng(1)
    holed = [np.where(np.repeat(rng.random(LENGTH // 20) < 0.2, 10), np.nan, one) for one in e]
    cause = SlowNoise(WIND, RATE, (POLES,))
    assert cause.of(holed).log_likelihood(e) > cause.of(e).log_likelihood(e) - 8


def test_the_size_of_the_slow_part_is_told() -> None:
    small, large = [walk(6, 0.005)], [blown(6, 4.0)]
    for e, cause, low, high in ((small, WALK, 0.0, 0.4), (large, WIND, 2.0, 6.0)):
        found = SlowNoise(cause, RATE, (POLES,)).of(e)
        innovation = float(np.sqrt(found.sum_of_squares(e) / LENGTH))
        assert low <= found.slow_share(float(np.std(e[0])), innovation) < high


def test_a_shift_hides_in_the_dead_zone_so_that_samples_near_it_are_left_out() -> None:
    plain = measured((), GIVEN_SAMPLES, (1, 2))
    records = [replace(r, y=r.y + SIGMA * walk(i, 0.1)[:GIVEN_SAMPLES]) for i, r in enumerate(plain)]
    base = best_base(records, model())
    best = next(fit for fit in slow_causes(base) if fit.labels == (WALK,))
    assert best.score > base.score + 10
    clear = away_from_zero(best, base)
    assert clear is not None
    values, response = best.values, clear.response
    for record in response.records:
        w = best.response.simulate(values, record.u).w
        near = np.abs(w) < values.cascade.half_width
        assert near.any()
        assert not record.measured_samples[near].any()
    assert best.without(WALK).labels == ()
