"""The textbook baseline names what has a clear signature, and projects the base off first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind_check.largest_correlation import explained, largest_correlation

from bayes_hw.gap.blind.evidence import read_verdict
from bayes_hw.gap.blind.make import write_case
from bayes_hw.plant.case import make_case
from bayes_hw.plant.kinds import KINDS


def test_explained_share_by_hand() -> None:
    """Residual 3 along the signature, 4 along another direction, 12 along a tangent: 9 of 25 explained."""
    signature, other, tangent = np.eye(3)
    residual = 3 * signature + 4 * other + 12 * tangent
    columns = (signature + 5 * tangent)[:, None]
    assert explained(columns, tangent[:, None], residual) == pytest.approx(9 / 25)
    assert explained(2 * tangent[:, None], tangent[:, None], residual) == 0.0


@pytest.mark.slow
def test_clear_signature_is_named(tmp_path: Path) -> None:
    case = make_case(4, 1, replace(KINDS["easy"], gap_over_sigma=(4.0, 5.0)), ["gain_asymmetry"])
    write_case(case, tmp_path / "case")
    largest_correlation(tmp_path / "case", tmp_path / "out", 1)
    verdict = read_verdict(tmp_path / "out")
    assert verdict.answer == ("gain_asymmetry",)
    assert verdict.block == "sensor"
