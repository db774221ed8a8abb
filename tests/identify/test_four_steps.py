"""The four steps recover a known axis from records alone, and say what the records do not show."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from known_axis import commands, known_axis, simulated_records

from bayes_hw.errors import InputError
from bayes_hw.identify.four_steps import identify
from bayes_hw.identify.growth.slow_poles import FEWEST_SAMPLES
from bayes_hw.identify.result import Identification
from bayes_hw.identify.validation import evaluate
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SIGMA = 0.01


def identified(records: list[Record], free_start: bool = False, max_order: int = 6) -> Identification:
    return identify(records, free_start=free_start, max_order=max_order)


def records_of(
    rms: float, sigma: float, half_width: float = 0.05, position: float = 0.0, count: int = 2
) -> list[Record]:
    rng = np.random.default_rng(3)
    axis = known_axis(half_width=half_width)
    return simulated_records(axis, commands(rng, count, rms), rng, sigma, position)


@pytest.fixture(scope="module")
def noisy() -> Identification:
    return identified(records_of(0.3, SIGMA))


@pytest.mark.slow
def test_without_noise_the_axis_is_recovered() -> None:
    model = identified(records_of(0.3, 0.0, count=1)).model
    assert model.saturation.lower == pytest.approx(-0.3, rel=1e-6)
    assert model.saturation.upper == pytest.approx(0.42, rel=1e-6)
    assert model.dead_zone.half_width == pytest.approx(0.05, rel=1e-6)
    assert [mode.frequency_hz for mode in model.dominant_modes] == pytest.approx([1.8, 3.7], rel=1e-6)
    assert [mode.damping_ratio for mode in model.dominant_modes] == pytest.approx([0.05, 0.03], rel=1e-5)


def test_without_noise_an_axis_of_one_mode_is_recovered(small_axis: HammersteinWiener) -> None:
    rng = np.random.default_rng(3)
    model = identified(simulated_records(small_axis, commands(rng, 1, 0.7), rng), max_order=3).model
    assert model.saturation.lower == pytest.approx(-0.8, rel=1e-6)
    assert model.saturation.upper == pytest.approx(1.0, rel=1e-6)
    assert model.dead_zone.half_width == pytest.approx(0.02, rel=1e-6)
    (mode,) = model.dominant_modes
    assert mode.frequency_hz == pytest.approx(2.0, rel=1e-6)
    assert mode.damping_ratio == pytest.approx(0.1, rel=1e-5)


def test_with_noise_unequal_limits_and_modes_are_near(noisy: Identification) -> None:
    model = noisy.model
    assert model.saturation.lower == pytest.approx(-0.3, rel=0.005)
    assert model.saturation.upper == pytest.approx(0.42, rel=0.005)
    assert model.dead_zone.half_width == pytest.approx(0.05, rel=0.03)
    assert [mode.frequency_hz for mode in model.dominant_modes] == pytest.approx([1.8, 3.7], rel=0.01)
    assert model.noise_sigma == pytest.approx(SIGMA, rel=0.05)
    assert all(block.shown for block in noisy.blocks_shown.values())


def test_every_step_costs_less_than_the_one_before(noisy: Identification) -> None:
    costs = [step.cost for step in noisy.steps]
    assert len(costs) == 4
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(SIGMA, rel=0.05)


def test_an_integrator_and_a_sufficient_order_are_chosen(noisy: Identification) -> None:
    linear = noisy.model.linear
    assert linear.integrator_index is not None
    least = np.exp(-1 / FEWEST_SAMPLES) - 1e-3
    kept = (linear.poles.imag == 0) & (linear.poles.real > least) & (linear.poles.real < 1)
    assert any(f"{np.count_nonzero(kept)} slow real poles of G are kept" in said for said in noisy.warnings)
    taken = noisy.pool.chosen
    assert (taken.slow_poles_added, taken.onset_poles_added) == (np.count_nonzero(kept), 2)
    assert 5 <= len(linear.poles) - np.count_nonzero(kept) - taken.onset_poles_added <= 6
    linear.check_stable()
    assert linear.velocity_gain(20.0) == pytest.approx(1.0, rel=0.02)


def test_the_model_file_simulates_what_was_fitted(noisy: Identification) -> None:
    for record, residual in zip(records_of(0.3, SIGMA), noisy.residuals, strict=True):
        np.testing.assert_allclose(noisy.model.simulate(record.u).y, record.y - residual, atol=1e-9)


def test_the_baseline_simulates_what_its_fit_says(noisy: Identification) -> None:
    record = records_of(0.3, SIGMA)[0]
    error = record.y - noisy.baseline.simulate(record.u)
    spread = np.linalg.norm(record.y - record.y.mean())
    assert 100 * (1 - np.linalg.norm(error) / spread) == pytest.approx(noisy.fits[0].linear, abs=1e-4)


def test_validation_on_other_records_prefers_the_cascade(noisy: Identification) -> None:
    rng = np.random.default_rng(11)
    fits = evaluate(noisy, simulated_records(known_axis(), commands(rng, 1, 0.3), rng, SIGMA))
    assert fits[0].hammerstein_wiener > 90
    assert fits[0].hammerstein_wiener > fits[0].linear + 5


@pytest.mark.slow
def test_limits_that_are_never_reached_are_not_invented() -> None:
    records = records_of(0.05, 0.002, count=1)
    found = identified(records, max_order=4)
    for name in ("saturation.lower", "saturation.upper"):
        assert not found.blocks_shown[name].shown
        assert any(name in warning for warning in found.warnings)
    assert found.blocks_shown["dead_zone"].shown
    commanded = np.concatenate([record.u for record in records])
    assert found.model.saturation.lower == pytest.approx(commanded.min())
    assert found.model.saturation.upper == pytest.approx(commanded.max())


@pytest.mark.slow
def test_a_dead_zone_that_is_never_visited_is_not_invented() -> None:
    found = identified(records_of(0.3, SIGMA, position=3.0, count=1), free_start=True, max_order=5)
    assert not found.blocks_shown["dead_zone"].shown
    assert found.model.dead_zone.half_width == 0
    assert found.blocks_shown["saturation.lower"].shown
    assert found.model.saturation.lower == pytest.approx(-0.3, rel=0.005)
    later = evaluate(found, records_of(0.3, SIGMA, position=3.0, count=3)[2:])
    assert later[0].hammerstein_wiener > 90


@pytest.mark.slow
def test_units_scale_out() -> None:
    records = records_of(0.3, SIGMA, count=1)
    scaled = [replace(record, u=1e3 * record.u, y=1e-4 * record.y) for record in records]
    model, other = (identified(given, max_order=3).model for given in (records, scaled))
    assert other.saturation.lower == pytest.approx(1e3 * model.saturation.lower, rel=1e-6)
    assert other.dead_zone.half_width == pytest.approx(1e-4 * model.dead_zone.half_width, rel=1e-6)
    assert other.linear.gain == pytest.approx(1e-7 * model.linear.gain, rel=1e-5)


def test_the_result_is_json_without_infinities(noisy: Identification) -> None:
    content = json.loads(json.dumps(noisy.to_dict(), allow_nan=False))
    assert content["schema"] == "bayes-hw/fit/1"
    assert len(content["steps"]) == 4


def test_records_of_different_rates_are_refused() -> None:
    first, second = records_of(0.3, SIGMA)
    with pytest.raises(InputError, match="resample"):
        identified([first, replace(second, sample_rate_hz=10.0)])


def test_too_few_samples_are_refused() -> None:
    first = records_of(0.3, SIGMA)[0]
    short = replace(first, t=first.t[:100], u=first.u[:100], y=first.y[:100])
    with pytest.raises(InputError, match="at least 200"):
        identified([short])


@pytest.mark.slow
def test_long_records_are_searched_in_part_and_fitted_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    for place in ("LONG", "SEARCH", "BASELINE"):
        monkeypatch.setattr(f"bayes_hw.identify.long_records.{place}_SAMPLES", 1200)
    records = records_of(0.3, SIGMA)
    found = identified(records, max_order=3)
    assert [len(residual) for residual in found.residuals] == [len(record) for record in records]
    assert any("(1200 samples)" in warning and "all 2400 samples" in warning for warning in found.warnings)
