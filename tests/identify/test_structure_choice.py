"""A resonance is taken for less evidence than other poles, and for more than noise gives."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayes_hw.identify.structure_choice import choice_criterion, chosen, ringing_pairs

SAMPLES = 7200
LIGHT, STRONG, REAL = (1.6, 0.95), (1.3, 0.7), (1.8, 0.8)
"""Denominators: a pair of damping 0.04, one of 0.26, two real poles."""


def fit(log_likelihood: float, parameters: int, *denominators: tuple[float, float]) -> Any:
    sections = np.zeros((4, len(denominators)))
    sections[:2] = np.array(denominators).reshape(-1, 2).T
    return SimpleNamespace(
        values=SimpleNamespace(sections=sections),
        point=SimpleNamespace(samples=SAMPLES),
        criterion=-2 * log_likelihood + parameters * np.log(SAMPLES),
    )


def test_only_ringing_pairs_count() -> None:
    assert ringing_pairs(fit(0.0, 12, LIGHT, STRONG, REAL)) == 1
    assert ringing_pairs(fit(0.0, 0)) == 0


@pytest.mark.parametrize(("nats", "taken"), [(11.0, False), (13.0, True)])
def test_a_resonance_costs_its_parameters_and_the_places_it_was_looked_for(nats: float, taken: bool) -> None:
    """4 + log(3600) = 12.2 nats, where Schwarz's criterion asks 17.8."""
    without, with_it = fit(100.0, 5), fit(100.0 + nats, 9, LIGHT)
    assert (chosen([without, with_it]) is with_it) == taken
    assert with_it.criterion > without.criterion


def test_other_poles_cost_what_schwarz_asks() -> None:
    without = fit(100.0, 5)
    for denominator in (STRONG, REAL):
        larger = fit(113.0, 9, denominator)
        assert chosen([without, larger]) is without
        assert choice_criterion(larger) == pytest.approx(larger.criterion)
