"""Where a search begins, and when what it begins with is slow noise and no law."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.residuals.tone import Tone
from bayes_hw.gap.joint.search import beginning
from bayes_hw.gap.joint.search.beginning import FOLLOWED_SHARE, SHOWN, TRACE, Beginning

BASE = 100.0


def _fit(gained: float, cause: str | None = None, colour: float = 0.0, label: str = "friction") -> JointFit:
    added = () if cause is None else (cause,)
    labels = added or (label,)
    stands_for: Any = SimpleNamespace(score=BASE + gained, added=added, labels=labels, colour=colour)
    return cast(JointFit, stands_for)


def _begun(colour: float, *trials: JointFit, tone: Tone | None = None) -> Beginning:
    return Beginning(_fit(0.0, colour=colour), cast(Readings, None), (), trials, tone, unfinished=False)


@pytest.fixture(autouse=True)
def _colour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beginning, "coloured_nats", lambda fit: fit.colour)
    monkeypatch.setattr(beginning, "leaves_a_cause", lambda fit: fit.colour > 60.0)


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
    ("colour", "asked"),
    [(1000.0, True), (30.0 / SHOWN - 1, False), (50.0, False)],
    ids=["hidden", "shown", "white"],
)
def test_laws_over_the_states_are_begun_where_labels_leave_most(
    colour: float, asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of every label the better of both ways stays."""
    at_first = [_fit(30.0), _fit(10.0, "wind"), _fit(5.0, label="backlash")]
    laws = [_fit(20.0), _fit(400.0, label="backlash")]
    monkeypatch.setattr(beginning, "one_more", lambda _: list(at_first))
    monkeypatch.setattr(beginning, "every_law", lambda _: list(laws))
    found = beginning._first_labels(_fit(0.0, colour=colour))
    expected = [laws[1], at_first[0], at_first[1]] if asked else at_first
    assert [id(fit) for fit in found] == [id(fit) for fit in expected]
