"""One replicate from records alone: its bound is that of the information, its noise is what it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recovery import KnownAxis, TrueNoise, deviations_of, least_deviations, recover
from short_sampling import sample_shortly

from bayes_hw.identify.output_error import fit_output_error
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def known_axis(model: HammersteinWiener, noise: TrueNoise, seed: int = 1) -> KnownAxis:
    """The axis with two records of held random steps."""
    rng = np.random.default_rng(seed)
    rate = model.sample_rate_hz
    records = []
    for number in range(2):
        u = np.repeat(rng.normal(0, 0.9, size=60), 10)
        y = model.simulate(u).y + noise.sequence(len(u), rng)
        records.append(Record(f"r{number}", np.arange(len(u)) / rate, u, y, rate, model.units))
    return KnownAxis(replace(model, noise_sigma=noise.sigma), noise, tuple(records))


def test_the_bound_is_the_spread_of_fits_begun_at_the_truth(small_axis: HammersteinWiener) -> None:
    """Standard deviation of 40 least-squares fits of all parameters, within three standard errors."""
    noise = TrueNoise(0.01)
    axis = known_axis(small_axis, noise)
    parameters = AxisParameters(axis.model, "all")
    rng = np.random.default_rng(2)
    found = []
    for _ in range(40):
        records = [
            replace(r, y=small_axis.simulate(r.u).y + noise.sequence(len(r), rng)) for r in axis.records
        ]
        found.append(fit_output_error(parameters, records, parameters.nominal, max_evaluations=8).values)
    bounds = least_deviations(axis)
    spread = dict(zip(parameters.names, np.std(found, axis=0), strict=True))
    for name in ("saturation.lower", "saturation.upper", "velocity_gain", "mode1.frequency_hz"):
        assert spread[name] == pytest.approx(bounds[name], rel=3 / np.sqrt(80))


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


def test_no_information_is_no_bound() -> None:
    information = np.array([[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e12]])
    np.testing.assert_allclose(deviations_of(information), [0.5, np.inf, 1e-6])


def test_a_replicate_scores_every_true_value_that_the_fit_has(
    small_axis: HammersteinWiener, monkeypatch: pytest.MonkeyPatch
) -> None:
    sample_shortly(monkeypatch)
    axis = known_axis(small_axis, TrueNoise(0.01, (0.5,)))
    settings = SamplerSettings(max_steps=50)
    found = recover(axis, np.random.default_rng(4), max_order=3, settings=settings)
    scored = {*found["inside"], *(f"{mode}.{q}" for mode in found["lacking"] for q in QUANTITIES)}
    assert scored == set(axis.true_values())
    assert "saturation.lower" in found["width"]
    assert "noise.sigma" not in found["width"]
    value, mean, sd = found["estimate"]["saturation.upper"]
    assert found["z"]["saturation.upper"] == pytest.approx((mean - value) / sd)
    assert abs(mean / value - 1) < 0.1


QUANTITIES = ("frequency_hz", "damping_ratio")
