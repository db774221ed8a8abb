"""The expanded likelihood of long records against the one that simulates every sample."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.infer import long_records
from bayes_hw.infer.inference import infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.long_records import Expansion, whitened_products
from bayes_hw.infer.reweighting import reweighted
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model import streaming
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.parameters import as_coordinates, as_values

MODEL = nanshan_model(0.006, 0.002)


def _target(samples: int = 2400) -> tuple[LogPosterior, FloatArray, FloatArray]:
    records = [measured(MODEL, samples, 3), measured(MODEL, samples, 4)]
    axis = AxisParameters(MODEL, "conditional", output_scale=1.0)
    origin = starting_point(axis, records, np.random.default_rng(1))
    target = LogPosterior(axis, origin.noise_parameters, records)
    return target, origin.coordinates, origin.covariance


def test_blocks_are_the_response_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """States go from one block to the next: the last block is a short one."""
    monkeypatch.setattr(streaming, "SAMPLES", 320)
    (record,) = [measured(MODEL, 1000, 3)]
    axis = AxisParameters(MODEL, "all", output_scale=1.0)
    form = axis.modal_form(np.repeat(axis.nominal[:, None], 3, axis=1) * np.array([1.0, 1.001, 0.999]))
    whole = simulate_batch(form, record.u, 2).y
    blocks = [y.copy() for _, y in streaming.simulated_blocks(form, record.u, 2, 0.0)]
    assert [y.shape[1] for y in blocks] == [320, 320, 320, 40]
    np.testing.assert_allclose(np.concatenate(blocks, axis=1), whole, rtol=0, atol=1e-12)


def test_products_are_those_of_whitened_residuals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streaming, "SAMPLES", 320)
    record = measured(MODEL, 1000, 3)
    axis = AxisParameters(MODEL, "conditional", output_scale=1.0)
    centre = as_coordinates(axis.parameters, axis.nominal)
    points = np.stack([centre, centre + 0.01], axis=1)
    whitener = Whitener.of_partial(np.array([0.5, -0.2]))
    found = whitened_products(axis, [record], points, whitener)
    outputs = [axis.to_model(axis_values).simulate(record.u).y for axis_values in _values(axis, points)]
    rows = whitener.apply(np.stack([record.y - outputs[0], outputs[0] - outputs[1]]))
    np.testing.assert_allclose(found, rows @ rows.T, rtol=1e-6, atol=1e-9)


def _values(axis: AxisParameters, points: FloatArray) -> list[FloatArray]:
    return list(as_values(axis.parameters, points).T)


def test_over_the_posterior_the_expansion_is_the_likelihood() -> None:
    """Over Laplace draws the expansion leaves a small part of what the log-density spreads."""
    target, centre, covariance = _target()
    draws = np.random.default_rng(2).multivariate_normal(centre, covariance, size=200)
    exact, expanded = target(draws), Expansion(target, centre, covariance)(draws)
    kept = np.isfinite(exact)
    assert kept.sum() > 150
    assert np.std((exact - expanded)[kept]) < 0.15 * np.std(exact[kept])
    at_centre = Expansion(target, centre, covariance)(centre[None]) - target(centre[None])
    assert abs(at_centre[0]) < 1e-6


def test_weights_restore_the_density_that_was_meant() -> None:
    """Draws of a density that is off centre and too wide become draws of the right one."""

    class Normal:
        records = ()

        def __call__(self, x: FloatArray) -> FloatArray:
            return -0.5 * np.sum(x**2, axis=1)

    rng = np.random.default_rng(1)
    draws = 0.3 + 1.3 * rng.standard_normal((4, 200, 64, 2))
    log_density = -0.5 * np.sum(((draws - 0.3) / 1.3) ** 2, axis=-1)
    target: Any = Normal()
    states, heights, judged = reweighted("expanded_likelihood", draws, log_density, target, rng, 2000)
    flat = states.reshape(-1, 2)
    np.testing.assert_allclose(heights.ravel(), target(flat))
    assert judged.holds and judged.draws == 8000
    assert len(flat) <= judged.effective < 0.9 * judged.draws and judged.effective - len(flat) < 4 * 32
    np.testing.assert_allclose(flat.mean(axis=0), 0, atol=0.05)
    np.testing.assert_allclose(flat.std(axis=0), 1, atol=0.04)
    narrow = 0.3 * rng.standard_normal((4, 200, 64, 2))
    log_narrow = -0.5 * np.sum((narrow / 0.3) ** 2, axis=-1)
    _, _, bad = reweighted("expanded_likelihood", narrow, log_narrow, target, rng, 2000)
    assert not bad.holds


@pytest.mark.slow
def test_long_records_have_the_posterior_of_the_whole_likelihood(monkeypatch: pytest.MonkeyPatch) -> None:
    records = [measured(MODEL, 2000, 3), measured(MODEL, 2000, 4)]
    settings = SamplerSettings(target_ess=800)
    plain = infer(MODEL, records, np.random.default_rng(1), free="conditional", settings=settings).posterior
    monkeypatch.setattr(long_records, "LONG_SAMPLES", 4000)
    found = infer(MODEL, records, np.random.default_rng(1), free="conditional", settings=settings).posterior
    assert plain.reweighting is None and found.reweighting is not None
    assert found.converged and found.reweighting.samples == 4000 and found.reweighting.pareto_k < 0.7
    assert found.to_dict()["expanded_likelihood"]["samples"] == 4000
    for name, summary in plain.summaries.items():
        assert abs(found.summaries[name].mean - summary.mean) < 0.15 * summary.sd, name
        assert found.summaries[name].sd == pytest.approx(summary.sd, rel=0.12), name
