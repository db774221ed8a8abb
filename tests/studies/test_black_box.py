"""The black box closes what a regression can, and says nothing where there is nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from blind_check.black_box import black_box

from bayes_hw.gap.blind.counts import true_closure
from bayes_hw.gap.blind.evidence import CaseTruth, read_verdict
from bayes_hw.gap.blind.make import write_case
from bayes_hw.plant.case import make_case
from bayes_hw.plant.kinds import KINDS


@pytest.mark.parametrize(
    ("labels", "used"), [pytest.param(["gain_asymmetry"], True, marks=pytest.mark.slow), ([], False)]
)
def test_black_box(labels: list[str], used: bool, tmp_path: Path) -> None:
    """Of an unequal gain, which the library holds, over half closes; where there is no gap it keeps still."""
    kind = replace(KINDS["easy"], gap_over_sigma=(4.0, 5.0))
    case = make_case(4, 1, kind, labels)
    write_case(case, tmp_path / "case")
    black_box(tmp_path / "case", tmp_path / "out", 1)
    verdict = read_verdict(tmp_path / "out")
    assert verdict.answer == (("other",) if used else ())
    truth = CaseTruth("case", tuple(labels), (), (), {}, 0.0, case.holdout.noise_free)
    assert (true_closure(truth, verdict) > 0.5) is used
