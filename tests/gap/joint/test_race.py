"""Descents that are raced: who may drop out, and who not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from bayes_hw.gap.joint.fit.joint_fit import ROUND_STEPS, ROUNDS, raced


@dataclass(frozen=True)
class Runner:
    """A fit whose score goes through given values, a round each; it ends with the last."""

    name: str
    scores: tuple[float, ...]
    at: int = 0

    @property
    def score(self) -> float:
        return self.scores[self.at]

    @property
    def point(self) -> Any:
        return SimpleNamespace(converged=self.at + 1 == len(self.scores))

    def descended(self, steps: int) -> Runner:
        assert steps == ROUND_STEPS
        return self if self.point.converged else replace(self, at=self.at + 1)


def ends(*runners: Runner, least: float = -float("inf")) -> dict[str, tuple[float, int]]:
    """Score and rounds of every runner."""
    found: Any = raced(list(runners), least)
    return {one.name: (one.score, one.at) for one in found}


def test_who_gains_too_little_to_reach_the_best_drops_out() -> None:
    found = ends(Runner("best", (0.0, 100.0, 110.0, 111.0)), Runner("slow", (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)))
    assert found == {"best": (111.0, 3), "slow": (1.0, 1)}


def test_who_would_reach_it_at_its_pace_goes_on() -> None:
    steady = tuple(20.0 * i for i in range(6))
    found = ends(Runner("best", (0.0, 90.0, 90.0)), Runner("steady", steady))
    assert found["steady"] == (100.0, 5)


def test_a_score_to_beat_ends_a_race_as_a_rival_does() -> None:
    alone = Runner("alone", (0.0, 1.0, 2.0, 3.0))
    assert ends(alone, least=50.0) == {"alone": (1.0, 1)}
    assert ends(alone) == {"alone": (3.0, 3)}


def test_a_race_has_so_many_rounds() -> None:
    endless = tuple(float(i) for i in range(100))
    assert ends(Runner("endless", endless)) == {"endless": (float(ROUNDS), ROUNDS)}


@pytest.mark.parametrize("least", [-float("inf"), 0.0])
def test_nobody_races_alone_in_vain(least: float) -> None:
    assert raced([], least) == []
