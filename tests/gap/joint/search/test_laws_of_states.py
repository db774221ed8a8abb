"""Laws begun over the states of G: a descent that ends short of the least is kicked on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, form, measured, model, torque

from bayes_hw.gap.joint.forms.drive_forms import DRIVE_FORMS
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.search import laws_of_states
from bayes_hw.gap.joint.search.laws_of_states import every_law, kicked

FEW = 400


def test_a_law_that_a_descent_ends_short_of_iskicked_to_it() -> None:
    """A drive that gives no more than a demand, begun at a thirtieth of it."""
    law = DRIVE_FORMS[0]
    limit = torque(law, (0.1,), 0.012, seen=0.5)
    base = best_base(measured((limit,), FEW, (1, 2)), model())
    begun = base.with_effect(law, (0.003,)).with_signal(0)
    alone = begun.descended_under(0, 40)
    assert alone.point.rms > 2 * SIGMA
    assert kicked(alone).point.rms == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.parametrize("weight", [0.0, 0.012])
def test_which_start_leaves_the_least_is_asked_where_a_law_explains_some(
    weight: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here by a law that stands in for one that is not tried; beside a walk that none explains it is not."""
    planted = (torque(DRIVE_FORMS[0], (0.1,), weight, seen=0.5),) if weight else ()
    records = measured(planted, FEW, (1, 2))
    walk = [
        2 * SIGMA * np.cumsum(np.random.default_rng(i).standard_normal(len(r))) for i, r in enumerate(records)
    ]
    if not weight:
        records = [replace(r, y=r.y + e) for r, e in zip(records, walk, strict=True)]
    base = best_base(records, model())
    assert base.noise_order > 1
    asked: list[int] = []
    monkeypatch.setattr(laws_of_states, "_closest", lambda starts: asked.append(len(starts)) or [])
    monkeypatch.setattr(laws_of_states, "FULL_STEPS", 2)
    every_law(base, [form("friction", "Coulomb, motor")])
    assert bool(asked) == bool(weight)
    assert every_law(base, [form("command_bias")]) == []
