"""The information about a choice of two simulators against the closed form of a binary channel."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, special, stats

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.effect_choice import Explanation, choice_gain

T = np.arange(200) / 20
WHITE = np.zeros(0)


def linear(draws: FloatArray, u: FloatArray) -> FloatArray:
    """y = gain u."""
    return draws[:, :1] * u


def cubic(draws: FloatArray, u: FloatArray) -> FloatArray:
    """y = gain u + bend u^3."""
    return draws[:, :1] * u + draws[:, 1:] * u**3


def binary_channel(distance: float) -> float:
    """Mutual information (nats) of a fair bit and a normal measurement of it, `distance` sd apart."""

    def integrand(x: float) -> float:
        probability = special.expit(distance * x - distance**2 / 2)
        entropy = -special.xlogy(probability, probability) - special.xlogy(1 - probability, 1 - probability)
        return float(entropy * 0.5 * (stats.norm.pdf(x) + stats.norm.pdf(x, distance)))

    return float(np.log(2) - integrate.quad(integrand, -10, 10 + distance)[0])


@pytest.mark.parametrize("distance", [0.0, 1.0, 3.0, 12.0])
def test_two_certain_simulators_are_a_binary_channel(distance: float) -> None:
    u = np.sin(2 * np.pi * T)
    step = 0.1 * distance / np.linalg.norm(u)
    first = Explanation("small", linear, np.full((200, 1), 1.0))
    second = Explanation("large", linear, np.full((200, 1), 1.0 + step))
    found = choice_gain(first, second, u, WHITE, 0.1, np.random.default_rng(1), noises=40)
    assert found.nats == pytest.approx(binary_channel(distance), abs=4 * found.standard_error + 1e-3)


def test_a_parameter_that_mimics_the_effect_costs_information() -> None:
    """A small command cannot tell a bend from a gain that is uncertain; with the gain known it could."""
    rng = np.random.default_rng(2)
    gains = 1 + 0.1 * rng.standard_normal((400, 1))
    certain = np.ones((400, 1))
    bend = np.full((400, 1), 0.05)
    u = 0.9 * np.sin(2 * np.pi * 0.5 * T)

    def gain_with(values: FloatArray, command: FloatArray) -> float:
        first = Explanation("none", linear, values)
        second = Explanation("bend", cubic, np.concatenate([values, bend], axis=1))
        return choice_gain(first, second, command, WHITE, 0.05, np.random.default_rng(3)).nats

    assert gain_with(certain, u) > gain_with(gains, u) + 0.1
    assert gain_with(gains, 3 * u) > 0.6


def test_known_beforehand_leaves_little_to_learn() -> None:
    u = np.sin(2 * np.pi * T)
    pair = [Explanation(str(x), linear, np.full((40, 1), x)) for x in (1.0, 2.0)]
    found = choice_gain(*pair, u, WHITE, 0.1, np.random.default_rng(4), prior_of_first=0.99)
    assert found.nats == pytest.approx(-0.99 * np.log(0.99) - 0.01 * np.log(0.01), rel=1e-3)
    assert found.expected_probability_of_truth == pytest.approx(1.0, abs=1e-3)
