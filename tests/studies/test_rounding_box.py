"""Members drawn from a rounding box are members, uniform, and described correctly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from printed.rounding_box import (
    RoundingBox,
    StableShare,
    resonances,
    roots_of_rows,
    rounding_uncertainty,
    velocity_gain_curve,
    without_integrator,
)
from scipy import signal, stats

from bayes_hw.errors import InputError

RATE_HZ = 20.0
BOX = RoundingBox.from_text(("0", "0.1", "0.05"), ("1", "-1.6", "0.8", "-0.2"), 3)


@given(st.integers(1001, 9999), st.integers(-9, -4), st.sampled_from([-1, 1]))
def test_half_width_is_half_a_unit_of_the_last_significant_digit(
    digits: int, exponent: int, sign: int
) -> None:
    """Every number closer than the half width prints the same, with trailing zeros dropped or not.

    Only below a power of ten, where the digits get finer, is the interval wider than the truth.
    """
    text = f"{sign * digits * 10.0**exponent:.4g}"
    box = RoundingBox.from_text((text,), ("1",), 4)
    assert box.numerator_half_width[0] == pytest.approx(0.5 * 10.0**exponent, rel=1e-12)
    for fraction in (-0.99, 0.99):
        near = box.numerator[0] + fraction * box.numerator_half_width[0]
        assert f"{near:.4g}" == text


def test_displacement_is_in_half_widths_and_infinite_where_exact() -> None:
    numerator, denominator = BOX.displacement(
        BOX.numerator + np.array([0.0, 0.00025, 0]), BOX.denominator + np.array([1e-9, 0, 0, 0])
    )
    assert numerator == pytest.approx([0, 0.5, 0])
    assert denominator.tolist() == [np.inf, 0, 0, 0]


def test_sampled_integrators_lie_in_the_box_and_sum_to_zero() -> None:
    numerators, denominators = BOX.sample_integrators(np.random.default_rng(0), 500)
    assert numerators.shape == (500, 3)
    assert denominators.shape == (500, 4)
    assert np.abs(denominators.sum(axis=1)).max() < 1e-15
    for row in range(500):
        inside = np.concatenate(BOX.displacement(numerators[row], denominators[row]))
        assert np.abs(inside).max() <= 1


def test_section_is_uniform_whichever_coefficient_is_solved_for() -> None:
    """Two draws agree by Kolmogorov-Smirnov, and each follows the law of three uniforms that sum to zero.

    That law has the density 2 - |x| on [-1, 1], so |x| < 1/2 has the probability 7/12.
    """
    cube = RoundingBox.from_text(("0", "0.1"), ("1", "-1.60", "0.80", "-0.20"), None)
    by_index = [
        cube.sample_integrators(np.random.default_rng(seed), 4000, solved_for=index)[1]
        for seed, index in ((1, 1), (2, 3))
    ]
    for column in (1, 2, 3):
        assert stats.ks_2samp(by_index[0][:, column], by_index[1][:, column]).pvalue > 1e-3
    for denominators in by_index:
        for column in (1, 2, 3):
            middle = np.abs(denominators[:, column] - cube.denominator[column]) < 0.0025
            assert np.mean(middle) == pytest.approx(7 / 12, abs=4 * np.sqrt(7 / 12 * 5 / 12 / 4000))


def test_box_without_an_integrator_is_refused() -> None:
    box = RoundingBox.from_text(("0", "0.1"), ("1", "-0.5"), 3)
    with pytest.raises(InputError, match="pole at z = 1"):
        box.sample_integrators(np.random.default_rng(0), 10)


def test_roots_of_rows_agree_with_numpy() -> None:
    rows = np.random.default_rng(3).normal(size=(20, 6))
    for row, roots in zip(rows, roots_of_rows(rows), strict=True):
        assert np.sort_complex(roots) == pytest.approx(np.sort_complex(np.roots(row)), abs=1e-9)


def test_integrator_is_divided_out() -> None:
    other = np.array([1.0, -0.9, 0.5])
    rows = np.convolve(other, [1.0, -1.0])[None, :]
    assert without_integrator(rows)[0] == pytest.approx(other, abs=1e-15)


def test_resonances_are_the_lightly_damped_pairs_in_order() -> None:
    s = np.array([[-0.02 * 20 + 20j, -0.02 * 20 - 20j, -0.03 * 10 + 10j, -0.03 * 10 - 10j, -1, -5 + 5j]])
    frequency, damping = resonances(np.exp(s / RATE_HZ), RATE_HZ)
    assert frequency[0] == pytest.approx(np.abs([10 - 0.3j, 20 - 0.4j]) / (2 * np.pi))
    assert damping[0] == pytest.approx([0.3 / abs(10 - 0.3j), 0.4 / abs(20 - 0.4j)])


def test_rows_with_different_numbers_of_resonances_are_refused() -> None:
    light, heavy = np.exp((-0.1 + 5j) / RATE_HZ), np.exp((-5 + 5j) / RATE_HZ)
    with pytest.raises(InputError, match="0 to 1"):
        resonances(np.array([[light, light.conjugate()], [heavy, heavy.conjugate()]]), RATE_HZ)


def test_gain_curve_agrees_with_scipy() -> None:
    frequency = np.array([0.1, 1.0, 7.0])
    _, response = signal.freqz(BOX.numerator, BOX.denominator, frequency, fs=RATE_HZ)
    curve = velocity_gain_curve(BOX.numerator[None, :], BOX.denominator[None, :], frequency, RATE_HZ)
    assert curve[0] == pytest.approx(np.abs(response) * 2 * np.pi * frequency, rel=1e-12)


def test_uncertainty_describes_stable_integrators_only() -> None:
    spread = rounding_uncertainty(BOX, np.random.default_rng(4), 2000, RATE_HZ, np.array([1e-4]))
    assert np.abs(spread.poles).max() < 1
    assert len(spread.poles) == spread.stable_integrators.stable
    assert np.abs(spread.denominators.sum(axis=1)).max() < 1e-14
    assert spread.velocity_gain == pytest.approx(spread.gain_curve[:, 0], rel=1e-4)


def test_share_has_its_binomial_error() -> None:
    share = StableShare(stable=10, draws=1000)
    assert share.share == 0.01
    assert share.standard_error == pytest.approx(np.sqrt(0.01 * 0.99 / 1000))
