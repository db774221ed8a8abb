"""A case that its drive train leaves without a name is asked again through ports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from drive_axis import RATE, command
from fitted import AXIS

from bayes_hw.gap import any_train, diagnosis
from bayes_hw.gap.any_train import diagnose_around
from bayes_hw.gap.case.case import Case
from bayes_hw.record import Record


@dataclass(frozen=True)
class Said:
    """A verdict's answer, its least certainty, and how long it took."""

    answer: tuple[str, ...]
    seconds: float = 40.0
    certainty: float = 0.9


@dataclass(frozen=True)
class Found:
    cut_short: bool = False


@dataclass(frozen=True)
class Answered:
    """A diagnosis as far as which of two is better looks at it."""

    verdict: Said
    found: Found = Found()


@pytest.fixture
def case() -> Case:
    u, t = command(300, 1), np.arange(300) / RATE
    records = [Record(name, t, u, np.cumsum(u) / RATE, RATE, AXIS.units) for name in ("train", "held out")]
    return Case.of_records("case", AXIS, records[:1], records[1:])


Asked = Callable[..., tuple[Any, dict[str, Any]]]


@pytest.fixture
def asked(case: Case, monkeypatch: pytest.MonkeyPatch) -> Asked:
    """What is answered where the train and ports answer so, and how ports were asked."""

    def ask(by_train: Said, by_ports: Answered, read: bool = True, **how: Any) -> tuple[Any, dict[str, Any]]:
        called: dict[str, Any] = {}

        def through_ports(*_: Any, **options: Any) -> Answered:
            called.update(options)
            return by_ports

        monkeypatch.setattr(any_train, "needs_ports", lambda _: not read)
        monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: Answered(by_train))
        monkeypatch.setattr(any_train, "diagnose_records", through_ports)
        return diagnose_around(case, np.random.default_rng(1), **how), called

    return ask


def test_what_has_no_name_by_its_train_is_asked_again_in_the_time_left(asked: Asked) -> None:
    """And is answered with all the seconds that both took; a label that is certain beside `other` counts."""
    for answer in (("rate_limit", "wind"), ("rate_limit", "other")):
        found, called = asked(Said(("other",)), Answered(Said(answer, 25.0)), within_s=100.0)
        assert found.verdict == Said(answer, 65.0)
        assert called["within_s"] == 60.0
        assert "with the drive train" in called["notes"][0]


@pytest.mark.parametrize(
    "by_ports",
    [
        Answered(Said(("other",))),
        Answered(Said(())),
        Answered(Said(("wind",), certainty=0.6)),
        Answered(Said(("wind",)), Found(True)),
    ],
)
def test_what_ports_do_not_name_for_certain_or_had_no_time_for_changes_nothing(
    asked: Asked, by_ports: Answered
) -> None:
    found, called = asked(Said(("other",)), by_ports)
    assert called
    assert found.verdict == Said(("other",))


def test_of_two_answers_the_more_certain_counts_where_that_by_the_train_is_in_doubt(asked: Asked) -> None:
    """Or the one that names more, beside what has no name, or a second cause."""
    friction = Said(("friction",), certainty=0.5)
    for by_train, by_ports, taken in (
        (friction, Said((), certainty=0.6), True),
        (friction, Said(("other",), certainty=0.4), False),
        (friction, Said(("friction", "wind"), certainty=0.4), True),
        (Said(("other",)), Said(("wind", "other"), certainty=0.3), True),
        (Said((), certainty=0.6), Said(("wind",), certainty=0.5), False),
    ):
        found, called = asked(by_train, Answered(by_ports))
        assert called
        assert found.verdict.answer == (by_ports if taken else by_train).answer


def test_a_train_that_explains_it_is_asked_alone(asked: Asked) -> None:
    """As where labels are struck, or no time is left."""
    named = Answered(Said(("wind",)))
    for by_train, how in (
        (Said(("friction",)), {}),
        (Said(()), {}),
        (Said(("other",)), {"without": frozenset({"friction"})}),
        (Said(("other",)), {"within_s": 40.0}),
    ):
        found, called = asked(by_train, named, **how)
        assert found.verdict == by_train
        assert not called


def test_a_train_that_is_not_read_back_leaves_it_to_ports(asked: Asked) -> None:
    found, called = asked(Said(("friction",)), Answered(Said(("wind",), 25.0)), read=False)
    assert found.verdict == Said(("wind",), 25.0)
    assert called["notes"] == ("no drive train was read back from the model's G",)
