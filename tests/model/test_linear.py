"""The linear block means the same as poles, coefficients and difference equation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from printed.nanshan import nanshan_linear_block
from scipy import signal

from bayes_hw.errors import InputError
from bayes_hw.model.excitation import sine_sweep
from bayes_hw.model.linear import LinearBlock, Mode, mode_pole, polynomial_roots

REAL = st.floats(-0.95, 0.95)
PAIR = st.tuples(st.floats(0.05, 0.97), st.floats(0.05, 3.09)).map(
    lambda polar: polar[0] * np.exp(1j * polar[1])
)
COEFFICIENT = st.floats(-2, 2).map(lambda value: round(value, 3))


@st.composite
def roots(draw: st.DrawFn, most: int) -> np.ndarray:
    """Up to `most` roots inside the circle, complex ones in pairs."""
    pairs = draw(st.lists(PAIR, max_size=most // 2))
    real = draw(st.lists(REAL, max_size=most - 2 * len(pairs)))
    return np.array([*real, *pairs, *np.conj(pairs)], dtype=complex)


@st.composite
def blocks(draw: st.DrawFn) -> LinearBlock:
    """Stable proper blocks with up to six poles."""
    poles = draw(roots(6))
    zeros = draw(roots(6).filter(lambda found: len(found) <= len(poles)))
    gain = draw(st.floats(0.01, 10))
    return LinearBlock(zeros, poles, gain, draw(st.integers(0, 4)))


def _convolve(a: Sequence[mpmath.mpc], b: Sequence[mpmath.mpc]) -> list[mpmath.mpc]:
    product = [mpmath.mpc(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            product[i + j] += x * y
    return product


def _expand(found: np.ndarray) -> list[mpmath.mpf]:
    factors = [[mpmath.mpc(1), -mpmath.mpc(complex(root))] for root in found]
    return [mpmath.re(c) for c in reduce(_convolve, factors, [mpmath.mpc(1)])]


def _exact_response(block: LinearBlock, v: np.ndarray) -> np.ndarray:
    """The difference equation of the block's own roots in 40 digits."""
    with mpmath.workdps(40):
        b = [mpmath.mpf(block.gain) * c for c in _expand(block.zeros)]
        a = _expand(block.poles)
        inputs = [mpmath.mpf(0)] * block.total_delay + [mpmath.mpf(float(x)) for x in v]
        w: list[mpmath.mpf] = []
        for k in range(len(v)):
            forced = mpmath.fsum(c * inputs[k - i] for i, c in enumerate(b) if k >= i)
            w.append(forced - mpmath.fsum(a[i] * w[k - i] for i in range(1, len(a)) if k >= i))
        return np.array([float(x) for x in w])


@given(blocks())
def test_coefficients_survive_the_round_trip(block: LinearBlock) -> None:
    """Blocks with roots at zero come back without them, but with the same coefficients."""
    numerator, denominator = block.coefficients()
    again = LinearBlock.from_coefficients(numerator, denominator).coefficients()
    for found, expected in zip(again, (numerator, denominator), strict=True):
        size = max(len(found), len(expected))
        found = np.pad(found, (0, size - len(found)))
        expected = np.pad(expected, (0, size - len(expected)))
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@given(
    st.lists(COEFFICIENT, min_size=1, max_size=6).filter(any),
    st.lists(st.floats(-0.3, 0.3).map(lambda a: round(a, 3)), max_size=4),
    st.integers(0, 5),
    st.integers(0, 2),
    st.sampled_from([1.0, -2.0, 0.5]),
    st.integers(1, 12),
)
def test_coefficients_keep_their_delays(
    b: list[float], a: list[float], lead: int, trail: int, scale: float, samples: int
) -> None:
    """Against lfilter over records as short as one sample: more zeros than poles, fewer, and padding."""
    numerator = [0.0] * lead + b + [0.0] * trail
    denominator = [scale, *(scale * x for x in a)] + [0.0] * trail
    v = np.cos(np.arange(samples) ** 2 + 0.5)
    w = LinearBlock.from_coefficients(numerator, denominator).filter(v)
    expected = signal.lfilter(numerator, denominator, v)
    assert w == pytest.approx(expected, rel=1e-7, abs=1e-7)


@given(blocks(), st.integers(1, 60))
def test_filter_agrees_with_the_40_digit_recursion(block: LinearBlock, samples: int) -> None:
    v = np.sin(0.7 * np.arange(samples) ** 1.3) + 0.1
    exact = _exact_response(block, v)
    scale = np.abs(_exact_response(block, np.ones(1))).max() + np.abs(exact).max()
    assert block.filter(v) == pytest.approx(exact, rel=0, abs=1e-10 * max(scale, block.gain))


def test_filter_is_exact_to_1e_10_on_the_telescope() -> None:
    """Nine poles, three of them within 0.012 of z = 1, over 100 s."""
    block = nanshan_linear_block()
    v = sine_sweep(20.0, 100.0, 0.3)
    exact = _exact_response(block, v)
    assert np.abs(block.filter(v) - exact).max() < 1e-10 * np.abs(exact).max()


@given(blocks())
def test_total_delay_is_where_a_step_first_shows(block: LinearBlock) -> None:
    step = block.filter(np.ones(block.total_delay + 1))
    assert np.all(step[:-1] == 0)
    assert step[-1] == pytest.approx(block.gain, rel=1e-9)


@given(blocks(), st.floats(0.01, 9.99))
def test_frequency_response_agrees_with_scipy(block: LinearBlock, frequency: float) -> None:
    _, expected = signal.freqz(*block.coefficients(), np.array([frequency]), fs=20.0)
    found = block.frequency_response(np.array([frequency]), 20.0)
    assert found[0] == pytest.approx(expected[0], rel=1e-6, abs=1e-9)


@given(st.floats(0.01, 9.9), st.floats(-0.5, 0.99))
def test_mode_survives_the_round_trip(frequency: float, damping: float) -> None:
    """Where the damped frequency stays below half the sample rate a pole names its mode."""
    mode = Mode.from_pole(Mode(frequency, damping).pole(20.0), 20.0)
    assert mode.frequency_hz == pytest.approx(frequency, rel=1e-9)
    assert mode.damping_ratio == pytest.approx(damping, rel=1e-9, abs=1e-11)


def test_mode_pole_broadcasts() -> None:
    frequency, damping = np.array([1.0, 2.0, 3.0]), np.array([[0.1], [0.2]])
    poles = mode_pole(frequency, damping, 20.0)
    assert poles.shape == (2, 3)
    assert poles[1, 2] == Mode(3.0, 0.2).pole(20.0)


def test_modes_are_listed_by_frequency() -> None:
    pairs = [Mode(3.7, 0.03).pole(20.0), Mode(0.5, 0.4).pole(20.0)]
    block = LinearBlock(np.array([]), np.array([1.0, *pairs, *np.conj(pairs)]), 1.0, 0)
    assert [mode.frequency_hz for mode in block.modes(20.0)] == pytest.approx([0.5, 3.7])


def test_exact_integrator_survives_coefficients() -> None:
    """The telescope's integrator is divided out of its coefficients exactly."""
    block = LinearBlock.from_coefficients([0.0, 1.0], np.poly([1.0, 0.98, 0.97, 0.2]))
    index = block.integrator_index
    assert index is not None
    assert block.poles[index] == 1


@given(st.lists(st.floats(-0.9, 0.9), min_size=1, max_size=4), st.floats(0.1, 5))
def test_velocity_gain_is_the_final_velocity(others: list[float], gain: float) -> None:
    block = LinearBlock(np.array([]), np.array([1.0, *others], dtype=complex), gain, 2)
    w = block.filter(np.ones(800))
    assert block.velocity_gain(20.0) == pytest.approx(20.0 * (w[-1] - w[-2]), rel=1e-6)


def test_without_integrator_there_is_no_velocity_gain() -> None:
    block = LinearBlock(np.array([]), np.array([0.5 + 0j]), 1.0, 0)
    assert block.integrator_index is None
    assert np.isnan(block.velocity_gain(20.0))


@given(roots(4), st.integers(1, 3))
def test_roots_that_coincide_still_make_the_polynomial(found: np.ndarray, multiplicity: int) -> None:
    """As many roots as the degree, in exact conjugate pairs, whose product is the polynomial again."""
    coefficients = np.poly(np.repeat(found, multiplicity)).real
    again = polynomial_roots(np.atleast_1d(coefficients))
    assert len(again) == multiplicity * len(found)
    assert np.array_equal(np.sort_complex(again), np.sort_complex(again.conj()))
    product = np.atleast_1d(np.poly(again))
    assert product == pytest.approx(coefficients, rel=0, abs=1e-12 * np.abs(coefficients).max())


def test_close_roots_are_recovered() -> None:
    """Three roots within 0.012 of z = 1: those of the telescope, from coefficients rounded once."""
    expected = nanshan_linear_block().poles
    found = polynomial_roots(nanshan_linear_block().coefficients()[1])
    assert np.abs(found[:, None] - expected).min(axis=1).max() < 1e-10


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LinearBlock(np.array([0.1, 0.2]), np.array([0.5]), 1.0, 0), "improper"),
        (lambda: LinearBlock(np.array([]), np.array([0.5 + 0.1j]), 1.0, 0), "conjugate"),
        (lambda: LinearBlock(np.array([]), np.array([np.nan + 0j]), 1.0, 0), "finite"),
        (lambda: LinearBlock(np.array([]), np.array([0.5]), 0.0, 0), "gain"),
        (lambda: LinearBlock(np.array([]), np.array([0.5]), 1.0, -1), "delay"),
        (lambda: LinearBlock.from_coefficients([1.0], [0.0, 1.0]), "denominator"),
        (lambda: LinearBlock.from_coefficients([1.0], [0.0]), "denominator"),
        (lambda: LinearBlock.from_coefficients([0.0, 0.0], [1.0]), "numerator"),
        (lambda: LinearBlock.from_coefficients([1.0, np.nan], [1.0]), "finite"),
        (lambda: LinearBlock.from_coefficients([1.0], [1.0, np.inf]), "finite"),
        (
            lambda: LinearBlock(np.array([]), np.array([1.01]), 1.0, 0).check_stable(),
            "unstable, \\|pole\\| = 1.01",
        ),
        (
            lambda: LinearBlock(np.array([]), np.array([1.0, -1.0]), 1.0, 0).check_stable(),
            "2 poles on the unit circle",
        ),
    ],
)
def test_impossible_blocks_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
