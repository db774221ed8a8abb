"""Starts that are tried beside other labels, and trials that threads share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, form, measured, scale, some_effect

from bayes_hw.crew import crew
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search import effect_moves
from bayes_hw.gap.joint.search.effect_moves import KEPT_STARTS, beside_others, effect_candidates, other_forms
from bayes_hw.gap.joint.search.effect_screen import Start
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 400


def _start(label: str, number: int, *gains: float) -> Start:
    return Start(form(label), (float(number),), gains)


def test_beside_other_labels_every_label_keeps_its_first_start_and_the_best_keep_theirs() -> None:
    """The best under either noise: one that only the second shows is kept as well."""
    poor = [_start("command_bias", i, 0.1 / (i + 1), 0.1) for i in range(3)]
    rich = [_start("gain_drift", i, 50.0 - i, 1.0) for i in range(KEPT_STARTS)]
    slow = [_start("gain_asymmetry", 0, 0.5, 3.0), _start("gain_asymmetry", 1, 0.2, 90.0)]
    kept = beside_others([poor, rich, slow])
    assert poor[0] in kept and poor[1] not in kept and poor[2] not in kept
    assert rich[: KEPT_STARTS // 2] == [start for start in kept if start in rich][: KEPT_STARTS // 2]
    assert rich[-1] not in kept
    assert slow[0] in kept and slow[1] in kept


def test_threads_change_no_number() -> None:
    bias, drift = form("command_bias"), form("gain_drift")
    records = measured((Effect(drift, np.array([0.2, 100.0])),), SAMPLES, (1, 2))
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
    found = []
    for threads in (1, 2):
        with crew(threads):
            found.append([(t.names, t.score) for t in effect_candidates(fit, [bias, drift])])
    assert found[0] == found[1]
    assert found[0][0][0] == ("gain_drift",)
    assert found[0][0][1] > fit.score


def test_a_slow_ramp_is_found_where_noise_of_high_order_hides_it() -> None:
    """Begun under that noise, or under noise of the first order, descents end 220 nats below."""
    ramp = form("rate_limit", "")
    slowness = 25 / scale(600).speed
    records = measured((Effect(ramp, np.array([slowness])),), 600, (1, 2))
    response = JointResponse(STRUCTURE, (), records, scale(600))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()
    assert fit.noise_order > 1
    (found,) = effect_candidates(fit, [ramp])
    assert found.score > fit.score + 200
    np.testing.assert_allclose(found.values.effects[0].values, slowness, rtol=0.02)


def test_a_form_that_extends_another_is_offered_to_that_alone() -> None:
    """A second harmonic to its ripple; a friction over a twist to no other law without a name."""
    ripple, drag = (some_effect(form(*name)) for name in (("torque_ripple",), ("other", "drag")))
    assert any(found.further for found, _ in other_forms(ripple, scale(SAMPLES)))
    assert not any(found.further for found, _ in other_forms(drag, scale(SAMPLES)))


@pytest.mark.parametrize(
    ("label", "first", "second"),
    [
        ("encoder_eccentricity", ("sine", "cosine"), ("second_sine", "second_cosine")),
        ("torque_ripple", (), ("second",)),
    ],
)
def test_what_was_found_alone_may_be_either_harmonic(
    label: str, first: tuple[str, ...], second: tuple[str, ...]
) -> None:
    """The shape that is offered with it as the second is the same, of twice the period; none where a period
    of twice the length is not seen often enough."""
    travel = scale(SAMPLES)
    wave = some_effect(form(label))
    own = {slot.name: x for slot, x in zip(wave.form.slots(travel), wave.values, strict=True)}
    own["wavenumber"] = 2 * np.pi * 8 / travel.travel
    wave = replace(wave, values=np.array(list(own.values())))
    begun = [
        (f, dict(zip([s.name for s in f.slots(travel)], x, strict=True)))
        for f, x in other_forms(wave, travel)
        if f.further
    ]
    (same, doubled) = [values for _, values in begun]
    assert {name: same[name] for name in own} == pytest.approx(own)
    assert doubled["wavenumber"] == pytest.approx(own["wavenumber"] / 2)
    assert all(doubled[name] == 0 for name in first)
    assert all(doubled[name] != 0 for name in second)
    long = replace(
        wave, values=np.array(list((own | {"wavenumber": 2 * np.pi * 2 / travel.travel}).values()))
    )
    assert sum(f.further for f, _ in other_forms(long, travel)) == 1


def test_limits_that_vary_with_position_are_held_against_either_form() -> None:
    """A wave much longer than the travel is a slope, and a number that no record tells."""
    for name, other in (("", "slope"), ("slope", "")):
        moving = some_effect(form("saturation_drift", name))
        (found,) = other_forms(moving, scale(SAMPLES))
        assert found[0] is form("saturation_drift", other)


def test_a_play_at_the_output_is_tried_whatever_a_gap_in_the_drive_promises(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Both are a backlash: a screen tells little of one that is far larger than the noise."""
    play, gap = form("backlash", "kinematic"), form("backlash", "dynamic")
    records = measured((Effect(play, np.array([20 * scale(600).sigma])),), 600, (1, 2))
    response = JointResponse(STRUCTURE, (), records, scale(600))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()
    gains = {play: 1.0, gap: 1000.0}
    starts = [Start(law, s, (nats,) * 2) for law, nats in gains.items() for s in law.starts(scale(600))]
    monkeypatch.setattr(effect_moves, "screened", lambda *_: starts)
    found = effect_candidates(fit, [play, gap])
    assert found[0].names == ("backlash (kinematic)",)
    assert found[0].noise_order <= 1
