"""Akaike's choice on white residuals: right where they are white, and not asked about coloured noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayes_hw.gap.answer.ranking import white_choice


def fitted(labels: tuple[str, ...], rmse: float, parameters: int) -> Any:
    return SimpleNamespace(
        hypothesis=SimpleNamespace(labels=labels, effects=labels),
        rmse=rmse,
        coordinates=np.zeros(parameters),
        readings=500,
        whitener=SimpleNamespace(parameter_count=2),
    )


@pytest.mark.parametrize(("rmse", "answer"), [(0.99, ("friction",)), (0.9985, ())])
def test_an_effect_must_pay_for_its_parameters(rmse: float, answer: tuple[str, ...]) -> None:
    """500 samples, two parameters more: 2 nats of likelihood, that is rmse 0.996 of the base's."""
    base = SimpleNamespace(fit=fitted((), 1.0, 9))
    singles = (fitted(("friction",), rmse, 11),)
    found: Any = SimpleNamespace(base=base, singles=singles, explanations=())
    assert white_choice(found) == answer


def test_a_stochastic_effect_by_its_likelihood() -> None:
    base = SimpleNamespace(fit=fitted((), 1.0, 9))
    white = -0.5 * 500 * (np.log(2 * np.pi) + 1)
    wind = SimpleNamespace(
        stochastic=SimpleNamespace(log_likelihood=white + 20, parameters={"a": 1, "b": 1}),
        fit=fitted((), 1.0, 9),
        labels=("wind",),
    )
    found: Any = SimpleNamespace(base=base, singles=(), explanations=(wind,))
    assert white_choice(found) == ("wind",)
    wind.stochastic.log_likelihood = white + 2
    assert white_choice(found) == ()
