"""The compiled simulator agrees with a 40-digit difference equation and keeps its walkers apart."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from direct_form import log_likelihood as exact_log_likelihood
from direct_form import simulate as exact_simulate
from hypothesis import given, settings
from hypothesis import strategies as st
from printed.nanshan import nanshan_model

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.noise import log_likelihood
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import (
    KnownSignals,
    _lagged_residual_sums,
    lagged_residual_sums,
    simulate_batch,
)
from bayes_hw.model.lanes import LANES
from bayes_hw.model.linear import LinearBlock
from bayes_hw.model.modal import ModalForm, linear_batch, modal_form
from bayes_hw.model.robust_kernel import robust_residual_sums
from bayes_hw.model.streaming import simulated_blocks

TOLERANCE = 1e-11


def form_of(model: HammersteinWiener, walkers: int = 1) -> ModalForm:
    gains = model.normalization
    static = [
        *(model.saturation.lower, model.saturation.upper, gains.c1),
        *(model.dead_zone.half_width, gains.c2, gains.c3),
    ]
    return modal_form(linear_batch(model.linear, walkers), np.repeat(np.array(static)[:, None], walkers, 1))


def axis(linear: LinearBlock, half_width: float = 0.05) -> HammersteinWiener:
    return HammersteinWiener("test", 20.0, Saturation(-0.6, 0.9, 1.2), linear, DeadZone(half_width, 1.1, 0.8))


def roots(real: list[float], upper: list[complex]) -> np.ndarray:
    return np.array([*real, *upper, *[z.conjugate() for z in upper]], dtype=np.complex128)


def relative_error(found: FloatArray, exact: list[mpmath.mpf]) -> float:
    scale = max(abs(value) for value in exact)
    return float(max(abs(mpmath.mpf(f) - e) for f, e in zip(found.tolist(), exact, strict=True)) / scale)


def assert_simulates_exactly(
    model: HammersteinWiener, u: FloatArray, before: float = 0.0, tolerance: float = TOLERANCE
) -> None:
    w, y = exact_simulate(model, u, before)
    batch = simulate_batch(form_of(model), u, model.linear.delay_samples, before)
    if not any(w):
        assert not np.any(batch.w) and not np.any(batch.y)
        return
    scale = max(abs(value) for value in w)
    assert relative_error(batch.w[0], w) < tolerance
    assert (
        max(abs(mpmath.mpf(f) - e) for f, e in zip(batch.y[0].tolist(), y, strict=True)) < tolerance * scale
    )


def test_nanshan_signals_and_log_probability_to_40_digit_arithmetic() -> None:
    """w, y, the lagged sums and the AR(3) log-likelihood of the Nanshan model, 1e-11 relative."""
    rng = np.random.default_rng(3)
    model = nanshan_model()
    u = 0.5 * np.sin(np.cumsum(np.linspace(0, 1.5, 700)))
    w, y = exact_simulate(model, u)
    measured = np.array([float(value) for value in y]) + 1e-3 * rng.standard_normal(700)
    batch = simulate_batch(form_of(model), u, model.linear.delay_samples)
    assert relative_error(batch.w[0], w) < TOLERANCE
    assert relative_error(batch.y[0], y) < TOLERANCE

    partial = [0.6, -0.3, 0.2]
    sums = lagged_residual_sums(form_of(model), u, measured, model.linear.delay_samples, 3)
    residual = [mpmath.mpf(m) - value for m, value in zip(measured.tolist(), y, strict=True)]
    energy = mpmath.fsum(e * e for e in residual)
    for lag in range(4):
        exact = mpmath.fsum(residual[k] * residual[k - lag] for k in range(lag, 700))
        assert abs(mpmath.mpf(sums.lagged[lag, 0]) - exact) < TOLERANCE * energy
    found = log_likelihood(sums, 700, np.array([1e-3]), np.array(partial)[:, None])
    exact = exact_log_likelihood(residual, 1e-3, partial)
    assert abs(mpmath.mpf(found[0]) - exact) < TOLERANCE * abs(exact)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n_real=st.integers(0, 3),
    n_pairs=st.integers(0, 2),
    integrator=st.booleans(),
    missing=st.integers(0, 3),
    delay=st.integers(0, 5),
)
def test_random_axes_agree_with_40_digit_arithmetic(
    seed: int, n_real: int, n_pairs: int, integrator: bool, missing: int, delay: int
) -> None:
    """Any structure with poles at least 0.1 apart: real poles, pairs, direct term, delay, unequal gains."""
    rng = np.random.default_rng(seed)
    real = rng.permutation(np.arange(-0.9, 0.91, 0.2))[:n_real] + rng.uniform(-0.05, 0.05, n_real)
    angles = rng.permutation(np.linspace(0.4, 2.6, 6))[:n_pairs]
    pairs = rng.uniform(0.7, 0.98, n_pairs) * np.exp(1j * angles)
    poles = roots([*real.tolist(), *([1.0] if integrator else [])], pairs.tolist())
    if len(poles) == 0:
        poles = roots([0.5], [])
    n_zeros = max(len(poles) - missing, 0)
    zeros = roots(
        rng.uniform(-1.5, 1.5, n_zeros % 2).tolist(),
        (rng.uniform(0.3, 1.2, n_zeros // 2) * np.exp(1j * rng.uniform(0.2, 3.0, n_zeros // 2))).tolist(),
    )
    model = axis(LinearBlock(zeros, poles, float(rng.uniform(0.1, 2)), delay))
    assert_simulates_exactly(model, rng.normal(size=90), before=float(rng.normal()))


@pytest.mark.parametrize(
    ("linear", "samples"),
    [
        pytest.param(LinearBlock(roots([], []), roots([1.0, 0.5], []), 0.3, 0), 100, id="no pairs"),
        pytest.param(LinearBlock(roots([], []), roots([], [0.9j]), 0.3, 2), 100, id="no real poles"),
        pytest.param(LinearBlock(roots([0.2], []), roots([0.5], []), 0.3, 0), 100, id="direct term"),
        pytest.param(LinearBlock(roots([], []), roots([0.5], []), 0.3, 40), 31, id="delay over the record"),
        pytest.param(LinearBlock(roots([], []), roots([0.5], []), 0.3, 0), 1, id="one sample"),
    ],
)
def test_pole_configurations(linear: LinearBlock, samples: int) -> None:
    u = np.random.default_rng(1).normal(size=samples)
    assert_simulates_exactly(axis(linear), u, before=0.4)


@pytest.mark.parametrize(
    ("poles", "tolerance"),
    [
        pytest.param(roots([0.8, 0.8], []), 1e-8, id="repeated real pole"),
        pytest.param(roots([1.0, 0.97, 0.97, 0.2], []), 1e-6, id="repeated slow pole"),
        pytest.param(roots([0.0, 0.0, 0.7], []), 1e-9, id="two poles at zero"),
        pytest.param(roots([1.0], [0.6 + 0.6j, 0.6 + 0.6j]), 1e-8, id="repeated pair"),
        pytest.param(roots([0.8, 0.8 + 3e-6], []), 1e-8, id="nearly repeated real pole"),
    ],
)
def test_coinciding_poles_keep_a_bounded_error(poles: np.ndarray, tolerance: float) -> None:
    """Moved apart by 1e-5, they cost a known accuracy instead of the answer."""
    u = np.random.default_rng(1).normal(size=400)
    assert_simulates_exactly(axis(LinearBlock(roots([0.3], []), poles, 0.3, 0)), u, tolerance=tolerance)


def test_command_before_the_record_fills_the_delay() -> None:
    """w(k) of G = z^-3 / (z - 0.5) is the step response to the constant command before the record."""
    model = axis(LinearBlock(roots([], []), roots([0.5], []), 1.0, 3))
    w = simulate_batch(form_of(model), np.zeros(6), 3, before=0.5).w[0]
    v = 1.2 * 0.5
    np.testing.assert_allclose(w, [0, v, 1.5 * v, 1.75 * v, 0.875 * v, 0.4375 * v], rtol=1e-15)


def scattered(walkers: int) -> ModalForm:
    """Nanshan axes with a few per cent of scatter in every coefficient."""
    form = form_of(nanshan_model(), walkers)
    rng = np.random.default_rng(2)

    def spread(values: FloatArray) -> FloatArray:
        return values * (1 + 1e-3 * rng.standard_normal(values.shape[-1]))

    return replace(form, static=spread(form.static), real=form.real * 0.999, pairs=form.pairs * 0.999)


@pytest.mark.parametrize("walkers", [1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_a_walker_does_not_depend_on_its_neighbours(walkers: int) -> None:
    """Every walker of a batch, whole groups of lanes or not, gives the bits it gives alone."""
    rng = np.random.default_rng(5)
    u, y = rng.normal(size=77), rng.normal(size=77)
    form = scattered(walkers)
    batch = simulate_batch(form, u, 2)
    sums = lagged_residual_sums(form, u, y, 2, 4)
    assert batch.w.shape == (walkers, 77) and sums.lagged.shape == (5, walkers)
    for i in {0, walkers // 2, walkers - 1}:
        alone = ModalForm(
            form.static[:, [i]],
            form.real[..., [i]],
            form.pairs[..., [i]],
            form.real_state[..., [i]],
            form.pair_state[..., [i]],
        )
        np.testing.assert_array_equal(simulate_batch(alone, u, 2).y[0], batch.y[i])
        for whole, part in zip(sums, lagged_residual_sums(alone, u, y, 2, 4), strict=True):
            np.testing.assert_array_equal(whole[:, i], part[:, 0])


@pytest.mark.parametrize("field", ["static", "real", "pairs"])
def test_nan_stays_in_its_own_lane(field: str) -> None:
    """A NaN in any coefficient makes that walker NaN, in w or y and in every sum, and no other."""
    rng = np.random.default_rng(5)
    u, y = rng.normal(size=50), rng.normal(size=50)
    form = scattered(LANES + 3)
    clean = lagged_residual_sums(form, u, y, 1, 2)
    broken = getattr(form, field)
    for index in np.ndindex(broken.shape[:-1]):
        values = broken.copy()
        values[(*index, 7)] = np.nan
        spoilt = replace(form, **{field: values})
        sums = lagged_residual_sums(spoilt, u, y, 1, 2)
        others = np.delete(np.arange(LANES + 3), 7)
        assert np.isnan(sums.lagged[:, 7]).all(), (field, index)
        assert np.isnan(simulate_batch(spoilt, u, 1).y[7]).any(), (field, index)
        np.testing.assert_array_equal(sums.lagged[:, others], clean.lagged[:, others])


def test_overflow_is_not_a_finite_likelihood() -> None:
    """An unstable walker whose response overflows gives no finite sum."""
    form = form_of(axis(LinearBlock(roots([], []), roots([0.5], [0.3j]), 1.0, 0)))
    form = replace(form, real=np.array([[[40.0]], [[1.0]]]), pairs=form.pairs * 60)
    sums = lagged_residual_sums(form, np.ones(600), np.zeros(600), 0, 1)
    assert not np.isfinite(sums.lagged).any()


@pytest.mark.parametrize(("samples", "order"), [(1, 0), (3, 2), (63, 12), (64, 12), (65, 12), (100, 5)])
def test_sums_head_and_tail_of_the_residual(samples: int, order: int) -> None:
    """Lengths on either side of the kernel's block of 64, and records hardly longer than the order. A fused
    multiply-add rounds the residual once where y and the difference round twice."""
    rng = np.random.default_rng(8)
    u, y = rng.normal(size=samples), rng.normal(size=samples)
    form = form_of(axis(LinearBlock(roots([], []), roots([0.5], []), 1.0, 0)))
    e = y - simulate_batch(form, u, 0).y[0]
    sums = lagged_residual_sums(form, u, y, 0, order)
    products = [e[lag:] @ e[: samples - lag] for lag in range(order + 1)]
    np.testing.assert_allclose(sums.lagged[:, 0], products, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(sums.head[:, 0], e[:order], rtol=0, atol=1e-15)
    np.testing.assert_allclose(sums.tail[:, 0], e[samples - order :], rtol=0, atol=1e-15)


@pytest.mark.parametrize("samples", [63, 150])
def test_known_signals_through_the_load_and_at_the_encoder(samples: int) -> None:
    """Two are added to w before the dead zone, one to the reading behind it, each by the walker's weight, in
    the signals, in the sums of both likelihoods and block by block."""
    rng = np.random.default_rng(9)
    u, y, rows = rng.normal(size=samples), rng.normal(size=samples), rng.normal(size=(3, samples))
    model = axis(LinearBlock(roots([], []), roots([0.5], [0.6 + 0.3j]), 1.0, 0), 0.2)
    weights = rng.normal(size=(3, LANES + 3))
    form = replace(form_of(model, LANES + 3), known=weights)
    signals = KnownSignals(rows, through=2)
    w = model.simulate(u).w + weights[:2].T @ rows[:2]
    output = model.dead_zone(w) + weights[2][:, None] * rows[2]
    batch = simulate_batch(form, u, 0, signals=signals)
    np.testing.assert_allclose(batch.w, w, atol=1e-12)
    np.testing.assert_allclose(batch.y, output, atol=1e-12)
    np.testing.assert_allclose(next(simulated_blocks(form, u, 0, 0.0, signals))[1], output, atol=1e-12)
    e = y - output
    sums = lagged_residual_sums(form, u, y, 0, 1, signals=signals)
    products = [np.sum(e[:, lag:] * e[:, : samples - lag], axis=1) for lag in range(2)]
    np.testing.assert_allclose(sums.lagged, products, atol=1e-10)
    np.testing.assert_allclose(sums.whole[0], e.sum(axis=1), atol=1e-10)
    ones = np.ones((1, LANES + 3))
    robust = robust_residual_sums(form, u, y, 0, 0.5 * ones, 2 * ones[0], signals=signals)
    logarithms = np.log1p(2 * (e[:, 1:] - 0.5 * e[:, :-1]) ** 2).sum(axis=1)
    np.testing.assert_allclose(robust.logarithms, logarithms, atol=1e-10)


def test_compiled_once_and_kept_on_disk() -> None:
    """A second process must not compile again: the cache is on and one signature serves every call."""
    form = form_of(axis(LinearBlock(roots([], []), roots([0.5], []), 1.0, 0)))
    for order in (0, 3):
        lagged_residual_sums(form, np.ones(40), np.ones(40), 0, order)
    assert len(_lagged_residual_sums.signatures) == 1
    assert _lagged_residual_sums.stats.cache_path
