"""Freeing the gains changes no invariant: the ridge's posterior against the normalized run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identifiability.conftest import swinging

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.asymmetry import check_assumptions
from bayes_hw.identifiability.freed_gains import GAIN_POSITIVE, HALF_WIDTH_POSITIVE, SLOPE, UPPER
from bayes_hw.identifiability.gain_posterior import FreedRuns, sample_freed
from bayes_hw.identifiability.invariance import (
    compare_invariants,
    contractions,
    orbit_through,
    sd_error,
)
from bayes_hw.infer.inference import infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SHORT = SamplerSettings(ensembles=4, walkers=32, max_steps=200, target_ess=1000)


def sampled(model: HammersteinWiener, record: Record, settings: SamplerSettings = SHORT) -> FreedRuns:
    first, second = np.random.default_rng(1).spawn(2)
    inference = infer(model, [record], first, settings=settings)
    return sample_freed(inference, [record], second, settings=settings)


@pytest.fixture(scope="module")
def runs(small_axis: HammersteinWiener, swinging_record: Record) -> FreedRuns:
    return sampled(small_axis, swinging_record)


@pytest.mark.slow
def test_invariants_agree_within_monte_carlo_error(runs: FreedRuns) -> None:
    """Means and standard deviations of all seven, the largest of fourteen scores against its 99 % bound."""
    agreement = compare_invariants(runs.freed, runs.chart)
    assert len(agreement.rows) == 7
    assert agreement.agrees, [(row.invariant.name, row.mean_score, row.sd_score) for row in agreement.rows]
    for row in agreement.rows:
        assert row.freed.sd == pytest.approx(row.chart.sd, rel=0.15)


@pytest.mark.parametrize("correlation", [-0.5, 0.0, 0.6])
def test_error_of_a_standard_deviation_is_its_scatter(correlation: float) -> None:
    """Of 300 chains of known first-order correlation; draws opposite to each other do not shrink it."""
    rng = np.random.default_rng(3)
    shocks = rng.standard_normal((80, 300, 4, 16))
    chain = np.empty_like(shocks)
    chain[0] = shocks[0]
    for k in range(1, len(chain)):
        chain[k] = correlation * chain[k - 1] + np.sqrt(1 - correlation**2) * shocks[k]
    runs = np.moveaxis(chain, (1, 2), (0, 1))
    claimed = np.mean([sd_error(run) for run in runs[:60]])
    assert claimed == pytest.approx(np.std([run.std() for run in runs]), rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "offset"), [(1.0, 0.5), (1.3, 0.0)], ids=["shifted", "widened"])
def test_disagreement_is_found(runs: FreedRuns, factor: float, offset: float) -> None:
    """Draws of one parameter of the chart moved by half a standard deviation, or spread by 30 %."""
    values = runs.chart.values.copy()
    column = runs.chart.names.index(UPPER)
    logs = np.log(values[..., column])
    values[..., column] = np.exp(logs.mean() + factor * (logs - logs.mean()) + offset * logs.std())
    assert not compare_invariants(runs.freed, replace(runs.chart, values=values)).agrees


@pytest.mark.slow
def test_raw_parameters_contract_by_pooled_priors_alone(runs: FreedRuns) -> None:
    """On the ridge each raw parameter keeps the variance that its prior has along the orbit."""
    raw, kept = contractions(runs.freed)
    assert {row.name for row in raw} >= {SLOPE, UPPER, GAIN_POSITIVE, HALF_WIDTH_POSITIVE}
    for row in raw:
        assert row.by_pooling is not None
        assert row.contraction == pytest.approx(row.by_pooling, abs=0.04), row.name
    assert min(row.contraction for row in kept) > 0.97


@pytest.mark.slow
def test_draws_lie_along_the_orbit(runs: FreedRuns) -> None:
    freed = runs.freed
    along = np.corrcoef(np.log(freed.chains(SLOPE)).ravel(), np.log(freed.chains(UPPER)).ravel())[0, 1]
    assert along > 0.999
    orbit = orbit_through(freed, np.array([-1.0, 0.0, 1.0]), 1)
    product: FloatArray = orbit[:, freed.names.index(GAIN_POSITIVE)]
    product = product * orbit[:, freed.names.index(HALF_WIDTH_POSITIVE)]
    np.testing.assert_allclose(product, product[0])


@pytest.mark.slow
def test_true_assumptions_are_supported(runs: FreedRuns) -> None:
    for test in check_assumptions(runs.freed):
        low, high = test.ratio.hdi94
        assert low < 1 < high
        assert test.decision != "contradicted"
    assert check_assumptions(runs.freed)[0].decision == "supported"


@pytest.mark.slow
def test_unequal_slopes_contradict_the_assumption(small_axis: HammersteinWiener) -> None:
    """c3 = 1.15 c2 in the measured axis; the thresholds are equal in output units and so are not."""
    shorter = replace(SHORT, ensembles=2, max_steps=75)
    runs = sampled(small_axis, swinging(small_axis, 2, gain_negative=1.15), shorter)
    slopes, _ = check_assumptions(runs.freed)
    assert slopes.decision == "contradicted"
    assert slopes.ratio.hdi94[0] < 1.15 < slopes.ratio.hdi94[1]
