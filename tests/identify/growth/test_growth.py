"""The growing of G: exact derivatives, exact likelihood, nested orders, the truth's likelihood reached."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from twin import twin_records

from bayes_hw.identify.cascade import Structure, simulate, to_coordinates
from bayes_hw.identify.experiment import prepare
from bayes_hw.identify.growth import cascade_response
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.delay import at_delay, too_long, with_longer_delay, with_shorter_delay
from bayes_hw.identify.growth.descent import triangular_factor
from bayes_hw.identify.growth.extension import with_real_pole, with_section, with_separate_pole
from bayes_hw.identify.growth.onset import ONSET_POLES, earlier, with_free_onset
from bayes_hw.identify.growth.score_test import best_candidates
from bayes_hw.identify.growth.search import Grown, absorbed, extended, grow, smallest_cascade
from bayes_hw.identify.growth.slow_poles import slow_poles, with_real_poles, with_slow_poles
from bayes_hw.identify.noise import MAX_ORDER
from bayes_hw.identify.structure_choice import choice_criterion
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.excitation import sine_sweep
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record, Units


def records(count: int = 2, samples: int = 300) -> list[Record]:
    rng = np.random.default_rng(3)
    t = np.arange(samples) / 20.0
    return [
        Record(f"r{i}", t, 0.5 * np.sin(0.3 * t**1.3 + i), rng.standard_normal(samples), 20.0, Units())
        for i in range(count)
    ]


def coordinates(structure: Structure, count: int) -> np.ndarray:
    found = 0.4 * np.random.default_rng(4).standard_normal(structure.size(count))
    found[:3] = -0.3, 0.35, 0.05
    return found


@pytest.mark.parametrize("free_start", [False, True])
@pytest.mark.parametrize("block", [65_536, 100])
def test_derivatives_are_those_of_differences_in_blocks_of_any_size(
    block: int, free_start: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cascade_response, "BLOCK_SAMPLES", block)
    structure = Structure(2, True, 1, 2, lower=True, upper=True, dead_zone=True, free_start=free_start)
    response = CascadeResponse(structure, records())
    at = coordinates(structure, 2)
    rows = np.concatenate([part[:, first:] for part, first, _ in response.linearise(at, 7)], axis=1)
    np.testing.assert_allclose(rows[-1], np.concatenate(response.residuals(at)), atol=1e-12)
    for i, row in enumerate(rows[:-1]):
        step = np.zeros(len(at))
        step[i] = 1e-6
        ahead, behind = (np.concatenate(response.residuals(at + sign * step)) for sign in (1, -1))
        difference = (behind - ahead) / 2e-6
        # At the corners of limits and dead zone a difference sees both sides.
        assert np.quantile(np.abs(difference - row), 0.98) < 1e-6 * (1 + np.abs(row).max())


@pytest.mark.parametrize("free_start", [False, True])
def test_the_response_is_that_of_the_cascade(free_start: bool) -> None:
    structure = Structure(1, True, 1, 2, lower=True, upper=True, dead_zone=True, free_start=free_start)
    given = records()
    response = CascadeResponse(structure, given)
    at = coordinates(structure, 2)
    values = response.values(at)
    np.testing.assert_allclose(response.coordinates(values), at, atol=1e-12)
    simulated = simulate(structure, to_coordinates(structure, values)[:, None], given)
    for record, residual, output in zip(given, response.residuals(at), simulated, strict=True):
        np.testing.assert_allclose(record.y - residual, output[0], atol=1e-10)


def test_the_likelihood_is_the_exact_one_of_an_autoregression() -> None:
    """Against the density of a multivariate normal with the covariance of an AR(2)."""
    kappa, samples = np.array([0.6, -0.3]), 40
    whitener = Whitener.of_partial(kappa)
    impulse = np.zeros(2000)
    impulse[0] = 1.0
    phi = whitener.coefficients[2]
    for k in range(1, 2000):
        impulse[k] = phi[0] * impulse[k - 1] + (phi[1] * impulse[k - 2] if k > 1 else 0.0)
    autocovariance = np.array([impulse[: 2000 - lag] @ impulse[lag:] for lag in range(samples)])
    e = np.random.default_rng(0).standard_normal(samples)
    variance = whitener.sum_of_squares([e]) / samples
    lags = np.abs(np.subtract.outer(np.arange(samples), np.arange(samples)))
    expected = multivariate_normal(cov=variance * autocovariance[lags]).logpdf(e)
    assert whitener.log_likelihood([e]) == pytest.approx(expected, abs=1e-6)


def test_a_larger_cascade_starts_with_the_same_response() -> None:
    structure = Structure(1, True, 1, 1, lower=True, upper=True, dead_zone=True, free_start=True)
    given = records()
    response = CascadeResponse(structure, given)
    values = response.values(coordinates(structure, 2))
    before = response.residuals(response.coordinates(values))
    for larger, extended_values in (
        with_section(structure, values, 1.2, 0.5),
        with_real_pole(structure, values, 0.8),
    ):
        wider = CascadeResponse(larger, given)
        after = wider.residuals(wider.coordinates(extended_values))
        np.testing.assert_allclose(np.concatenate(after), np.concatenate(before), atol=1e-9)


def test_what_noise_has_taken_up_is_told_where_samples_are_missing() -> None:
    """A ramp beside white noise: an autoregression takes it up, whatever was not measured."""
    noise = 1e-3 * np.random.default_rng(6).standard_normal(300)
    given = [replace(record, y=np.linspace(0, 2, 300) + noise) for record in records()]
    masked = [replace(record, measured=np.arange(300) >= 20) for record in given]
    structure = Structure(0, True, 0, 0, free_start=True)
    for some in (given, masked):
        at_zero = CascadeResponse(structure, some).values(np.zeros(structure.size(2)))
        assert absorbed(Grown.at(structure, at_zero, some))
        assert not absorbed(Grown.at(structure, at_zero, some, most_noise=0))


@pytest.fixture(scope="module")
def twin_pool() -> tuple[dict[int, Grown], float]:
    """Cascades grown from one twin's records, and the half width's unit."""
    twin = twin_records(np.random.default_rng(90211))
    experiment = prepare(twin.train, free_start=False)
    structure = Structure(2, True, 0, 0, lower=True, upper=True, dead_zone=True)
    start = smallest_cascade(experiment.records, structure, experiment.noise_level)
    return grow(start, 9, least_order=9), experiment.output_scale


def test_no_order_fits_worse_than_a_smaller_one(twin_pool: tuple[dict[int, Grown], float]) -> None:
    pool, _ = twin_pool
    heights = [pool[order].log_likelihood for order in sorted(pool)]
    assert sorted(pool) == list(range(1, 10))
    assert all(np.diff(heights) > -0.5)


def test_the_dead_zone_is_found_with_the_slow_poles_and_not_without(
    twin_pool: tuple[dict[int, Grown], float],
) -> None:
    """The twin's half width is 0.006 deg; orders that lack its slow pair put the lost travel there."""
    pool, scale = twin_pool
    assert abs(pool[8].values.half_width * scale - 0.006) < 0.0006
    assert pool[5].values.half_width * scale > 0.0066
    kept = with_slow_poles(pool[5])
    assert slow_poles(pool[5]) < 2 <= slow_poles(kept)
    assert abs(kept.values.half_width * scale - 0.006) < 0.0006
    assert with_slow_poles(pool[8]) is pool[8]


def test_slow_poles_are_weighed_under_the_noise_of_the_cascade(
    twin_pool: tuple[dict[int, Grown], float],
) -> None:
    """Likelihoods under white and coloured noise differ by thousands of nats and say nothing of poles."""
    pool, _ = twin_pool
    plain = pool[5].under_noise(0).descended()
    kept = with_slow_poles(plain)
    assert kept.point.most_noise == 0 and kept.point.whitener.order == 0
    assert plain.log_likelihood < kept.log_likelihood < pool[5].log_likelihood - 500


@pytest.mark.parametrize("place", [-0.9, 0.9999])
def test_slow_poles_stay_slow_where_descents_take_them_elsewhere(
    twin_pool: tuple[dict[int, Grown], float], monkeypatch: pytest.MonkeyPatch, place: float
) -> None:
    """Where the likeliest descent ends with fewer than two slow ones, or with one like the integrator, they
    stay at places that are slow."""
    pool, scale = twin_pool

    def taken_elsewhere(items: list[Grown]) -> Grown:
        values = items[0].values
        values.real[0, -1] = place
        return Grown.at(items[0].structure, values, items[0].response.records)

    monkeypatch.setattr("bayes_hw.identify.growth.slow_poles.halved", taken_elsewhere)
    kept = with_slow_poles(pool[5])
    assert kept.structure.order == 7 and slow_poles(kept) >= 2
    assert np.all((kept.values.real[0, -2:] > 0.9) & (kept.values.real[0, -2:] < 0.996))
    assert kept.log_likelihood > pool[5].log_likelihood + 5
    assert abs(kept.values.half_width * scale - 0.006) < 0.0006


def test_a_delay_taken_up_costs_next_to_nothing(twin_pool: tuple[dict[int, Grown], float]) -> None:
    pool, _ = twin_pool
    shorter = at_delay(pool[9], 1).descended()
    longer = with_longer_delay(shorter)
    assert longer.structure.delay_samples == 2
    assert not too_long(longer) and too_long(at_delay(pool[9], 3).descended())
    assert with_longer_delay(pool[8]).structure.delay_samples == 2


def test_a_free_onset_fits_as_well_and_widens_what_is_said_of_resonances(
    twin_pool: tuple[dict[int, Grown], float],
) -> None:
    pool, _ = twin_pool
    before, after = pool[8], with_free_onset(pool[8])
    assert after.structure.delay_samples == before.structure.delay_samples - 1
    assert after.structure.order == before.structure.order + 2
    assert after.log_likelihood > before.log_likelihood - 0.1
    kept = [*before.values.real[0], *ONSET_POLES]
    np.testing.assert_allclose(after.values.real[0], kept, atol=1e-12)
    deviations = []
    for item in (before, after):
        size = len(item.point.coordinates)
        factor = triangular_factor(item.response, item.point)[:size, :size]
        spread = np.sqrt(np.diag(np.linalg.pinv(factor.T @ factor)))
        first = item.structure.n_static + 1 + 2 * item.structure.real_poles
        deviations.append(spread[first : first + 8])
    assert np.all(deviations[1] > 0.99 * deviations[0])
    assert np.max(deviations[1] / deviations[0]) > 1.05


def test_a_delay_too_long_is_taken_back(twin_pool: tuple[dict[int, Grown], float]) -> None:
    pool, _ = twin_pool
    late = at_delay(pool[9], 4).descended()
    found = with_shorter_delay(late)
    assert late.log_likelihood < pool[9].log_likelihood - 50
    assert found.structure.delay_samples <= 2
    assert found.log_likelihood > pool[9].log_likelihood - 1


@pytest.mark.parametrize("free_start", [False, True])
def test_a_sample_less_of_delay_leaves_the_response_as_it_was(free_start: bool) -> None:
    """With a pole at zero to take back what is too early; records begin with no command."""
    structure = Structure(2, True, 1, 2, lower=True, upper=True, dead_zone=True, free_start=free_start)
    given = [replace(record, u=record.u - record.u[0]) for record in records()]
    response = CascadeResponse(structure, given)
    values = response.values(coordinates(structure, 2))
    before = np.concatenate(response.residuals(response.coordinates(values)))
    extended_structure, extended_values = with_separate_pole(structure, values, 0.0)
    sooner, moved = earlier(extended_structure, extended_values, at_zero=1)
    wider = CascadeResponse(sooner, given)
    after = np.concatenate(wider.residuals(wider.coordinates(moved)))
    assert sooner.delay_samples == 1
    np.testing.assert_allclose(after, before, atol=1e-9)


@pytest.mark.parametrize("denominator", [(0.91, 0.009), (0.01, 0.0004), (0.01, 0.0)])
def test_poles_next_to_zero_hardly_change_the_response_of_a_sample_less(
    denominator: tuple[float, float],
) -> None:
    """One of 0.9 and 0.01, a pair of modulus 0.02, 0 and 0.01: no weight becomes large."""
    structure = Structure(1, True, 0, 1, lower=True, upper=True, dead_zone=True)
    response = CascadeResponse(structure, records())
    values = response.values(coordinates(structure, 2))
    values.sections[:2, 0] = denominator
    before = np.concatenate(response.residuals(response.coordinates(values)))
    sooner, moved = earlier(*with_separate_pole(structure, values, 0.0), at_zero=0)
    wider = CascadeResponse(sooner, records())
    after = np.concatenate(wider.residuals(wider.coordinates(moved)))
    assert np.max(np.abs(after - before)) < 0.05 * np.max(np.abs(values.sections[2:]))


def test_a_slow_oscillation_gives_way_to_two_real_poles_that_cost_less(
    twin_pool: tuple[dict[int, Grown], float],
) -> None:
    """The twin's slow poles are real; a pair of no weight counts as two slow poles all the same."""
    pool, scale = twin_pool
    structure, values = with_section(pool[5].structure, pool[5].values, 2 * 0.986, 0.986**2 + 0.017**2)
    pair = Grown.at(structure, values, pool[5].response.records)
    found = with_slow_poles(pair)
    assert slow_poles(pair) == slow_poles(found) == 2
    assert found.structure.order == pair.structure.order and found.structure.sections == 2
    assert choice_criterion(found) < choice_criterion(pair) - 10
    assert abs(found.values.half_width * scale - 0.006) < 0.0006


def test_a_slow_oscillation_that_the_axis_has_stays() -> None:
    """Damping 0.2 at 0.05 Hz: two real poles cannot stand in for it."""
    slow = Mode(0.05, 0.2).pole(20.0)
    linear = LinearBlock(
        np.array([0.97 + 0.02j, 0.97 - 0.02j]), np.array([1.0, slow, slow.conjugate()]), 0.004, 1
    )
    axis = HammersteinWiener("slow", 20.0, Saturation(-0.8, 0.8), linear, DeadZone(0.02))
    rng = np.random.default_rng(5)
    u = np.repeat(rng.normal(0.0, 0.6, 60), 20)
    t = np.arange(len(u)) / 20.0
    record = Record("one", t, u, axis.simulate(u).y + 0.002 * rng.standard_normal(len(u)), 20.0, Units())
    experiment = prepare([record], free_start=False)
    start = smallest_cascade(
        experiment.records,
        Structure(1, True, 0, 0, lower=True, upper=True, dead_zone=True),
        experiment.noise_level,
    )
    found = grow(start, 4, least_order=4)[3]
    assert slow_poles(found) == 2 and with_slow_poles(found) is found


def test_pairs_that_become_real_keep_the_fit(twin_pool: tuple[dict[int, Grown], float]) -> None:
    pool, _ = twin_pool
    found = with_real_poles(pool[8])
    assert found.structure.order == 8
    assert found.log_likelihood > pool[8].log_likelihood - 2.5


def test_the_score_test_finds_the_missing_resonance() -> None:
    """A cascade without its resonance: the promised gain is largest at the resonance's own frequency."""
    structure = Structure(0, True, 0, 1)
    rng = np.random.default_rng(5)
    given = [replace(record, u=rng.standard_normal(1500)) for record in records(1, 1500)]
    angle, radius = 2 * np.pi * 0.13, 0.97
    true = CascadeResponse(structure, given)
    values = true.values(np.zeros(structure.size(1)))
    sections = np.array([[2 * radius * np.cos(angle)], [radius**2], [0.05], [0.02]])
    values = replace(values, integrator_residue=0.1, sections=sections)
    clean = [record.y - e for record, e in zip(given, true.residuals(true.coordinates(values)), strict=True)]
    noisy = [replace(r, y=y + 0.01 * rng.standard_normal(len(y))) for r, y in zip(given, clean, strict=True)]
    bare = Structure(0, True, 0, 0)
    plain = replace(values, sections=np.zeros((4, 0)), starts=np.zeros((1, 1)))
    item = Grown.at(bare, plain, noisy).descended()
    _, pairs = best_candidates(item.response, item.point, 1)
    found = np.arccos(pairs[0].a1 / (2 * np.sqrt(pairs[0].a2)))
    assert found == pytest.approx(angle, rel=0.12)
    reached = extended(item, pairs[0]).descended()
    assert np.sqrt(reached.values.sections[1, 0]) == pytest.approx(radius, abs=0.003)
    assert reached.point.rms == pytest.approx(0.01, rel=0.1)


def fast_records() -> tuple[list[Record], float]:
    """A mode at 3 Hz behind 17 samples of delay, swept for seconds at 265 Hz; sigma of its noise."""
    rate, sigma, rng = 265.0, 2.5e-4, np.random.default_rng(11)
    mode, zero = Mode(3.05, 0.023).pole(rate), Mode(2.45, 0.025).pole(rate)
    linear = LinearBlock(
        np.array([zero, zero.conjugate()]), np.array([1.0, mode, mode.conjugate()]), 0.0015, 17
    )
    model = HammersteinWiener("fast", rate, Saturation(-0.86, 0.95), linear, DeadZone(0.0065))
    found = []
    for offset in (0.02, -0.05):
        u = sine_sweep(rate, 4.5, 1.0, 0.0, 4.0, start_phase_rad=-np.pi / 4) + offset
        y = model.simulate(u).y + sigma * rng.standard_normal(len(u))
        found.append(Record("fast", np.arange(len(u)) / rate, u, y, rate, Units()))
    return found, sigma


def test_a_misfit_that_coloured_noise_would_whiten_away_is_found_on_plain_residuals() -> None:
    """With hundred samples a period an autoregression predicts any misfit of a wrong cascade."""
    given, sigma = fast_records()
    experiment = prepare(given, free_start=False)
    structure = Structure(17, True, 0, 0, lower=True, upper=True, dead_zone=True)
    coloured, plain = (
        grow(smallest_cascade(experiment.records, structure, experiment.noise_level, most), 3, least_order=3)
        for most in (MAX_ORDER, 0)
    )
    assert absorbed(coloured[3])
    assert coloured[3].point.rms * experiment.output_scale > 5 * sigma
    assert not absorbed(plain[3])
    assert plain[3].point.rms * experiment.output_scale < 1.1 * sigma
    assert plain[3].point.most_noise == MAX_ORDER
    assert plain[3].log_likelihood > coloured[3].log_likelihood + 500


def test_noise_of_no_order_is_white() -> None:
    e = np.cumsum(np.random.default_rng(2).standard_normal(400))
    assert Whitener.of_residuals([e], 0).order == 0
    assert Whitener.of_residuals([e], 1).order == 1
