"""What is held against an answer is begun as the answer was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from joint_axis import form, measured, model, torque

from bayes_hw.gap.joint.forms.drive_forms import DRIVE_FORMS
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.given import given_rivals
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_rivals import instead_of, plainly_named
from bayes_hw.gap.joint.residuals.noise_screen import first_order_noise
from bayes_hw.gap.joint.search import sight
from bayes_hw.identify.growth.levels import WHITE


@pytest.mark.slow
def test_a_rival_is_given_its_laws_where_none_were_begun_and_steps_within_the_sample(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Laws that look at the states of G were begun for all labels where the first left noise of higher order;
    beside white noise nothing is left to explain, unless by a law that looks at those states itself."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    base = best_base(measured((rub,), 400, (1,)), model())
    fit = base.with_effect(rub.form, (0.02,)).descended()
    assert fit.noise_order <= 1 < base.noise_order
    alone = base.with_effect(form("cubic_stiffness"), (0.0,))
    asked: list[set[str]] = []
    stepped: list[str] = []

    def laws(_: object, forms: Sequence[Form]) -> list[object]:
        asked.append({one.label for one in forms})
        return [fit]

    def finer(one: object) -> object:
        stepped.extend(one.labels)
        return one

    for name, stand_in in (
        ("every_law", laws), ("finer", finer), ("with_base_anew", lambda one: one),
        ("free_shape", lambda one: one), ("_of_label", lambda *_: []),
    ):  # fmt: skip
        monkeypatch.setattr(given_rivals, name, stand_in)
    fit = replace(fit, point=replace(fit.point, whitener=first_order_noise(fit.point.residuals)))
    assert fit.noise_order == 1
    nats = {"friction": fit.score - base.score}
    rivals = nats | {"cubic_stiffness": 0.9 * nats["friction"]}
    ends = instead_of(fit, base, nats, rivals, {"cubic_stiffness": alone})
    assert asked == [{"cubic_stiffness"}]
    assert ends["cubic_stiffness"] is fit
    assert stepped == ["friction"]
    for whitener in (WHITE, base.point.whitener):
        other = replace(fit, point=replace(fit.point, whitener=whitener))
        ends = instead_of(other, base, nats, rivals, {"cubic_stiffness": alone})
        assert len(asked) == 1
        assert ends["cubic_stiffness"] is alone
    looking = fit.with_signal(0)
    looking = replace(looking, point=replace(looking.point, whitener=WHITE))
    ends = instead_of(looking, base, nats, rivals, {"cubic_stiffness": alone})
    assert asked[1:] == [{"cubic_stiffness"}]
    assert ends["cubic_stiffness"] is fit


def test_a_law_is_held_against_its_look_alikes_of_other_names() -> None:
    """A friction of the motor, which a dead band of the drive explains as well; a dead band of the drive, of
    which a friction comes not near."""
    band = next(one for one in DRIVE_FORMS if one.name == "dead band of the drive")
    leads = {}
    for law, size, weight in ((form("friction", "Coulomb, motor"), 0.02, 0.012), (band, 0.1, 0.02)):
        planted = torque(law, (size,), weight)
        base = best_base(measured((planted,), 400, (1,)), model())
        begun = base.with_effect(planted.form, (size,)).with_signal(0)
        fit = begun.descended_under(0, 40).descended()
        found = given_rivals._exchanged(fit)
        assert found and not any(set(one.labels) & set(fit.labels) for one in found)
        kinds = [one.values.effects[-1].form.kind for one in found]
        assert len(set(kinds)) == len(kinds)
        nearest = sorted(found, key=lambda one: one.score)
        leads[law.label] = {one.labels[0]: fit.score - one.score for one in nearest}
    assert abs(leads["friction"]["other"]) < 5
    assert leads["other"]["friction"] > 50


def test_the_command_is_let_into_what_a_law_of_states_found() -> None:
    """A dead band of the drive is reached from a contact that stands in its place and explains less; of a
    friction of the motor nothing is made that leads it."""
    band = next(one for one in DRIVE_FORMS if one.name == "dead band of the drive")
    contact = form("backlash", "dynamic")
    for planted, wrong, led in (
        (torque(band, (0.1,), 0.02), contact, True),
        (torque(form("friction", "Coulomb, motor"), (0.02,), 0.012), None, False),
    ):
        base = best_base(measured((planted,), 400, (1,)), model())
        taken, start = (planted.form, planted.values.tolist()) if wrong is None else (wrong, (0.003,))
        begun = base.with_effect(taken, start).with_signal(0)
        fit = begun.descended_under(0, 40).descended()
        found = given_rivals._led_to_the_demand(fit)
        assert {one.labels for one in found} == ({("other",)} if led else set())
        assert all(one.score > fit.score + sight.LAW_LEAD for one in found)


def _friction_and_a_dead_band() -> tuple[GivenFit, GivenFit, GivenFit]:
    """Of a record with a friction: a model, with that friction, and with a dead band of the drive, begun."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    base = best_base(measured((rub,), 400, (1,)), model())
    friction = base.with_effect(rub.form, (0.02,))
    band = next(one for one in DRIVE_FORMS if one.name == "dead band of the drive")
    other = base.with_effect(band, (0.1,))
    return base, friction, other


def test_what_leads_is_exchanged_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Labels present take what is better for them of its motion; where the strongest still leads, none do."""
    _, friction, other = _friction_and_a_dead_band()

    def raised(fit: GivenFit, nats: float) -> GivenFit:
        return replace(fit, point=replace(fit.point, log_likelihood=fit.point.log_likelihood + nats))

    low, high = raised(friction, 300.0), raised(friction, 500.0)
    leading = raised(other, 400.0 + friction.score - other.score)
    monkeypatch.setattr(given_rivals, "_exchanged", lambda fit: [low, high] if fit is leading else [])
    assert given_rivals._exchanged_back({"friction": friction, "other": leading}, "friction") == {
        "friction": high
    }
    assert given_rivals._exchanged_back({"friction": high, "other": leading}, "friction") == {}
    assert given_rivals._exchanged_back({"backlash": friction, "other": leading}, "backlash") == {}


def test_friction_under_another_name_is_no_rival_of_friction(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless it explains clearly more than friction does; where there is no friction it stays."""
    base, friction, other = _friction_and_a_dead_band()
    likelihood = other.point.log_likelihood + sight.LAW_LEAD + 20
    better = replace(other, point=replace(other.point, log_likelihood=likelihood))
    monkeypatch.setattr(sight, "is_hidden_friction", lambda fit: fit in (other, better))
    monkeypatch.setattr(sight, "looks_alike", lambda *_: False)
    for ends, left in (
        ({"friction": friction, "other": other}, {"friction"}),
        ({"friction": friction, "other": better}, {"friction", "other"}),
        ({"other": other}, {"other"}),
    ):
        kept, nats = plainly_named(ends, {"wind": 3.0}, base)
        assert kept == {label: ends[label] for label in left}
        assert nats == {"wind": 3.0} | {label: end.score - base.score for label, end in kept.items()}
