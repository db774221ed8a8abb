"""The figure that convinces: a function found without the law follows it where the effect is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, form, measured, response_with, scale, some_effect, torque

from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.answer.effect_view import VIEWS, effect_view
from bayes_hw.gap.joint.answer.free_function import EffectView, Seen
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.report.page.drawing import LABEL_LENGTH

SAMPLES = 1200
NOTHING = Readings((), {}, None, {})


def seen(effects: tuple[Effect, ...]) -> Seen:
    """The truth as a fit, on two records of it."""
    records = measured(effects, SAMPLES, (1, 2))
    plain, values = response_with(effects, SAMPLES)
    response = JointResponse(plain.structure, effects, records, plain.scale)
    point = evaluate(response, response.coordinates(JointValues(values.cascade, effects)))
    return Seen(JointFit(response, point), NOTHING)


def with_unmeasured(found: Seen, every: int) -> Seen:
    """The same fit, on records of which only every so many-th half second was measured."""
    records = []
    for record in found.records:
        second = np.arange(len(record)) // 10
        records.append(replace(record, measured=second % every == 0))
    response = replace(found.fit.response, records=records)
    point = evaluate(response, found.fit.point.coordinates, found.fit.point.whitener)
    return Seen(JointFit(response, point), NOTHING)


def whole(view: EffectView) -> bool:
    arrays = (view.x, view.y, view.half, view.line_x, view.line_y)
    return all(len(a) and np.isfinite(a).all() for a in arrays) and len(view.x) == len(view.y)


@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_every_form_has_a_view_whose_words_are_whole(law: Form) -> None:
    view = effect_view(seen((some_effect(law),)), law.label)
    assert whole(view) and view.reading.endswith(".")
    assert 0 < len(view.quantity) <= LABEL_LENGTH and 0 < len(view.over) <= LABEL_LENGTH


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


@pytest.mark.compiles("cascades")
def test_what_was_not_measured_does_not_speak_for_the_law() -> None:
    """A fit whose law is twice too large: the points tell so from a quarter of the samples as from all, with
    intervals twice as wide."""
    law = form("encoder_eccentricity")
    true, fitted = (Effect(law, np.array([size, 0.0, 8.0])) for size in (0.01, 0.02))
    records = measured((true,), SAMPLES, (1, 2))
    plain, values = response_with((fitted,), SAMPLES)
    response = JointResponse(plain.structure, (fitted,), records, plain.scale)
    white = Whitener.of_partial(np.zeros(0))
    point = evaluate(response, response.coordinates(JointValues(values.cascade, (fitted,))), white)
    every = Seen(JointFit(response, point), NOTHING)
    halves = []
    for found in (every, with_unmeasured(every, 4)):
        view = effect_view(found, law.label)
        at_points = np.interp(view.x, view.line_x, view.line_y)
        assert float(at_points @ view.y / (at_points @ at_points)) == pytest.approx(0.5, abs=0.1)
        halves.append(float(np.median(view.half)))
    assert 1.5 < halves[1] / halves[0] < 3


@pytest.mark.parametrize("label", ["wind", "timing_jitter", "outliers", "encoder_quantization", "unnamed"])
def test_views_of_errors_are_of_what_was_measured(label: str) -> None:
    """With readings of nonsense where nothing was measured they are whole and the same."""
    found = with_unmeasured(seen(()), 2)
    view = effect_view(found, label)
    assert whole(view) or label == "outliers"
    for record in found.records:
        assert np.isfinite(record.y).all()
    assert np.isfinite(view.y).all() and np.isfinite(view.half).all()


def test_readings_in_a_turn_are_shown_by_their_number() -> None:
    """Every third is four times as bad: two points lie on the line, one at four times its level."""
    found = seen(())
    rng = np.random.default_rng(4)
    worse = [
        replace(r, y=r.y + np.where(np.arange(len(r)) % 3 == 1, 4 * SIGMA, 0.0) * rng.standard_normal(len(r)))
        for r in found.records
    ]
    response = replace(found.fit.response, records=worse)
    fit = JointFit(response, evaluate(response, found.fit.point.coordinates))
    view = effect_view(Seen(fit, replace(NOTHING, parameters={"other.every": 3.0})), "other")
    assert whole(view) and len(view.over) <= LABEL_LENGTH
    np.testing.assert_array_equal(view.x, [0, 1, 2])
    np.testing.assert_allclose(view.y, SIGMA * np.array([1, np.hypot(1, 4), 1]), rtol=0.1)
    assert view.line_y == pytest.approx(view.y[[0, 2]].min())
    assert effect_view(Seen(fit, NOTHING), "other").quantity == "error"
    holes = with_unmeasured(Seen(fit, NOTHING), 2)
    half = effect_view(replace(holes, readings=replace(NOTHING, parameters={"other.every": 3.0})), "other")
    np.testing.assert_allclose(half.y, view.y, rtol=0.1)
