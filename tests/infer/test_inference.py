"""From records to a posterior: it finds the truth, covers it as often as it says, and can be resumed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy import stats
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.ensemble import advance, start_ensemble
from bayes_hw.infer.inference import Inference, axis_for, infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.mixture import laplace_proposal
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.sample_rate import check_rates
from bayes_hw.record import Record

SHORT = SamplerSettings(ensembles=2, walkers=64, max_steps=100, target_ess=500)


@pytest.fixture(scope="module")
def inference(small_axis: HammersteinWiener, small_record: Record) -> Inference:
    return infer(small_axis, [small_record], np.random.default_rng(1), settings=SHORT)


@pytest.mark.compiles("cascades")
def test_the_truth_lies_within_the_posterior(inference: Inference, small_axis: HammersteinWiener) -> None:
    """Every parameter within four posterior standard deviations; nothing is found in the residuals."""
    axis = inference.posterior.axis
    nominal = dict(zip(axis.names, axis.nominal, strict=True))
    truth = {
        "saturation.lower": -0.8,
        "saturation.upper": 1.0,
        "dead_zone.half_width": 0.02,
        "velocity_gain": nominal["velocity_gain"],
        "mode1.frequency_hz": 2.0,
        "mode1.damping_ratio": 0.1,
        "mode1.cosine": nominal["mode1.cosine"],
        "mode1.sine": nominal["mode1.sine"],
        "noise.sigma": 0.01,
        "noise.partial_autocorrelation1": 0.5,
    }
    summaries = inference.posterior.summaries
    assert set(summaries) == set(truth)
    for name, value in truth.items():
        assert abs(summaries[name].mean - value) < 4 * summaries[name].sd, name
    gain = inference.posterior.reported["gain"]
    assert abs(gain.mean - small_axis.linear.gain) < 4 * gain.sd
    assert inference.residuals.white
    assert inference.sampling.non_finite == 0


def test_same_seed_same_numbers_whatever_the_jobs(
    inference: Inference, small_axis: HammersteinWiener, small_record: Record
) -> None:
    again = infer(small_axis, [small_record], np.random.default_rng(1), settings=SHORT, jobs=2)
    np.testing.assert_array_equal(again.posterior.values, inference.posterior.values)


@pytest.mark.slow
def test_resumed_run_is_the_undisturbed_one(
    inference: Inference, small_axis: HammersteinWiener, small_record: Record, tmp_path: Path
) -> None:
    """Lost blocks are sampled again to the same bits; a checkpoint of other data is refused."""

    def run(record: Record, *, resume: bool) -> Inference:
        rng = np.random.default_rng(1)
        return infer(small_axis, [record], rng, settings=SHORT, checkpoint_folder=tmp_path, resume=resume)

    run(small_record, resume=False)
    for path in sorted(tmp_path.glob("block_*.h5"))[1:]:
        path.unlink()
    found = run(small_record, resume=True)
    np.testing.assert_array_equal(found.posterior.values, inference.posterior.values)
    with pytest.raises(InputError, match="belongs to another run"):
        run(replace(small_record, y=small_record.y + 1e-9), resume=True)


def test_rates_must_agree(small_axis: HammersteinWiener, small_record: Record) -> None:
    check_rates(small_axis, [replace(small_record, sample_rate_hz=20.1)])
    faster = replace(small_record, sample_rate_hz=50.0)
    with pytest.raises(InputError, match=r"50 Hz .* --resample 20"):
        infer(small_axis, [faster], np.random.default_rng(1))


def test_axis_takes_its_scale_and_start_from_the_records(small_axis: HammersteinWiener) -> None:
    records = [measured(small_axis, 100, seed=i, initial_position=p) for i, p in ((1, 0.0), (2, 5.0))]
    rest = axis_for(small_axis, records, "conditional", "rest")
    assert rest.start_positions is None
    assert rest.output_scale == max(float(np.max(np.abs(r.y - r.y[0]))) for r in records)
    free = axis_for(small_axis, records, "conditional", "free")
    assert free.start_positions is not None
    np.testing.assert_allclose(free.start_positions, [0.0, 5.0], atol=0.1)


class Ranks(NamedTuple):
    """Share of posterior draws below the truth (replicates, parameters), and below 1.2 times the true
    sigma (replicates,)."""

    shares: FloatArray
    wrong_sigma: FloatArray


def posterior_draws(posterior: LogPosterior, mode: FloatArray, covariance: FloatArray) -> FloatArray:
    """Draws of a short run of the moves from overdispersed walkers, (draws, parameters)."""
    walkers = laplace_proposal(mode, covariance, 2.0).sample(64, np.random.default_rng(2))
    moves = weighted_moves(laplace_proposal(mode, covariance, 1.3), 0.5)
    state = start_ensemble(walkers, posterior, seed=3)
    _, _, _, state = advance(state, posterior, moves, 100)
    chain, _, _, _ = advance(state, posterior, moves, 100)
    return posterior.values(chain[::10].reshape(-1, len(mode)))


def simulated_ranks(nominal: HammersteinWiener, replicates: int, *, ignore_correlation: bool) -> Ranks:
    """Simulation-based calibration (Talts et al., arXiv:1804.06788).

    Parameters are drawn from their priors about `nominal`, a record of 400 samples with AR(1) noise is
    simulated from them, and they are ranked in the posterior that `nominal` and the record give.
    """
    shares, wrong_sigma = [], []
    prior = AxisParameters(nominal).parameters
    for replicate in range(replicates):
        rng = np.random.default_rng([5, replicate])
        values = np.array([p.prior.quantile(rng.uniform(size=())) for p in prior])
        correlation = float(rng.uniform(0.3, 0.8))
        truth = np.r_[values, nominal.noise_sigma, correlation]
        model = replace(AxisParameters(nominal).to_model(values), noise_sigma=nominal.noise_sigma)
        record = measured(model, 400, seed=1000 + replicate, correlation=correlation)
        axis = AxisParameters(nominal)
        start = starting_point(axis, [record], rng)
        noise, n = start.noise_parameters, len(start.coordinates)
        if ignore_correlation:
            noise, n = noise[:1], len(prior) + 1
        posterior = LogPosterior(axis, noise, [record])
        draws = posterior_draws(posterior, start.coordinates[:n], start.covariance[:n, :n])
        shown = min(n, len(truth))
        shares.append(np.mean(draws[:, :shown] < truth[:shown], axis=0))
        wrong_sigma.append(np.mean(draws[:, len(prior)] < 1.2 * nominal.noise_sigma))
    return Ranks(np.array(shares), np.array(wrong_sigma))


def smallest_p_value(shares: FloatArray) -> float:
    """Of two tests of every parameter, uniform ranks and normal scores of unit variance; Bonferroni."""
    scores = stats.norm.ppf(np.clip(shares, 0.5 / 640, 1 - 0.5 / 640))
    energy = np.sum(scores**2, axis=0)
    spread = 2 * np.minimum(stats.chi2.cdf(energy, len(shares)), stats.chi2.sf(energy, len(shares)))
    uniform = [stats.kstest(column, stats.uniform.cdf).pvalue for column in shares.T]
    return float(min(1.0, 2 * shares.shape[1] * min(spread.min(), *uniform)))


@pytest.fixture(scope="module")
def ranks(small_axis: HammersteinWiener) -> Ranks:
    return simulated_ranks(small_axis, 40, ignore_correlation=False)


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform(ranks: Ranks) -> None:
    """40 replicates: no parameter's intervals are too wide, too narrow or off."""
    assert smallest_p_value(ranks.shares) > 0.01


@pytest.mark.slow
def test_calibration_catches_ignored_correlation(small_axis: HammersteinWiener) -> None:
    """White noise assumed where it is coloured: the same check fails within 20 replicates."""
    wrong = simulated_ranks(small_axis, 20, ignore_correlation=True)
    axis_only = wrong.shares[:, : len(AxisParameters(small_axis).parameters)]
    assert smallest_p_value(axis_only) < 1e-3


@pytest.mark.slow
def test_calibration_catches_a_wrong_sigma(small_axis: HammersteinWiener) -> None:
    """Noise that is 20 % larger than the posterior was told: the same check fails within eight replicates."""
    ranks = simulated_ranks(small_axis, 8, ignore_correlation=False)
    assert smallest_p_value(ranks.wrong_sigma[:, None]) < 1e-3
