"""A planted effect is found from records alone, and none where there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joint_axis import (
    CASCADE,
    SIGMA,
    STRUCTURE,
    command,
    form,
    measured,
    record,
    response_with,
    scale,
    torque,
)

from bayes_hw.errors import InputError
from bayes_hw.gap.joint.decision.joint_decision import decide_jointly
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.noise.slow_noise import WALK, WIND
from bayes_hw.gap.joint.posterior.joint_posterior import laplace
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search import joint_search, structural
from bayes_hw.gap.joint.search.effect_moves import effect_candidates
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.joint_search import search
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record
from bayes_hw.time_budget import at_most

SAMPLES, LONG = 700, 1500


def at_the_truth(records: Sequence[Record]) -> JointFit:
    """A cascade of the true structure, begun at its true values, without any effect."""
    response = JointResponse(STRUCTURE, (), records, scale(len(records[0])))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is() -> None:
    found = search(measured((), SAMPLES, (1, 2)))
    assert found.fit.labels == ()
    assert found.readings.nats == {}


@pytest.mark.slow
def test_a_walk_is_a_cause_of_the_noise() -> None:
    """Found in the search, kept when it is verified, held against wind; what is left has no colour, and the
    base holds although the angle wanders by many deviations of the noise."""
    rng = np.random.default_rng(8)
    records = [
        replace(r, y=r.y + np.cumsum(0.15 * SIGMA * rng.standard_normal(LONG)))
        for r in measured((), LONG, (1, 2))
    ]
    base = at_the_truth(records)
    found = joint_search._explained(
        base, joint_search.one_more(base), read_faults(base), records, joint_search.silent
    )
    assert set(found.fit.labels) == {WALK} == set(found.nats)
    assert min(found.nats.values()) > 25
    assert found.remainder.order == 1 and found.remainder.coloured == 0
    assert {WALK, WIND} <= set(found.followed)
    assert found.rivals[WALK] >= found.rivals[WIND]
    assert decide_jointly(found).answer == (WALK,)
    drawn = laplace(found.fit, records[0].units, rng).base["saturation.upper"]
    assert abs(np.mean(drawn) - CASCADE.upper) < 2.5 * np.std(drawn)


def test_friction_is_found_without_a_drive_train() -> None:
    """Of every label, at the base that has none."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    base = at_the_truth(measured((rub,), SAMPLES, (1, 2)))
    found = max(effect_candidates(base, FORMS), key=lambda fit: fit.score)
    assert found.labels == ("friction",)
    assert found.score > base.score + 50


def test_out_of_time_the_search_answers_at_once() -> None:
    """With the axis as far as it was begun; it says so, and names nothing."""
    with at_most(0.0):
        found = search(measured((), SAMPLES, (1, 2)))
    assert found.cut_short
    assert found.fit.labels == ()
    assert found.fit.structure.order <= 1


def test_no_records_are_refused() -> None:
    with pytest.raises(InputError, match="no record"):
        diagnose_records([], [], np.random.default_rng(1))


def test_a_rival_that_ended_beside_wind_is_that_of_its_effect() -> None:
    """Else what was followed to its end would count as begun alone, and keep the answer in doubt."""
    fit: Any = SimpleNamespace(effect_labels=("other",), labels=("wind", "other"))
    alone: Any = SimpleNamespace(effect_labels=(), labels=("wind",))
    unused: Any = None
    assert FollowedPath(fit, unused, unused).begun_with == "other"
    assert FollowedPath(alone, unused, unused).begun_with == "wind"


@pytest.mark.parametrize(
    ("effect", "swing"),
    [
        (torque(form("friction", "Coulomb, motor"), (0.01,), 0.1), 1.0),
        (Effect(form("backlash", "kinematic"), np.array([0.01])), 60.0),
    ],
    ids=["friction", "play"],
)
def test_an_effect_may_act_within_the_sample_where_the_noise_is_white(effect: Effect, swing: float) -> None:
    """Steps are not sought there on the way, since the noise asks for nothing, but at the end: a rival whose
    noise was coloured may have had them. The axis turns within samples where it swings enough."""
    coarse, values = response_with((effect,), SAMPLES)
    sections = values.cascade.sections * np.array([[1.0], [1.0], [swing], [swing]])
    values = replace(values, cascade=replace(values.cascade, sections=sections))
    axis = replace(coarse, steps=4)
    records = []
    for seed in (1, 2):
        noise = 0.7 * SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
        records.append(record(axis.simulate(values, command(SAMPLES, seed)).y + noise, seed))
    response = replace(coarse, records=records)
    fit = JointFit(response, evaluate(response, response.coordinates(values))).descended()
    assert fit.noise_order == 0
    assert structural.finer(fit) is fit
    stepped = structural.within_sample(fit)
    assert stepped.response.steps == 4
    assert stepped.score > fit.score + structural.STRUCTURAL_NATS


@pytest.mark.parametrize(
    ("leader", "followed"), [("wind", ["wind", "rate_limit"]), ("friction", ["friction"])]
)
def test_noise_of_a_cause_does_not_crowd_out_the_best_effect(
    leader: str, followed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Noise explains all that is left, one effect of two its part: it is followed though it has a third."""

    def trial(label: str, score: float) -> Any:
        effects = () if label == "wind" else (label,)
        return SimpleNamespace(labels=(label,), effect_labels=effects, score=score)

    plain: Any = SimpleNamespace(labels=(), score=0.0)
    readings: Any = SimpleNamespace(nats={"timing_jitter": 90.0})
    begun = FollowedPath(plain, plain, readings)
    trials = [trial(leader, 96.0), trial("rate_limit", 34.0), trial("gain_drift", 30.0)]
    trials.append(trial("cubic_stiffness", -np.inf))
    monkeypatch.setattr(joint_search, "_settled", lambda *_: trials)
    monkeypatch.setattr(joint_search, "as_seen", lambda one: one)
    monkeypatch.setattr(joint_search, "finer", lambda one: one)
    monkeypatch.setattr(joint_search, "corrected", lambda one, _: one)
    contenders, alone = joint_search._contenders(begun, trials, joint_search.silent)
    assert [path.begun_with for path in contenders] == followed
    assert set(alone) == {leader, "rate_limit", "gain_drift"}, "one that runs away is no rival"


@pytest.mark.parametrize("shown", [True, False])
def test_what_an_observer_hides_begins_a_path_of_its_own(
    shown: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An effect that the simulation shows beside one that an observer follows, no cause of its noise; none
    where it shows nothing, and none is sought beside a label without an observer."""

    def fit(score: float, *labels: str, added: tuple[str, ...] = ()) -> Any:
        return SimpleNamespace(labels=labels, effect_labels=labels, added=added, score=score)

    plain, readings = fit(0.0), SimpleNamespace(nats={"timing_jitter": 90.0})
    begun: Any = FollowedPath(plain, plain, readings)  # type: ignore[arg-type]
    ripple, observed, both = (
        fit(180.0, "torque_ripple"),
        fit(330.0, "torque_ripple"),
        fit(280.0, "torque_ripple", "gain_drift"),
    )
    friction, windy = fit(300.0, "friction"), fit(290.0, "torque_ripple", added=("wind",))
    sought: list[Any] = []

    def one_more(path: FollowedPath, _: object) -> list[Any]:
        sought.append(path.fit)
        return [windy, both] if shown else [windy]

    monkeypatch.setattr(joint_search, "_settled", lambda *_: [ripple, friction])
    monkeypatch.setattr(joint_search, "_with_one_more", one_more)
    monkeypatch.setattr(joint_search, "as_seen", lambda one: one)
    monkeypatch.setattr(joint_search, "finer", lambda one: one)
    monkeypatch.setattr(joint_search, "corrected", lambda one, _: observed if one is ripple else one)
    contenders, _ = joint_search._contenders(begun, [], joint_search.silent)
    followed: list[Any] = [path.fit for path in contenders]
    assert followed == ([observed, friction, both] if shown else [observed, friction])
    assert sought == [ripple]
    assert not any(path.settled for path in contenders if path.fit is both or path.fit is observed)
