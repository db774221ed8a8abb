"""Past its time a search around a given model begins nothing."""

from __future__ import annotations

from joint_axis import GIVEN_SAMPLES, measured, model, some_effect

from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_moves import further_modes, later
from bayes_hw.gap.joint.given.given_rivals import instead_of
from bayes_hw.gap.joint.given.given_search import exchanged
from bayes_hw.gap.joint.search.effect_moves import effect_candidates
from bayes_hw.gap.joint.search.laws_of_states import every_law, kicked
from bayes_hw.time_budget import at_most


def test_no_move_begins_anything() -> None:
    law = next(one for one in FORMS if one.label == "friction")
    base = best_base(measured((some_effect(law),), GIVEN_SAMPLES, (1, 2)), model())
    rubbing = base.with_effect(law, law.starts(base.response.scale)[0])
    nats = {"friction": 100.0}
    assert later(base)
    with at_most(0.0):
        assert effect_candidates(base, FORMS) == every_law(base) == later(base) == further_modes(base) == []
        assert instead_of(rubbing, base, nats, {**nats, "backlash": 99.0}, {}) == {}
        assert kicked(rubbing) is rubbing
        twice = rubbing.with_delay(1, 0.5)
        assert exchanged(twice, nats, print) is twice
