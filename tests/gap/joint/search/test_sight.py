"""A law over a twist is contact where it takes away what the drive passes on, hysteresis where it adds, a
drag over one a spring; a friction that accelerates nothing is lost motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import command, form, response_with, scale, some_effect, torque

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.drive_forms import OF_DEMAND
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import TURNS_SEEN
from bayes_hw.gap.joint.response.effect_paths import through_port
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search import sight
from bayes_hw.gap.joint.search.sight import (
    accelerates,
    is_hidden_friction,
    named_by_sight,
    sees_twist,
    takes_away,
    turns_seen,
)
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

HYSTERESIS = form("other", "hysteresis of the spring")


def fit_with(effect: Effect) -> JointFit:
    response, values = response_with((effect,), 400)
    return JointFit(response, evaluate(response, response.coordinates(values)))


def turned(effect: Effect) -> Effect:
    """With its torque the other way."""
    assert effect.ports is not None
    ports = effect.ports
    direct = ports.direct * np.array([-1.0, 1.0])
    return replace(effect, ports=replace(ports, real=-ports.real, sections=-ports.sections, direct=direct))


def test_what_a_torque_moves_is_what_is_lacking_without_it() -> None:
    fit = fit_with(some_effect(HYSTERESIS))
    run = fit.response.along(fit.values, 0)
    without = fit.without("other")
    lacking = run.w - without.response.along(without.values, 0).w
    (moved,) = through_port(fit.values, fit.values.effects[0], run.torques)
    np.testing.assert_allclose(moved, lacking, atol=1e-9 * np.abs(run.w).max())
    assert np.abs(moved).max() > 0


@pytest.mark.parametrize("turn", [False, True])
def test_the_name_follows_what_it_does_to_the_spring(turn: bool) -> None:
    """As planted, and with the torque turned round: one of the two is contact in a gap, the other is not."""
    effect = some_effect(HYSTERESIS)
    fit, other = fit_with(turned(effect) if turn else effect), fit_with(effect if turn else turned(effect))
    assert takes_away(fit, 0) != takes_away(other, 0)
    (label,) = named_by_sight(fit).labels
    assert label == ("backlash" if takes_away(fit, 0) else "other")
    assert named_by_sight(fit).score == pytest.approx(fit.score)


@pytest.mark.parametrize("demand", OF_DEMAND, ids=lambda one: one.name)
@pytest.mark.parametrize("swing", [0.0, 1000.0], ids=["the speed", "what swings"])
def test_a_law_of_the_demand_that_looks_at_the_speed_is_friction(swing: float, demand: Form) -> None:
    """Under a command of long steps, which the axis follows; one that also looks at what swings is not."""
    effect = torque(demand, (0.01,), 1e-6)
    assert effect.ports is not None
    seen = np.array([[0.5 * swing], [swing]])
    effect = replace(effect, ports=replace(effect.ports, signal_sections=seen, signal=swing > 0))
    response, values = response_with((effect,), 1600)
    steps = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 10), 160)
    slow = replace(response.records[0], u=steps, y=response.simulate(values, steps).y)
    response = replace(response, records=[slow])
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    assert is_hidden_friction(fit) == (swing == 0.0)


@pytest.mark.parametrize(
    ("gained", "by_friction", "stands"),
    [(200.0, 190.0, True), (200.0, 170.0, False), (1013.0, 997.0, True), (1013.0, 900.0, False)],
)
def test_what_friction_explains_nearly_as_well_is_friction(
    gained: float, by_friction: float, stands: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within fifteen nats, or as near as forms are exact; and never what looks at something else."""
    fit = fit_with(some_effect(HYSTERESIS))
    monkeypatch.setattr(sight, "is_hidden_friction", lambda _: True)
    assert sight.stands_for_friction(fit, gained, by_friction) == stands
    monkeypatch.setattr(sight, "is_hidden_friction", lambda _: False)
    assert not sight.stands_for_friction(fit, gained, by_friction)
    for shares, rubs in (((0.16, 0.003), True), ((0.004, 0.25), False), ((0.069, 0.006), False)):
        monkeypatch.setattr(sight, "shares_of_motion", lambda *_, shares=shares: shares)
        assert sight.stands_for_friction(fit, gained, by_friction, fit) == (stands and rubs)


def test_what_looks_at_one_motion_looks_alike() -> None:
    """Whatever its size and its port; what looks at the speed does not look at a twist, nor at nothing."""
    rub = form("friction", "Coulomb, motor")
    fit = fit_with(torque(rub, (0.02,), 0.012))
    assert sight.looks_alike(fit, fit_with(torque(rub, (0.05,), 0.01)))
    assert not sight.looks_alike(fit, fit_with(some_effect(HYSTERESIS)))
    assert not sight.looks_alike(fit, fit.without("friction"))


@pytest.mark.parametrize(
    ("speed", "acceleration", "twist"),
    [(0.04, 0.92, True), (0.19, 0.73, True), (0.17, 0.13, True), (0.24, 0.05, False), (0.03, 0.05, False)],
)
def test_a_twist_follows_the_acceleration(
    speed: float, acceleration: float, twist: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More than half as much as the speed, and not by chance: shares of gaps and of frictions."""
    effect = some_effect(form("friction", "Coulomb, load"))
    assert effect.ports is not None
    fit = fit_with(replace(effect, ports=replace(effect.ports, signal=True)))
    monkeypatch.setattr(sight, "shares_of_motion", lambda *_: (speed, acceleration))
    assert sees_twist(fit, 0) == twist


@pytest.mark.parametrize(("twist", "label"), [(True, "cubic_stiffness"), (False, "other")])
def test_a_drag_that_looks_at_a_twist_is_a_spring(
    twist: bool, label: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It drags nothing that moves: its torque grows with the twist, beyond a spring's own, and stays so."""
    effect = some_effect(form("other", "drag"))
    assert effect.ports is not None
    fit = fit_with(replace(effect, ports=replace(effect.ports, signal=True)))
    monkeypatch.setattr(sight, "shares_of_motion", lambda *_: (0.1, 0.6) if twist else (0.6, 0.1))
    named = named_by_sight(fit)
    assert named.labels == (label,)
    assert named.score == pytest.approx(fit.score)


def rubbing_through(direct: tuple[float, float], weight: float = 0.0, fast: bool = False) -> JointFit:
    """Friction of the load through its direct path and, with a weight, through the first section of G; with a
    section more, whose poles settle within a sample, through that one."""
    effect = torque(form("friction", "Coulomb, load"), (1e-4,), weight, 0.0)
    assert effect.ports is not None
    ports = replace(effect.ports, direct=np.array(direct), signal=False)
    response, values = response_with((), 400)
    structure, cascade = response.structure, values.cascade
    if fast:
        structure = replace(structure, sections=2)
        more = np.array([[-0.94], [-0.06], [0.0], [0.0]])
        cascade = replace(cascade, sections=np.concatenate([cascade.sections, more], axis=1))
        own = np.concatenate([ports.sections, [[0.02], [0.0]]], axis=1)
        ports = replace(ports, sections=own, signal_sections=np.zeros((2, 2)))
    effects = (replace(effect, ports=ports),)
    response = replace(response, structure=structure, template=effects)
    return JointFit(response, evaluate(response, response.coordinates(JointValues(cascade, effects))))


@pytest.mark.parametrize(
    ("fit", "label"),
    [
        (rubbing_through((0.02, 0.0)), "backlash"),
        (rubbing_through((0.02, -0.4)), "backlash"),
        (rubbing_through((0.0, 0.0), fast=True), "backlash"),
        (rubbing_through((0.0, 0.0), 2e-4), "friction"),
        (rubbing_through((2e-4, 0.4), 2e-4), "friction"),
    ],
    ids=["at once", "within two samples", "through fast poles", "through G", "both"],
)
def test_what_accelerates_nothing_is_lost_motion(fit: JointFit, label: str) -> None:
    assert accelerates(fit, 0) == (label == "friction")
    named = named_by_sight(fit)
    assert named.labels == (label,)
    assert named.score == pytest.approx(fit.score)


def test_a_friction_that_accelerates_nothing_does_what_a_play_does() -> None:
    """It holds the reading still at a reversal until half the gap to either side is crossed."""
    half_gap = 0.02
    fit = rubbing_through((half_gap, 0.0))
    play = (Effect(form("backlash", "kinematic"), np.array([half_gap])),)
    response, values = response_with(play, 400)
    rubbed = fit.response.simulate(fit.values, command(400, 1)).y
    played, plain = (response.simulate(v, command(400, 1)).y for v in (values, replace(values, effects=())))
    assert np.abs(rubbed - played).max() < 0.15 * np.abs(plain - played).max()


@pytest.mark.parametrize("name", ["", "of the motor", "two harmonics of the motor"])
@pytest.mark.parametrize("turns", [1.2, 1.8])
def test_a_ripple_that_does_not_repeat_in_what_it_looks_at_is_a_shape(name: str, turns: float) -> None:
    """Its own motion goes less far than the reading; law and numbers stay."""
    ripple = form("torque_ripple", name)
    effect = torque(ripple, ripple.starts(scale(400))[0], 1e-9)
    fit = fit_with(effect)
    travel = turns_seen(fit, 0) / effect.values[0]
    wavenumber = effect.values.copy()
    wavenumber[0] = turns / travel
    fit = fit_with(replace(effect, values=wavenumber))
    assert turns_seen(fit, 0) == pytest.approx(turns, rel=0.05)
    named = named_by_sight(fit)
    assert named.labels == ("torque_ripple" if turns > TURNS_SEEN else "other",)
    np.testing.assert_array_equal(named.point.coordinates, fit.point.coordinates)
    assert named_by_sight(named) is named


def test_turns_are_counted_over_the_motion_of_all_records() -> None:
    """A second record goes to the other side of where both begin."""
    ripple = form("torque_ripple", "")
    fit = fit_with(torque(ripple, ripple.starts(scale(400))[0], 1e-9))
    (record,) = fit.response.records
    sides = [replace(record, u=sign * np.abs(record.u)) for sign in (1.0, -1.0)]

    def seen(records: list[Record]) -> float:
        return turns_seen(replace(fit, response=replace(fit.response, records=records)), 0)

    assert seen(sides) == pytest.approx(seen(sides[:1]) + seen(sides[1:]), rel=1e-2)
