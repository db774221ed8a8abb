"""The constants that go with the program are those that the study fitted."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from bayes_hw.gap.answer.calibration import Calibration

FITTED = Path(__file__).resolve().parents[2] / "reports" / "19_decision_constants"


def test_the_program_has_what_the_study_adopted() -> None:
    results = json.loads((FITTED / "results.json").read_text())
    assert asdict(Calibration.built_in()) == results["adopted"]
    assert results["gain_left_out"] > 2 * results["gain_standard_error"]
    assert results["adopted"] == pytest.approx({**results["fitted"]}, rel=6e-3)
