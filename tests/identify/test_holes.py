"""Samples that were not measured: whitening and likelihood are those of the dense Gaussian without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_axis import commands, known_axis, simulated_records
from scipy import linalg, signal, stats

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure, simulate, to_coordinates
from bayes_hw.identify.criterion import dynamics_criterion
from bayes_hw.identify.growth import cascade_response
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import evaluate, triangular_factor
from bayes_hw.identify.growth.search import Grown, smallest_cascade
from bayes_hw.identify.holes import Holes, predictors, without_holes
from bayes_hw.identify.noise import autoregression_from_partial, burg, estimate_noise
from bayes_hw.identify.output_error import whitened
from bayes_hw.identify.validation import fit_percent
from bayes_hw.record import Record, Units

SAMPLES = 60
PARTIAL = ([], [0.8], [0.7, -0.4], [0.9, -0.5, 0.3, 0.2])
MASKS = {
    "single": np.arange(SAMPLES) % 7 != 3,
    "near each other": ~np.isin(np.arange(SAMPLES), [20, 22, 25, 26, 27, 31]),
    "a third": np.random.default_rng(3).random(SAMPLES) > 0.3,
    "ends": ~np.isin(np.arange(SAMPLES), [0, 2, SAMPLES - 2, SAMPLES - 1]),
    "long": np.abs(np.arange(SAMPLES) - 27) > 7,
}


def covariance(partial: FloatArray, samples: int) -> FloatArray:
    """Of an autoregression with innovations of unit variance, by its impulse response."""
    phi = autoregression_from_partial(partial[:, None])[:, 0]
    impulse = np.zeros(20_000)
    impulse[0] = 1.0
    response = signal.lfilter([1.0], np.r_[1.0, -phi], impulse)
    return linalg.toeplitz([response[lag:] @ response[: len(response) - lag] for lag in range(samples)])


def drawn(partial: FloatArray, rows: int, seed: int = 1) -> FloatArray:
    root = np.linalg.cholesky(covariance(partial, SAMPLES))
    return np.random.default_rng(seed).standard_normal((rows, SAMPLES)) @ root.T


@pytest.mark.parametrize("partial", PARTIAL)
@pytest.mark.parametrize("mask", MASKS)
def test_likelihood_is_the_dense_one_of_what_was_measured(partial: list[float], mask: str) -> None:
    """Whatever stands in the holes, and in both forms: signals whitened, and sums of many walkers
    corrected."""
    kappa, measured = np.array(partial), MASKS[mask]
    e = drawn(kappa, 3)
    own = covariance(kappa, SAMPLES)[np.ix_(measured, measured)]
    squares = np.sum(
        linalg.solve_triangular(np.linalg.cholesky(own), e[:, measured].T, lower=True) ** 2, axis=0
    )
    logarithms = 0.5 * np.linalg.slogdet(own)[1]
    count = np.count_nonzero(measured)
    whitener = Whitener.of_partial(kappa)
    for fill in (0.0, 1e6, np.nan):
        filled = np.where(measured, e, fill)
        np.testing.assert_allclose(
            np.sum(whitener.apply(filled, 0, measured) ** 2, axis=1), squares, rtol=1e-9
        )
        for row, square in zip(filled, squares, strict=True):
            expected = -0.5 * count * (np.log(2 * np.pi * square / count) + 1) - logarithms
            assert whitener.log_likelihood([row], [measured]) == pytest.approx(expected, rel=1e-10)
    _, variances = predictors(kappa)
    complete = 0.5 * np.sum(np.log(variances[np.minimum(np.arange(SAMPLES), len(kappa))]))
    holes = Holes.of(measured, len(kappa))
    every = np.repeat(kappa[:, None], 3, axis=1)
    terms, change = holes.corrections(e[:, holes.near].T, every)
    np.testing.assert_allclose(np.sum(whitener.apply(e) ** 2, axis=1) + terms, squares, rtol=1e-8)
    np.testing.assert_allclose(complete + change, logarithms, atol=1e-8)


@pytest.mark.parametrize("partial", PARTIAL)
def test_whitened_from_silence_is_white(partial: list[float]) -> None:
    """The least-squares whitening, with silence before the record, inverts the covariance that it implies."""
    kappa, measured = np.array(partial), MASKS["near each other"]
    phi = autoregression_from_partial(kappa[:, None])[:, 0]
    unmixed = linalg.toeplitz(np.r_[1.0, -phi, np.zeros(SAMPLES - len(phi) - 1)], np.zeros(SAMPLES))
    unmixed[0, 0] = 1.0
    dense = np.linalg.inv(np.tril(unmixed))
    own = (dense @ dense.T)[np.ix_(measured, measured)]
    e = drawn(kappa, 2)
    found = whitened(np.where(measured, e, 1e6), phi, measured)
    assert np.all(found[:, ~measured] == 0)
    expected = np.einsum("ki,ij,kj->k", e[:, measured], np.linalg.inv(own), e[:, measured])
    np.testing.assert_allclose(np.sum(found**2, axis=1), expected, rtol=1e-9)
    complete = np.ones(SAMPLES, dtype=np.bool_)
    np.testing.assert_array_equal(whitened(e, phi, complete), whitened(e, phi))


def test_noise_is_estimated_without_the_holes() -> None:
    """Of 20,000 samples a tenth is not measured: the estimate stays, and its order."""
    kappa = np.array([0.85, -0.5])
    phi = autoregression_from_partial(kappa[:, None])[:, 0]
    rng = np.random.default_rng(5)
    e = signal.lfilter([1.0], np.r_[1.0, -phi], rng.standard_normal(20_000))
    spoilt = np.where(rng.random(len(e)) < 0.1, np.nan, e)
    partial, variances = burg([spoilt], 4)
    np.testing.assert_allclose(partial, [*kappa, 0.0, 0.0], atol=0.03)
    assert variances[2] == pytest.approx(1.0, rel=0.03)
    assert estimate_noise([spoilt]).order == estimate_noise([e]).order == 2


def test_criterion_and_fit_do_not_count_holes() -> None:
    e = drawn(np.array([0.8]), 1)[0]
    spoilt = np.where(MASKS["single"], e, np.nan)
    assert np.isfinite(dynamics_criterion([spoilt], 3))
    assert fit_percent(spoilt, 0.9 * e) == fit_percent(e[MASKS["single"]], 0.9 * e[MASKS["single"]])
    np.testing.assert_array_equal(without_holes(np.array([1.0, np.nan, 3.0, np.nan])), [1.0, 2.0, 3.0, 3.0])


def test_blocks_of_a_long_record_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """The triangular factor of a descent is the same whether a record is linearised whole or in pieces."""
    rng = np.random.default_rng(2)
    (record,) = simulated_records(known_axis(), commands(rng, 1, 0.4), rng, 0.01)
    measured = rng.random(len(record)) > 0.1
    measured[395:399] = False
    record = replace(record, measured=measured)
    structure = Structure(2, True, 0, 0, lower=True, upper=True, dead_zone=True)
    grown = smallest_cascade([record], structure, 0.01)
    point = evaluate(grown.response, grown.point.coordinates, Whitener.of_partial(np.array([0.6, 0.3, 0.2])))
    whole = triangular_factor(grown.response, point)
    monkeypatch.setattr(cascade_response, "BLOCK_SAMPLES", 400)
    np.testing.assert_allclose(
        np.abs(triangular_factor(grown.response, point)), np.abs(whole), rtol=1e-7, atol=1e-7
    )


STRUCTURE = Structure(2, True, 0, 1, lower=True, upper=True, dead_zone=True)
VALUES = CascadeValues(
    -0.3, 0.42, 0.05, 0.0, 0.05, np.zeros((2, 0)), np.array([[1.5], [0.8], [0.004], [0.0]]), np.zeros((1, 3))
)


def coloured_record(seed: int, samples: int = 1500) -> Record:
    """The axis above under a slow multisine, with first-order noise of 0.01."""
    rng = np.random.default_rng(seed)
    (u,) = commands(rng, 1, 0.4, samples / 20)
    record = Record(f"r{seed}", np.arange(samples) / 20, u, np.zeros(samples), 20.0, Units())
    (y,) = simulate(STRUCTURE, to_coordinates(STRUCTURE, VALUES)[:, None], [record])
    return replace(record, y=y[0] + 0.01 * signal.lfilter([0.6], [1.0, -0.8], rng.standard_normal(samples)))


def holed(record: Record, seed: int) -> BoolArray:
    """A mask of `record` with holes of one to three samples, 3 % of all."""
    rng = np.random.default_rng(seed)
    measured = np.ones(len(record), dtype=np.bool_)
    for start in rng.choice(len(record) // 8, round(0.015 * len(record)), replace=False) * 8 + 1:
        measured[start : start + rng.integers(1, 4)] = False
    return measured


def descended(record: Record, noise: Whitener) -> tuple[FloatArray, FloatArray]:
    """Estimate of the axis under a given noise, by Gauss-Newton from the truth, and its covariance there."""
    response = Grown.at(STRUCTURE, VALUES, [record]).response
    x = response.coordinates(VALUES)
    slopes = triangular_factor(response, evaluate(response, x, noise))[:-1, :-1]
    for _ in range(8):
        factor = triangular_factor(response, evaluate(response, x, noise))
        x = x + np.linalg.solve(factor[:-1, :-1], factor[:-1, -1])
    return x, np.linalg.inv(slopes.T @ slopes) * (0.01 * 0.6) ** 2


def test_estimate_moves_by_no_more_than_the_lost_information() -> None:
    """What an estimate moves by when data are taken from it has the difference of the two covariances
    (Hausman 1978, doi 10.2307/1913827): the squares over it, of twelve records with 3 % lost, are
    chi-squared. What stood in the holes does not matter to the last bit."""
    noise, squares = Whitener.of_partial(np.array([0.8])), []
    for seed in range(12):
        record = coloured_record(seed)
        measured = holed(record, seed)
        lost = replace(record, measured=measured)
        x, covariance_complete = descended(record, noise)
        moved, covariance_lost = descended(lost, noise)
        more = covariance_lost - covariance_complete
        assert np.all(np.diag(more) > 0)
        assert np.all(np.diag(covariance_lost) < 1.4 * np.diag(covariance_complete))
        squares.append((moved - x)[:3] @ np.linalg.solve(more[:3, :3], (moved - x)[:3]))
        wild = replace(record, y=np.where(measured, record.y, 1e6), measured=measured)
        np.testing.assert_array_equal(descended(wild, noise)[0], moved)
    low, high = stats.chi2.ppf([1e-3, 1 - 1e-3], 3 * len(squares))
    assert low < sum(squares) < high
