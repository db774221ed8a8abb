"""An explanation goes to its end before another label is held against what it leaves."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from joint_axis import GIVEN_SAMPLES, SIGMA, form, measured, model, torque

from bayes_hw.gap.joint.answer.joint_notes import notes_on_search
from bayes_hw.gap.joint.decision.given_decision import GivenEvidence, decide_given
from bayes_hw.gap.joint.given import clear_of_zone, settled
from bayes_hw.gap.joint.given.clear_of_zone import on_records, slow_beside, slow_clear_of_zone
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_search import search_given
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.gap.joint.search.effect_moves import slow_causes
from bayes_hw.gap.joint.search.verification import VERIFIED_BESIDE_NATS
from bayes_hw.time_budget import at_most

FEW = 400


@pytest.fixture(scope="module")
def rubbed() -> GivenFit:
    """The base of an axis with Stribeck friction."""
    rub = torque(form("friction", "Stribeck, motor"), (0.02, 1.5, 0.1), 0.012)
    return best_base(measured((rub,), GIVEN_SAMPLES, (1, 2)), model())


def test_a_label_ends_in_the_form_that_explains_it(rubbed: GivenFit) -> None:
    """What Coulomb's law leaves is coloured; Stribeck's is tried before anything is put beside it."""
    plain = form("friction", "Coulomb, motor")
    coulomb = rubbed.with_effect(plain, (0.02,)).descended(6)
    assert coulomb.noise_order > 1
    end = settled.settled(coulomb)
    assert end.labels == ("friction",)
    assert end.score > coulomb.score + 5
    assert settled.settled(end).score < end.score + 5


def test_what_leaves_white_noise_is_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    records = measured((Effect(form("command_bias"), np.array([0.02])),), FEW, (1, 2))
    biased = best_base(records, model()).with_effect(form("command_bias"), (0.0,)).descended()
    assert biased.noise_order <= 1
    monkeypatch.setattr(settled, "port_candidates", None)
    assert settled.settled(biased) is biased


def test_a_descent_takes_no_step_once_time_is_up(rubbed: GivenFit) -> None:
    begun = rubbed.with_effect(form("friction", "Coulomb, motor"), (0.02,))
    with at_most(0.0):
        stayed = begun.descended()
    np.testing.assert_array_equal(stayed.point.coordinates, begun.point.coordinates)
    assert not stayed.point.converged
    assert stayed.descended().score > begun.score + 20


def test_an_explanation_is_as_it_is_where_time_runs_out_on_the_way(
    rubbed: GivenFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After its ports were tried, before noise of a cause is: there is none once time is up."""
    coulomb = rubbed.with_effect(form("friction", "Coulomb, motor"), (0.02,)).descended(6)
    monkeypatch.setattr(settled, "port_candidates", lambda _: [])
    monkeypatch.setattr(settled, "explained_slowly", lambda fit: fit)
    monkeypatch.setattr(settled, "finer", lambda fit: fit)
    monkeypatch.setattr(settled, "kicked", lambda fit: fit)
    monkeypatch.setattr(settled, "slow_causes", lambda _: [])
    assert settled.settled(coulomb).score >= coulomb.score


def test_a_search_without_time_answers_with_what_it_has_and_says_so() -> None:
    records = measured((Effect(form("command_bias"), np.array([0.02])),), FEW, (1, 2))
    with at_most(1e-3):
        found = search_given(records, model())
    assert found.cut_short
    decision = decide_given(GivenEvidence.of(found, SIGMA))
    assert "no time left" in " ".join(notes_on_search(found, decision))


@pytest.mark.slow
def test_a_slow_cause_is_held_against_an_effect_clear_of_the_zone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The base clear of the zone, where the cause explains more there; an effect that explains all stays."""
    plain = measured((), GIVEN_SAMPLES, (1, 2))
    rng = np.random.default_rng(3)
    slowly = [0.3 * SIGMA * np.cumsum(rng.standard_normal(len(r))) for r in plain]
    records = [
        replace(r, y=r.y + np.where(np.abs(r.y) > 0.02, e, 0)) for r, e in zip(plain, slowly, strict=True)
    ]
    base = best_base(records, model())
    slow = slow_causes(base)
    assert slow
    clear = slow_clear_of_zone(base, base, slow)
    assert clear is not None
    assert clear.response.records is not base.response.records
    monkeypatch.setattr(clear_of_zone, "slow_causes", lambda _: [])
    assert slow_clear_of_zone(base, base, slow) is None


@pytest.mark.parametrize("more", [-5.0, 5.0])
def test_a_cause_stands_beside_labels_where_it_explains_what_one_must(
    rubbed: GivenFit, monkeypatch: pytest.MonkeyPatch, more: float
) -> None:
    """Of what lies clear of the zone, however much it explains of all samples."""
    records = tuple(replace(r, measured=np.abs(r.y) > 0.02) for r in rubbed.response.records)
    clear = on_records(rubbed, records)

    def caused(fit: GivenFit) -> list[SimpleNamespace]:
        lead = VERIFIED_BESIDE_NATS + more if fit.response.records is records else 1e4
        return [SimpleNamespace(score=fit.score + lead)]

    monkeypatch.setattr(clear_of_zone, "slow_causes", caused)
    monkeypatch.setattr(clear_of_zone, "out_of_reach", lambda *_: records)
    assert clear.noise_order > 1
    there, slow = slow_beside(rubbed)
    assert (there.response.records is records) is (more > 0)
    assert bool(slow) is (more > 0)
    monkeypatch.setattr(clear_of_zone, "slow_causes", lambda _: [])
    there, slow = slow_beside(rubbed)
    assert there is rubbed
    assert not slow
