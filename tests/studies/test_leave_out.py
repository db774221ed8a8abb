"""Leaving one effect out, on four cases worked by hand."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from blind_cases import truth, verdict
from blind_check.leave_out import left_out, shown_share

from bayes_hw.files import write_csv
from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.plant.case import BlindRecord


def test_counts_and_closures_by_hand() -> None:
    """Answers other, the stated twin, something else, nothing: one other, two acceptable, block by hand."""
    truths = tuple(truth("backlash", holdout=[0.0, 0.0]) for _ in range(4))
    before, half, quarter = np.array([2.0, 2.0]), np.array([1.0, 1.0]), np.array([0.5, 0.5])
    twin = (frozenset(("backlash", "friction")),)
    full = tuple(verdict("backlash", confusable=twin, before=before, after=quarter) for _ in range(4))
    lacking = (
        verdict("other", block="drive", share={"drive": 0.7, "linear": 0.2}, before=before, after=before),
        verdict("friction", block="drive", share={"drive": 0.9}, before=before, after=half),
        verdict("wind", block="disturbance", before=before, after=half),
        verdict(before=before, after=before),
    )
    complete, struck = Evidence(truths, full, "", "", ""), Evidence(truths, lacking, "", "", "")
    found = left_out("backlash", complete, struck, [0.9, 0.5, 0.8])
    assert (found.other.hits, found.acceptable.hits, found.block.hits, found.named_with.hits) == (1, 2, 2, 4)
    assert found.block_stated == pytest.approx(1.6 / 4)
    assert found.closed_with == pytest.approx(1 - 1 / 16)
    assert found.closed_without == pytest.approx(0.375)
    assert found.shown == 0.8 and np.isnan(left_out("backlash", complete, struck, []).shown)
    assert dict(found.answers) == {"other": 1, "friction": 1, "wind": 1, "none": 1}


def test_share_of_the_missing_response_that_is_shown(tmp_path: Path) -> None:
    """All of it, none of it, and its half, which leaves a quarter of the square."""
    without_noise = np.array([1.0, 3.0, -2.0])
    record = BlindRecord("train_1", without_noise, without_noise, without_noise, without_noise)
    case = SimpleNamespace(train=(record,))
    path = tmp_path / "free_residual.csv"
    for part, expected in ((1.0, 1.0), (0.0, 0.0), (0.5, 0.75)):
        write_csv(path, {"before": without_noise - 2.0, "response": np.full(3, 2.0 * part)})
        assert shown_share(case, path) == pytest.approx(expected)  # type: ignore[arg-type]
