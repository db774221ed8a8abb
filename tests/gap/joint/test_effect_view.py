"""The figure that convinces: a function found without the law follows it where the effect is there."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import form, measured, response_with, scale, some_effect, torque

from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS
from bayes_hw.gap.joint.effect_form import FORMS, Form
from bayes_hw.gap.joint.effect_view import VIEWS, effect_view
from bayes_hw.gap.joint.free_function import EffectView, Seen
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.joint_response import Effect, JointResponse, JointValues
from bayes_hw.gap.joint.readings import Readings
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 1200
NOTHING = Readings((), {}, None, {})


def seen(effects: tuple[Effect, ...]) -> Seen:
    """The truth as a fit, on two records of it."""
    records = measured(effects, SAMPLES, (1, 2))
    plain, values = response_with(effects, SAMPLES)
    response = JointResponse(plain.structure, effects, records, plain.scale)
    point = evaluate(response, response.coordinates(JointValues(values.cascade, effects)))
    return Seen(JointFit(response, point), NOTHING)


def whole(view: EffectView) -> bool:
    arrays = (view.x, view.y, view.half, view.line_x, view.line_y)
    return all(len(a) and np.isfinite(a).all() for a in arrays) and len(view.x) == len(view.y)


@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_every_form_has_a_view_whose_words_are_whole(law: Form) -> None:
    view = effect_view(seen((some_effect(law),)), law.label)
    assert whole(view) and view.quantity and view.over and view.reading.endswith(".")


def test_every_label_has_a_method_but_those_that_are_part_of_g() -> None:
    assert set(LABEL_BLOCKS) - set(VIEWS) == {"transport_delay", "unmodelled_mode"}


COULOMB = form("friction", "Coulomb, load")
SHOWN = {
    "force over speed": torque(COULOMB, COULOMB.starts(scale(SAMPLES))[0], 1e-3),
    "error over position": some_effect(form("encoder_eccentricity")),
    "command over command": some_effect(form("other", "curve of the command")),
    "unnamed error over position": some_effect(form("other", "reading over position")),
    "error over time": some_effect(form("sensor_drift", "ramp")),
}


@pytest.mark.parametrize("effect", SHOWN.values(), ids=SHOWN)
def test_points_follow_the_law_within_their_intervals(effect: Effect) -> None:
    """Most of them, and far from zero somewhere: the effect is seen, not assumed."""
    view = effect_view(seen((effect,)), effect.form.label)
    at_points = np.interp(view.x, view.line_x, view.line_y)
    inner = slice(1, -1)
    off = np.abs(view.y - at_points)[inner] / np.maximum(view.half[inner], 0.05 * np.ptp(view.line_y))
    assert np.mean(off < 1.5) > 0.7
    assert np.max(np.abs(view.y) / np.maximum(view.half, 1e-12)) > 3


def test_an_effect_that_is_not_there_lies_at_zero() -> None:
    """The law of a strength of nearly nothing: intervals hold zero at most points."""
    law = form("encoder_eccentricity")
    effect = Effect(law, np.array([1e-9, 1e-9, 8.0]))
    view = effect_view(seen((effect,)), law.label)
    assert np.mean(np.abs(view.y) < 1.3 * view.half) > 0.8
