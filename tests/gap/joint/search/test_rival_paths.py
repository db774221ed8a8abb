"""What the best explanation found of G, the label of another one begins with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, form, measured, scale, torque

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.other_cascades import with_pole
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search import rival_paths, sight
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.joint_search import silent
from bayes_hw.gap.joint.search.rival_paths import (
    MOST_EXCHANGES,
    begun_anew,
    best_of_each_label,
    each_alone,
    plainly_named,
    with_exchanged_laws,
    with_labels_exchanged,
    with_those_followed,
)
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

SAMPLES = 700
RUB = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012, seen=0.0)
GAP = torque(form("backlash", "dynamic"), (1e-3,), 1e-6, seen=1e-3)
ELSEWHERE = replace(CASCADE, integrator_residue=0.8 * CASCADE.integrator_residue)


def _path(records: list[Record], cascade: CascadeValues, *effects: Effect) -> FollowedPath:
    """An explanation of the records, not descended, beside the true G without any effect."""
    fits = []
    for values in (JointValues(cascade, effects), JointValues(CASCADE)):
        response = JointResponse(STRUCTURE, values.effects, records, scale(SAMPLES))
        fits.append(JointFit(response, evaluate(response, response.coordinates(values))))
    return FollowedPath(*fits, read_faults(fits[1]))


def test_a_label_begins_anew_over_the_g_of_the_best() -> None:
    """Friction made the records, and its path is over the true G; a gap began elsewhere."""
    records = measured((RUB,), SAMPLES, (1,))
    rub, stuck = _path(records, CASCADE, RUB), _path(records, ELSEWHERE, GAP)
    over_the_true_g = _path(records, CASCADE, GAP)
    same, moved = begun_anew([rub, stuck], silent)
    assert same is rub
    assert moved.begun_with == "backlash"
    assert stuck.gained < over_the_true_g.gained < moved.gained < rub.gained
    assert begun_anew([rub, moved], silent)[1].gained == pytest.approx(moved.gained, abs=1)


def test_over_a_g_that_leaves_colour_nothing_begins() -> None:
    records = measured((RUB,), SAMPLES, (1,))
    gap, stuck = _path(records, CASCADE, GAP), _path(records, ELSEWHERE, GAP)
    assert gap.fit.noise_order > 1
    assert begun_anew([gap, stuck], silent) == [gap, stuck]


def test_beside_another_effect_the_one_that_begins_anew_leads() -> None:
    """So that the path stays that of its label; the records are told the same."""
    records = measured((RUB,), SAMPLES, (1,))
    path = _path(records, CASCADE, replace(GAP, ports=RUB.ports), RUB)
    led = path.fit.led_by("friction")
    assert path.begun_with == "backlash"
    assert replace(path, fit=led).begun_with == "friction"
    assert led.labels == ("friction", "backlash")
    assert led.log_likelihood == pytest.approx(path.fit.log_likelihood, abs=1e-6)


def test_a_label_that_needs_none_beside_it_is_found_alone() -> None:
    """Coulomb friction made the records; a gap beside it makes up for where its descent stands."""
    records = measured((RUB,), SAMPLES, (1, 2))
    pair = _path(records, CASCADE, RUB, replace(GAP, values=np.array([1e-3])))
    pair = replace(pair, fit=pair.fit.descended_under(0, 6))
    assert pair.fit.effect_labels == ("friction", "backlash")
    (friction,) = each_alone(pair, silent)
    assert friction.names == ("friction (Coulomb, motor)",)
    assert friction.score > pair.fit.score
    assert each_alone(replace(pair, fit=friction), silent) == []


def test_a_label_in_whose_place_another_is_better_is_exchanged() -> None:
    """A gain that drifts and limits that move made the records; instead of the limits the explanation has a
    drift of the sensor."""
    warm = Effect(form("gain_drift"), np.array([0.3, 100.0]))
    moved = Effect(form("saturation_drift"), np.array([0.1, 0.05, 4.0, 0.5]))
    ramp = Effect(form("sensor_drift", "ramp"), np.array([1e-5]))
    records = measured((warm, moved), SAMPLES, (1, 2))
    wrong = _path(records, CASCADE, warm, ramp)
    right = _path(records, CASCADE, warm, moved)
    found, leads = with_labels_exchanged(wrong, silent)
    assert set(found.fit.effect_labels) == {"gain_drift", "saturation_drift"}
    assert found.gained > right.gained - 5.0 > wrong.gained
    assert min(leads["saturation_drift"].values()) > 25.0
    same, _ = with_labels_exchanged(found, silent)
    assert same is found


def test_one_label_alone_has_no_stand_ins() -> None:
    warm = Effect(form("gain_drift"), np.array([0.3, 100.0]))
    path = _path(measured((warm,), SAMPLES, (1,)), CASCADE, warm)
    assert with_labels_exchanged(path, silent) == (path, {})


def test_explanations_that_share_a_further_label_stand_in_place_of_each_other() -> None:
    """A gap and a friction, either beside a bias, are rivals; a friction beside a gap is none of either."""
    records = measured((RUB,), SAMPLES, (1,))
    bias = Effect(form("command_bias", ""), np.array([0.01]))
    gap, rub = replace(GAP, ports=RUB.ports), RUB
    both = _path(records, CASCADE, gap, rub)
    one, other = _path(records, CASCADE, gap, bias), _path(records, CASCADE, rub, bias)
    assert one.is_without(other) and other.is_without(one)
    assert not both.is_without(one) and not both.is_without(other) and not other.is_without(both)


def test_what_was_followed_beside_the_same_label_stands_in_for_the_other_one() -> None:
    """With the lead at its end, unless one begun in its place is nearer; alone it stands for none."""
    records = measured((RUB,), SAMPLES, (1,))
    bias = Effect(form("command_bias", ""), np.array([0.01]))
    led, other = _path(records, CASCADE, bias, RUB), _path(records, CASCADE, GAP, bias)
    lead = led.gained - other.gained
    assert lead > 0
    paths = [led, other, _path(records, CASCADE, GAP)]
    assert with_those_followed(led, paths, {}) == {"friction": {"backlash": lead}}
    begun = {"command_bias": {"wind": 90.0}, "friction": {"backlash": lead - 1}}
    assert with_those_followed(led, paths, begun) == begun
    assert with_those_followed(_path(records, CASCADE, RUB), paths, {}) == {}


def test_of_every_label_the_path_that_gains_most_stays_and_what_explains_nothing_goes() -> None:
    records = measured((RUB,), SAMPLES, (1,))
    rub, gap, bare = _path(records, CASCADE, RUB), _path(records, CASCADE, GAP), _path(records, CASCADE)
    stuck = _path(records, ELSEWHERE, GAP)
    assert stuck.gained < gap.gained
    assert best_of_each_label([stuck, bare, rub, gap]) == [gap, rub]


def test_a_law_that_is_exchanged_keeps_no_pole_that_its_own_does_not_need(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It begins over the G that stood in for it, which has more poles than the one beside its rival."""
    records = measured((RUB,), SAMPLES, (1,))
    rub, gap = _path(records, CASCADE, RUB), _path(records, CASCADE, GAP)
    monkeypatch.setattr(rival_paths, "exchanged", lambda _: [])
    monkeypatch.setattr(rival_paths, "begun_in_its_place", lambda *_: [with_pole(rub.fit, 0.5)])
    found = with_exchanged_laws([gap], [], silent)[-1]
    assert found.begun_with == "friction"
    assert found.fit.structure.order == rub.fit.structure.order
    assert found.gained >= rub.gained


def test_a_law_that_leads_by_an_exchange_is_exchanged_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    """What its G leaves, another one takes; none is exchanged more than twice."""
    records = measured((RUB,), SAMPLES, (1,))
    stuck, rub = _path(records, ELSEWHERE, GAP), _path(records, CASCADE, RUB)
    near = _path(records, replace(CASCADE, upper=1.01 * CASCADE.upper), RUB)
    assert stuck.gained < near.gained < rub.gained
    asked: list[JointFit] = []

    def exchanged(fit: JointFit) -> list[JointFit]:
        asked.append(fit)
        return [near.fit] if fit is stuck.fit else [rub.fit]

    monkeypatch.setattr(rival_paths, "exchanged", exchanged)
    monkeypatch.setattr(rival_paths, "begun_in_its_place", lambda *_: [])
    monkeypatch.setattr(rival_paths, "pruned", lambda fit: fit)
    found = with_exchanged_laws([stuck], [], silent)
    assert found[-1].begun_with == "friction" and found[-1].gained == rub.gained
    assert len(asked) == MOST_EXCHANGES


def test_friction_under_another_name_is_no_path_beside_friction(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless it leads friction's own law by far; where there is no friction it stays."""
    records = measured((GAP,), SAMPLES, (1,))
    rub, gap = _path(records, CASCADE, RUB), _path(records, CASCADE, GAP)
    lead = gap.gained - rub.gained
    assert lead > 0
    monkeypatch.setattr(sight, "is_hidden_friction", lambda fit: fit is not rub.fit)
    monkeypatch.setattr(sight, "LAW_LEAD", lead + 1)
    assert plainly_named([gap, rub]) == [rub]
    assert plainly_named([gap]) == [gap]
    monkeypatch.setattr(sight, "LAW_LEAD", lead - 1)
    assert plainly_named([gap, rub]) == [gap, rub]
