"""A shape that is too wide to be a period is said to be one; a drag is not."""

from __future__ import annotations

from joint_axis import GIVEN_SAMPLES, measured, model

from bayes_hw.gap.joint.answer.joint_notes import of_unnamed
from bayes_hw.gap.joint.forms.joint_forms import AS_SHAPE, FORMS
from bayes_hw.gap.joint.given.given_base import best_base


def test_a_wide_shape_over_position_is_told_apart_from_a_period() -> None:
    base = best_base(measured((), GIVEN_SAMPLES, (1, 2)), model())
    scale = base.response.scale
    said = {}
    for form in (f for f in FORMS if f.name in ("reading over position", "drag", "torque over position")):
        (note,) = of_unnamed(base.with_effect(form, form.starts(scale)[0]))
        said[form.name] = note
    assert all("fewer than 1.5 times" in said[f"{one} over position"] for one in ("reading", "torque"))
    assert "times" not in said["drag"]
    for form in AS_SHAPE.values():
        (note,) = of_unnamed(base.with_effect(form, form.starts(scale)[0]))
        assert "fewer than 1.5 times" in note
    assert of_unnamed(base) == []
    ripple = next(f for f in FORMS if f.label == "torque_ripple")
    assert of_unnamed(base.with_effect(ripple, ripple.starts(scale)[0])) == []
