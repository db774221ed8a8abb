"""Laws around a given model: a descent that ends short of the least is kicked on."""

from __future__ import annotations

import pytest
from joint_axis import SIGMA, measured, model, torque

from bayes_hw.gap.joint.forms.drive_forms import DRIVE_FORMS
from bayes_hw.gap.joint.given.given_laws import kicked
from bayes_hw.gap.joint.given.given_moves import as_given
from bayes_hw.gap.joint.given.given_search import best_base

FEW = 400


def test_a_law_that_a_descent_ends_short_of_iskicked_to_it() -> None:
    """A drive that gives no more than a demand, begun at a thirtieth of it."""
    law = DRIVE_FORMS[0]
    limit = torque(law, (0.1,), 0.012, seen=0.5)
    base = best_base(measured((limit,), FEW, (1, 2)), model())
    begun = base.with_effect(law, (0.003,)).with_signal(0)
    alone = as_given(begun.descended_under(0, 40))
    assert alone.point.rms > 2 * SIGMA
    assert kicked(alone).point.rms == pytest.approx(SIGMA, rel=0.1)
