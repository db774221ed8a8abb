"""Leaving one effect out, on four cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from blind_cases import truth, verdict

from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.gap.blind.leave_out import left_out


def test_counts_and_closures_by_hand() -> None:
    """Answers other, the stated twin, something else, nothing: one other, two acceptable, block by hand."""
    truths = tuple(truth("backlash", holdout=[0.0, 0.0]) for _ in range(4))
    before, half, quarter = np.array([2.0, 2.0]), np.array([1.0, 1.0]), np.array([0.5, 0.5])
    twin = (frozenset(("backlash", "friction")),)
    full = tuple(verdict("backlash", confusable=twin, before=before, after=quarter) for _ in range(4))
    lacking = (
        verdict("other", block="drive", before=before, after=before),
        verdict("friction", block="drive", before=before, after=half),
        verdict("wind", block="disturbance", before=before, after=half),
        verdict(before=before, after=before),
    )
    found = left_out("backlash", Evidence(truths, full, "", "", ""), Evidence(truths, lacking, "", "", ""))
    assert (found.other.hits, found.acceptable.hits, found.block.hits, found.named_with.hits) == (1, 2, 2, 4)
    assert found.closed_with == pytest.approx(1 - 1 / 16)
    assert found.closed_without == pytest.approx(0.375)
    assert dict(found.answers) == {"other": 1, "friction": 1, "wind": 1, "none": 1}
