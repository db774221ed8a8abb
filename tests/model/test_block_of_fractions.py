"""Zeros of partial fractions answer as these do, also where fourteen poles lie about one place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.arrays import FloatArray
from bayes_hw.model.block_of_fractions import block_of_fractions
from bayes_hw.model.linear import LinearBlock

SAMPLES = 400

CLUSTER = np.array([0.991, 0.986, 0.958, 1.0])
"""Real poles beside pairs about z = 1, as a search at a high rate finds them."""


def impulse_response(real: FloatArray, sections: FloatArray, direct: float) -> FloatArray:
    """Of every fraction by its own recursion (samples,)."""
    found = np.zeros(SAMPLES)
    found[0] = direct
    for pole, residue in real.T:
        found[1:] += residue * pole ** np.arange(SAMPLES - 1)
    for a1, a2, b1, b2 in sections.T:
        h = np.zeros(SAMPLES)
        h[1], h[2] = b1, a1 * b1 + b2
        for k in range(3, SAMPLES):
            h[k] = a1 * h[k - 1] - a2 * h[k - 2]
        found += h
    return found


def poles_of(real: FloatArray, sections: FloatArray) -> FloatArray:
    pairs = [np.roots([1.0, -a1, a2]) for a1, a2 in sections[:2].T]
    return np.concatenate([real[0], *pairs]).astype(complex)


def pair(radius: float, angle: float, b1: float, b2: float) -> list[float]:
    return [2 * radius * np.cos(angle), radius**2, b1, b2]


def check(real: FloatArray, sections: FloatArray, direct: float, tolerance: float) -> None:
    block = block_of_fractions(real, sections, direct, poles_of(real, sections), 3)
    expected = np.concatenate([np.zeros(3), impulse_response(real, sections, direct)])[:SAMPLES]
    found = block.filter(np.concatenate([[1.0], np.zeros(SAMPLES - 1)]))
    np.testing.assert_allclose(found, expected, atol=tolerance * np.abs(expected).max())


def test_poles_close_together_leave_the_response_as_it_was() -> None:
    """Zeros of the numerator on one denominator lose it."""
    rng = np.random.default_rng(1)
    real = np.stack([CLUSTER, rng.normal(0, 0.1, len(CLUSTER))])
    radii, angles = (0.975, 0.977, 0.97, 0.99), (0.0169, 0.0087, 0.187, 0.19)
    sections = np.array([pair(r, a, *rng.normal(0, 0.5, 2)) for r, a in zip(radii, angles, strict=True)]).T
    check(real, sections, 0.0, 1e-9)
    on_one = LinearBlock(
        np.roots(numerator(real, sections)),
        poles_of(real, sections),
        float(real[1].sum() + sections[2].sum()),
        0,
    )
    found = on_one.filter(np.concatenate([[1.0], np.zeros(SAMPLES - 1)]))
    expected = impulse_response(real, sections, 0.0)
    assert np.abs(found - expected).max() > 1e-3 * np.abs(expected).max()


def numerator(real: FloatArray, sections: FloatArray) -> FloatArray:
    """On one denominator (order,)."""
    tops = [*real[1][:, None], *sections[2:].T]
    bottoms = [*np.stack([np.ones(real.shape[1]), -real[0]]).T]
    bottoms += [np.array([1.0, -a1, a2]) for a1, a2 in sections[:2].T]
    found = np.zeros(real.shape[1] + 2 * sections.shape[1])
    for i, top in enumerate(tops):
        product = top
        for j, bottom in enumerate(bottoms):
            product = product if i == j else np.convolve(product, bottom)
        found[len(found) - len(product) :] += product
    return found


@pytest.mark.parametrize("direct", [0.0, 0.3])
@given(
    real=st.lists(st.tuples(st.floats(-0.9, 1.0), st.floats(-2, 2)), min_size=0, max_size=3),
    pairs=st.lists(
        st.tuples(st.floats(0.2, 0.99), st.floats(0.1, 3.0), st.floats(0.1, 2), st.floats(-2, 2)),
        min_size=1,
        max_size=3,
    ),
)
def test_any_fractions_come_back(
    direct: float,
    real: list[tuple[float, float]],
    pairs: list[tuple[float, float, float, float]],
) -> None:
    sections = np.array([pair(*each) for each in pairs]).T
    check(np.array(real).reshape(-1, 2).T, sections, direct, 1e-6)


def test_samples_without_an_answer_are_no_zeros() -> None:
    """Weights that cancel in the first sample leave a zero fewer."""
    real, sections = np.array([[0.5, 0.2], [1.0, -1.0]]), np.zeros((4, 0))
    block = block_of_fractions(real, sections, 0.0, poles_of(real, sections), 0)
    assert len(block.zeros) == 0
    assert block.gain == pytest.approx(0.3)
