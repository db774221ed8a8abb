"""One replicate from records alone: it scores what the fit has, and its noise is what it says."""

from __future__ import annotations

import numpy as np
import pytest
from recovery import recover
from short_sampling import sample_shortly
from stepped_axis import stepped_axis
from true_axis import TrueNoise

from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener


def test_heavy_tails_inform_more_than_normal_noise_of_the_same_spread() -> None:
    normal, heavy = TrueNoise(0.5, (0.6,)), TrueNoise(0.5, (0.6,), 4.0)
    assert normal.information == pytest.approx(1 / (0.25 * 0.64))
    assert heavy.information == pytest.approx(normal.information * 10 / 7)


@pytest.mark.parametrize("noise", [TrueNoise(2.0, (0.7, -0.3)), TrueNoise(2.0, (0.7,), 6.0)])
def test_noise_has_its_spread_and_correlation_from_the_first_sample(noise: TrueNoise) -> None:
    rng = np.random.default_rng(3)
    runs = np.array([noise.sequence(6, rng) for _ in range(4000)])
    assert np.std(runs[:, 0]) == pytest.approx(2.0, rel=0.05)
    assert np.corrcoef(runs[:, 2], runs[:, 3])[0, 1] == pytest.approx(0.7, abs=0.04)


@pytest.mark.slow
def test_a_replicate_scores_every_true_value_that_the_fit_has(
    small_axis: HammersteinWiener, monkeypatch: pytest.MonkeyPatch
) -> None:
    sample_shortly(monkeypatch)
    axis = stepped_axis(small_axis, TrueNoise(0.01, (0.5,)))
    settings = SamplerSettings(max_steps=50)
    found = recover(axis, np.random.default_rng(4), max_order=3, settings=settings)
    scored = {*found["inside"], *(f"{mode}.{q}" for mode in found["lacking"] for q in QUANTITIES)}
    assert scored == set(axis.true_values())
    assert "saturation.lower" in found["width"]
    assert "noise.sigma" not in found["width"]
    assert set(found["at_best"]) == {*axis.true_values()} - {"noise.sigma"}
    for held, z in zip(found["at_best"].values(), found["z_at_best"].values(), strict=True):
        assert held == [abs(z) <= reach for reach in (0.674490, 1.281552, 1.880794)]
    value, mean, sd = found["estimate"]["saturation.upper"]
    assert found["z"]["saturation.upper"] == pytest.approx((mean - value) / sd)
    assert abs(mean / value - 1) < 0.1


QUANTITIES = ("frequency_hz", "damping_ratio")
