"""Ballots judged again with other constants."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from blind_check.ballot import BALLOT, Ballot
from blind_check.calibrate import BY_HAND

from bayes_hw.gap.answer.judgement import Claim, Remains
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic

PAIR = ("friction", "wind")
BALLOTED = Ballot(
    {
        (): Claim(0.0),
        ("friction",): Claim(50.0),
        PAIR: Claim(100.0, True, (("pair_gain", 50.0), ("pair_size", 0.21))),
        ("friction", "outliers"): Claim(500.0),
    },
    {
        (): Remains((ResidualDiagnostic("step", 100.0, 2.0),), gap=3.0),
        ("friction",): Remains((), loose=True),
        PAIR: Remains((), drifts=True, excused=True, bent_disturbance=0.5),
    },
    ("friction", "wind", "outliers"),
)


def test_read_as_written(tmp_path: Path) -> None:
    (tmp_path / BALLOT).write_text(json.dumps(BALLOTED.to_dict(), allow_nan=False))
    assert Ballot.read(tmp_path) == BALLOTED


@pytest.mark.parametrize(("changes", "answer"), [
    ({}, PAIR),
    ({"pair_size": 0.22}, ("friction",)),
    ({"pair_gain": 51.0}, ("friction",)),
    ({"single_gain": 51.0, "pair_gain": 51.0}, ("other",)),
])  # fmt: skip
def test_constants_decide(changes: dict[str, float], answer: tuple[str, ...]) -> None:
    """A pair of which it is not known what it leaves is never chosen, however far ahead."""
    assert BALLOTED.judge(replace(BY_HAND, **changes)).answer == answer
