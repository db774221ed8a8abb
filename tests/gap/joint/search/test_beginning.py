"""Where a search begins, and when what it begins with is slow noise and no law."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from joint_axis import response_with

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.other_cascades import with_pole
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.residuals.tone import Tone
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.search import beginning
from bayes_hw.gap.joint.search.beginning import (
    FOLLOWED_SHARE,
    LASTING,
    SHOWN,
    TRACE,
    Beginning,
    with_lasting_pole,
)
from bayes_hw.gap.joint.search.hidden_zone import LEFT_OUT
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS
from bayes_hw.identify.growth.descent import Point, evaluate
from bayes_hw.record import Record

BASE = 100.0
READINGS = cast(Readings, None)


def _fit(gained: float, cause: str | None = None, colour: float = 0.0, label: str = "friction") -> JointFit:
    added = () if cause is None else (cause,)
    labels = added or (label,)
    stands_for: Any = SimpleNamespace(score=BASE + gained, added=added, labels=labels, colour=colour)
    return cast(JointFit, stands_for)


def _begun(colour: float, *trials: JointFit, tone: Tone | None = None) -> Beginning:
    return Beginning(_fit(0.0, colour=colour), READINGS, (), trials, tone, unfinished=False)


@pytest.fixture(autouse=True)
def _colour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beginning, "coloured_nats", lambda fit: fit.colour)
    monkeypatch.setattr(beginning, "leaves_a_cause", lambda fit: fit.colour > 60.0)
    monkeypatch.setattr(beginning, "asked_of", lambda *_: VERIFIED_NATS)


@pytest.mark.parametrize(("second", "expected"), [(FOLLOWED_SHARE * 200 - 1, True), (199.0, False)])
def test_a_cause_that_leads_every_label_is_slow_noise(second: float, expected: bool) -> None:
    assert _begun(0.0, _fit(second), _fit(200.0, "wind")).is_of_slow_noise is expected
    assert not _begun(0.0, _fit(second, "wind"), _fit(200.0)).is_of_slow_noise


def test_labels_that_explain_a_trace_of_the_colour_did_not_make_it() -> None:
    assert _begun(1000.0, _fit(1000 * TRACE - 1)).is_of_slow_noise
    assert not _begun(1000.0, _fit(1000 * TRACE + 1)).is_of_slow_noise


def test_where_nothing_is_left_nothing_is_slow_noise() -> None:
    assert not _begun(0.0, _fit(-12.0), _fit(-14.0, "wind")).is_of_slow_noise
    assert not _begun(1000.0).is_of_slow_noise


def test_a_line_that_leads_is_taken_out_first() -> None:
    line = Tone(1.0, 0.1, _fit(2000.0))
    assert _begun(1000.0, _fit(2.0), tone=line).leading_tone is line
    assert not _begun(1000.0, _fit(2.0), tone=line).is_of_slow_noise


@pytest.mark.parametrize(
    ("colour", "gained", "asked"),
    [
        (1000.0, 30.0, True),
        (30.0 / SHOWN - 1, 30.0, False),
        (50.0, 30.0, False),
        (0.0, VERIFIED_NATS + 1, False),
        (0.0, VERIFIED_NATS - 1, True),
    ],
    ids=["hidden", "shown", "white", "verifiable", "nothing"],
)
def test_laws_over_the_states_are_begun_where_labels_leave_most(
    colour: float, gained: float, asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or where none could be verified; of every label the better of both ways stays."""
    at_first = [_fit(gained), _fit(10.0, "wind"), _fit(5.0, label="backlash")]
    laws = [_fit(20.0), _fit(400.0, label="backlash")]
    monkeypatch.setattr(beginning, "one_more", lambda _: list(at_first))
    monkeypatch.setattr(beginning, "with_lasting_pole", lambda _: [])
    monkeypatch.setattr(beginning, "every_law", lambda _: list(laws))
    found = beginning._first_labels(_fit(0.0, colour=colour), READINGS)
    expected = [laws[1], at_first[0], at_first[1]] if asked else at_first
    assert [id(fit) for fit in found] == [id(fit) for fit in expected]


@pytest.mark.parametrize("seen", [0.5, 2.0])
def test_a_pole_that_lasts_is_lent_where_torques_reach_none(seen: float) -> None:
    """One more that changes nothing yet; none where G has one that remembers as long."""
    fit = JointFit(*_bare(600))
    assert fit.structure.integrator, "no torque enters it"
    (lasting,) = with_lasting_pole(fit)
    assert lasting.structure.real_poles == 1
    assert lasting.values.cascade.real[0, 0] == pytest.approx(np.exp(-1 / 600))
    assert lasting.point.rms == pytest.approx(fit.point.rms)
    memory = np.exp(-1 / (seen * LASTING * 600))
    assert bool(with_lasting_pole(with_pole(fit, memory))) is (seen < 1)


@pytest.mark.parametrize("leads", [True, False])
def test_labels_begin_over_a_pole_that_lasts_too(leads: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws that look at states of G are begun over the G over which a label does best; without colour
    nothing is begun over the longer one."""
    base, lasting = _fit(0.0, colour=1000.0), _fit(0.0)
    plain, over = [_fit(30.0), _fit(20.0, label="backlash")], [_fit(40.0 if leads else 25.0)]
    asked: list[JointFit] = []
    monkeypatch.setattr(beginning, "with_lasting_pole", lambda _: [lasting])
    monkeypatch.setattr(beginning, "one_more", lambda fit: list(over if fit is lasting else plain))

    def laws(fit: JointFit) -> list[JointFit]:
        asked.append(fit)
        return []

    monkeypatch.setattr(beginning, "every_law", laws)
    found = beginning._first_labels(base, READINGS)
    assert found == ([over[0], plain[1]] if leads else plain)
    assert asked == [lasting if leads else base]
    assert beginning._first_labels(_fit(0.0), READINGS) == plain


def _bare(samples: int) -> tuple[JointResponse, Point]:
    """The axis without effects at its true values, on a record of nothing."""
    response, values = response_with((), samples)
    return response, evaluate(response, response.coordinates(values))


def test_what_the_zone_hides_is_left_out_before_labels_are_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, and the search that goes on from there says so."""
    whole, clear = [cast(Record, "whole")], (cast(Record, "clear"),)
    shown = {"whole": clear, "clear": None}
    monkeypatch.setattr(beginning, "_begun", lambda *_: (_fit(0.0), SimpleNamespace(nats={}, step=None)))
    monkeypatch.setattr(beginning, "with_known_inputs", lambda base: (base, ()))
    monkeypatch.setattr(beginning, "where_it_shows", lambda _, records: shown[records[0]])
    monkeypatch.setattr(beginning, "with_heavy_tails", lambda base, *_: base)
    monkeypatch.setattr(beginning, "_first_labels", lambda *_: [])
    monkeypatch.setattr(beginning, "tone_in", lambda _: None)
    told: list[str] = []
    assert Beginning.of(whole, told.append).clear_of_zone
    assert told == [LEFT_OUT]
    assert not Beginning.of(clear, told.append).clear_of_zone
