"""The constants that go with the program are those that the study fitted."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from blind_check.calibrate import BY_HAND, HELD

from bayes_hw.gap.answer.calibration import Calibration

FITTED = Path(__file__).resolve().parents[2] / "reports" / "19_decision_constants"


def test_the_program_has_what_the_study_adopted() -> None:
    """And those that no ballot of its cases holds are as they were set by hand."""
    results = json.loads((FITTED / "results.json").read_text())
    built_in, by_hand = asdict(Calibration.built_in()), asdict(BY_HAND)
    assert {name: built_in[name] for name in results["adopted"]} == results["adopted"]
    others = set(built_in) - set(results["adopted"])
    assert others <= set(HELD) and all(built_in[name] == by_hand[name] for name in others)
    assert results["gain_left_out"] > 2 * results["gain_standard_error"]
    assert results["adopted"] == pytest.approx({**results["fitted"]}, rel=6e-3)
