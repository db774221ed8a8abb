"""Laws of finished explanations exchanged, and named by what they look at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import (
    CASCADE,
    SIGMA,
    STRUCTURE,
    command,
    form,
    record,
    response_with,
    scale,
    torque,
)

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.drive_forms import DRIVE_FORMS
from bayes_hw.gap.joint.forms.joint_forms import BY_TWIST
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search import law_exchange, sight
from bayes_hw.gap.joint.search.law_exchange import (
    EXCHANGED,
    as_laws_of_the_demand,
    begun_in_its_place,
    exchanged,
    exchanges,
    laws_of,
    more_of_the_command,
)
from bayes_hw.gap.joint.search.motion import Motion
from bayes_hw.gap.joint.search.sight import is_hidden_friction, named_by_sight, share_following
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
RUB = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)


def _fit(planted: Effect, fitted: Effect) -> JointFit:
    """A record with one effect, explained by another at its own values."""
    response, values = response_with((planted,), SAMPLES)
    noise = SIGMA * np.random.default_rng(5).standard_normal(SAMPLES)
    seen = record(response.simulate(values, command(SAMPLES, 1)).y + noise, 1)
    explained = JointResponse(STRUCTURE, (fitted,), [seen], scale(SAMPLES))
    return JointFit(explained, evaluate(explained, explained.coordinates(JointValues(CASCADE, (fitted,)))))


def test_the_law_at_work_is_reached_from_another_one() -> None:
    """A presliding friction that stands where a Coulomb friction is, is exchanged for it and ends as good as
    the truth."""
    truth = _fit(RUB, RUB)
    wrong = _fit(RUB, replace(RUB, form=form("friction", "presliding, motor"), values=np.array([0.02])))
    found = exchanged(wrong)
    assert 0 < len(found) <= 4
    assert all(
        one.labels != () and one.values.effects[0].form is not wrong.values.effects[0].form for one in found
    )
    best = max(found, key=lambda one: one.score)
    assert best.labels == ("friction",)
    assert best.log_likelihood > truth.log_likelihood - 3
    assert best.log_likelihood > wrong.descended().log_likelihood


def test_nothing_is_exchanged_without_a_law() -> None:
    response, values = response_with((), SAMPLES)
    plain = JointFit(response, evaluate(response, response.coordinates(values)))
    assert exchanged(plain) == []


@pytest.mark.parametrize("first", [True, False])
def test_a_law_beside_another_one_is_exchanged_too(first: bool) -> None:
    """Whichever stands first, and though it is of a form that is looked for around a model alone."""
    band = next(one for one in DRIVE_FORMS if one.name == "dead band of the drive")
    wrong = replace(RUB, form=band, values=np.array([0.02]))
    spring = torque(form("cubic_stiffness"), (0.0,), 1e-8)
    both = (wrong, spring) if first else (spring, wrong)
    response, values = response_with(both, SAMPLES)
    seen = record(response.simulate(values, command(SAMPLES, 1)).y, 1)
    response = replace(response, records=[seen])
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    laws = laws_of(fit)
    assert laws == [0, 1]
    with np.errstate(all="ignore"):
        begun, found = exchanges(fit, laws[not first], EXCHANGED), exchanged(fit)
    taken = [one.values.effects[laws[not first]].form for one in begun]
    assert taken and band not in taken
    assert any(band not in [e.form for e in one.values.effects] for one in found)


@pytest.mark.parametrize("name", ["dead band of the drive", "torque limit of the drive"])
def test_what_the_drive_does_is_reached_from_records_alone(name: str) -> None:
    """A law of the drive's demand stands in the place of a contact that explains its records, as well as at
    its own start."""
    band = replace(RUB, form=next(one for one in DRIVE_FORMS if one.name == name), values=np.array([0.02]))
    truth = _fit(band, band)
    wrong = _fit(band, RUB).descended()
    with np.errstate(all="ignore"):
        found = [*exchanged(wrong), *begun_in_its_place(wrong, [])]
    of_the_drive = [one for one in found if one.values.effects[-1].form in DRIVE_FORMS]
    assert of_the_drive
    assert max(one.log_likelihood for one in of_the_drive) > truth.log_likelihood - 10


def test_a_law_of_the_demand_takes_up_a_motion_that_another_found() -> None:
    """Begun by states alone it gives nearly the torque of the old law; with more of the command in it that of
    the states is the same in units of its size, and it enters as before."""
    band = next(one for one in DRIVE_FORMS if one.name == "dead band of the drive")
    fit = _fit(RUB, RUB)
    begun = as_laws_of_the_demand(fit, 0)
    assert [one.values.effects[0].form for one in begun] == [band]
    (one,) = begun
    assert one.values.effects[0].values[0] == pytest.approx(3 * one.response.scale.speed)
    torques = [each.response.along(each.values, 0).torques[0] for each in (fit, one)]
    assert abs(np.corrcoef(torques[0], torques[1])[0, 1]) > 0.8
    more = more_of_the_command(one)
    before, after = one.values.effects[0], more.values.effects[0]
    assert before.ports is not None and after.ports is not None
    assert after.values[0] == pytest.approx(0.6 * before.values[0])
    np.testing.assert_allclose(after.ports.signal_sections, 0.6 * before.ports.signal_sections)
    np.testing.assert_allclose(after.ports.signal_real, 0.6 * before.ports.signal_real)
    np.testing.assert_allclose(after.ports.sections, before.ports.sections)


@pytest.mark.parametrize("twist", [True, False])
def test_a_friction_that_looks_at_a_twist_is_contact_in_a_gap(twist: bool) -> None:
    """Its law, its numbers and its likelihood stay; one that looks at the speed keeps its name."""
    load = form("friction", "Coulomb, load")
    assert RUB.ports is not None
    seen = np.array([[-60.0], [59.0]]) if twist else np.zeros((2, 1))
    rub = Effect(load, np.array([0.0005]), replace(RUB.ports, signal_sections=seen))
    fit = _fit(RUB, rub)
    named = named_by_sight(fit)
    assert (named is fit) is not twist
    assert named.labels == (("backlash",) if twist else ("friction",))
    assert named.values.effects[0].form is (BY_TWIST[load] if twist else load)
    np.testing.assert_array_equal(named.point.coordinates, fit.point.coordinates)
    assert named.score == pytest.approx(fit.score)


@pytest.mark.parametrize(("taken", "label"), [(False, "other"), (True, "backlash")])
def test_bristles_over_a_twist_are_a_spring_only_if_they_add_to_it(
    taken: bool, label: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What takes away what a spring passes on is contact in a gap."""
    monkeypatch.setattr(sight, "sees_twist", lambda *_: True)
    monkeypatch.setattr(sight, "takes_away", lambda *_: taken)
    rub = replace(RUB, form=form("friction", "presliding, load"), values=np.array([0.01]))
    assert named_by_sight(_fit(RUB, rub)).labels == (label,)


@pytest.mark.parametrize(
    ("speed", "acceleration", "rubs"), [(0.4, 0.02, True), (0.3, 0.2, False), (0.05, 0.0, False)]
)
def test_a_hysteresis_that_looks_at_the_speed_is_a_friction(
    speed: float, acceleration: float, rubs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sight, "shares_of_motion", lambda *_: (speed, acceleration))
    spring = replace(RUB, form=form("other", "hysteresis of the spring"), values=np.array([0.01]))
    assert is_hidden_friction(_fit(RUB, spring)) is rubs
    assert not is_hidden_friction(_fit(RUB, RUB))


def test_shares_of_motion() -> None:
    rng = np.random.default_rng(1)
    one, other = rng.standard_normal((2, 4000))
    assert share_following(2 * one + other, one) == pytest.approx(0.8, abs=0.03)
    assert share_following(one, np.zeros(4000)) == 0.0


def test_in_the_place_of_a_law_others_begin_over_its_motion_beside_the_g_without_it() -> None:
    """Of other labels, of no strength yet, each seeing what the law saw; the best G that is known without it
    is begun from, and what is found is that law's rival."""
    spring = torque(form("cubic_stiffness"), (0.0,), 1e-6, 1e-5)
    wrong = _fit(RUB, spring)
    bare = wrong.without("cubic_stiffness").descended()
    lent = replace(bare, point=replace(bare.point, log_likelihood=bare.point.log_likelihood + 5))
    with np.errstate(all="ignore"):
        begun = law_exchange._over_the_motion(wrong, 0, [lent])
        found = begun_in_its_place(wrong, [lent])
    assert 0 < len(begun) <= law_exchange.MOST_TRIED
    old, alike = Motion.of(wrong, 0).signal, []
    for one in begun:
        assert one.labels and one.labels != ("cubic_stiffness",)
        assert one.point.rms == pytest.approx(lent.point.rms)
        (seen,) = one.response.along(one.values, 0).signals
        alike.append(np.corrcoef(seen, old)[0, 1])
    assert max(alike) > 0.95
    assert max(one.log_likelihood for one in found) > max(wrong.log_likelihood, lent.log_likelihood)
