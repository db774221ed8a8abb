"""Poles are taken for as much evidence as noise would give at the best of the places looked at."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayes_hw.identify.growth.score_test import candidate_pairs, candidate_poles
from bayes_hw.identify.growth.sensitivity_kernel import filtered_pair, filtered_pole
from bayes_hw.identify.structure_choice import choice_criterion, chosen, pole_pairs

SAMPLES = 7200
LIGHT, STRONG, REAL = (1.6, 0.95), (1.3, 0.7), (1.8, 0.8)
"""Denominators: a pair of damping 0.04, one of 0.26, two real poles."""


def fit(log_likelihood: float, parameters: int, *denominators: tuple[float, float]) -> Any:
    sections = np.zeros((4, len(denominators)))
    sections[:2] = np.array(denominators).reshape(-1, 2).T
    return SimpleNamespace(
        structure=SimpleNamespace(order=1 + 2 * len(denominators), integrator=True),
        values=SimpleNamespace(sections=sections),
        point=SimpleNamespace(samples=SAMPLES),
        criterion=-2 * log_likelihood + parameters * np.log(SAMPLES),
    )


def test_pairs_are_told_from_real_poles() -> None:
    assert pole_pairs(fit(0.0, 12, LIGHT, STRONG, REAL)) == 2
    assert pole_pairs(fit(0.0, 0)) == 0


@pytest.mark.parametrize("pair", [LIGHT, STRONG])
@pytest.mark.parametrize(("nats", "taken"), [(11.0, False), (13.0, True)])
def test_a_pair_costs_its_parameters_and_the_places_it_was_looked_for(
    pair: tuple[float, float], nats: float, taken: bool
) -> None:
    """4 + log(3600) = 12.2 nats whatever its damping, where Schwarz's criterion asks 17.8."""
    without, with_it = fit(100.0, 5), fit(100.0 + nats, 9, pair)
    assert (chosen([without, with_it]) is with_it) == taken
    assert with_it.criterion > without.criterion


@pytest.mark.parametrize(("nats", "taken"), [(9.0, False), (10.5, True)])
def test_real_poles_cost_less_than_pairs(nats: float, taken: bool) -> None:
    """Two: 2 (2 + log 17) = 9.7 nats, where Schwarz's criterion asks 17.8."""
    without, with_them = fit(100.0, 5), fit(100.0 + nats, 9, REAL)
    assert (chosen([without, with_them]) is with_them) == taken
    assert choice_criterion(without) == pytest.approx(without.criterion)


@pytest.mark.parametrize("pole_or_pair", [1, 2])
def test_noise_alone_seldom_pays_for_a_pole(pole_or_pair: int) -> None:
    """Of white residuals the best of all candidate columns gains its charge in few of many draws."""
    rng, samples, draws = np.random.default_rng(5), 2000, 60
    v = np.repeat(rng.uniform(-1, 1, samples // 20), 20)
    e = rng.standard_normal((draws, samples))
    if pole_or_pair == 1:
        columns = np.empty((len(candidate_poles()), 1, samples))
        for pole, out in zip(candidate_poles(), columns, strict=True):
            filtered_pole(v, pole, out[0])
        charge = 2 + np.log(len(columns))
    else:
        columns = np.empty((len(candidate_pairs()), 2, samples))
        for pair, out in zip(candidate_pairs(), columns, strict=True):
            filtered_pair(v, *pair, out[0], out[1])
        charge = 4 + np.log(samples / 2)
    best = np.zeros(draws)
    for group in columns:
        basis = np.linalg.qr(group.T)[0]
        best = np.maximum(best, 0.5 * np.sum((e @ basis) ** 2, axis=1))
    assert np.mean(best > charge) < 0.1


def test_beside_a_misfit_real_poles_cost_what_schwarz_asks() -> None:
    without = fit(100.0, 5)
    real, pair = fit(113.0, 9, REAL), fit(113.0, 9, LIGHT)
    assert chosen([without, real], misfit=True) is without and chosen([without, real]) is real
    assert chosen([without, pair], misfit=True) is pair
