"""All replicates are counted, converged or not, and the verdict allows for the number of quantities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from calibration_summary import CalibrationSummary, summarize_calibration
from prior_calibration import DRAWS

REPLICATES = 200


def replicate(rank: int, sigma_rank: int, *, converged: bool = True, failed: str = "") -> dict[str, Any]:
    return {
        "ranks": {"gain": rank, "noise.sigma": sigma_rank},
        "inside": {"gain": [rank < 64, True, True, True], "noise.sigma": [False] * 4},
        "converged": converged,
        "problems": [],
        "failed_tests": [failed] if failed else [],
        "seconds": 2.0,
    }


@pytest.fixture(scope="module")
def summary() -> CalibrationSummary:
    """Even ranks of the gain; sigma always ranked last."""
    ranks = np.linspace(0, DRAWS, REPLICATES).round().astype(int).tolist()
    results = [
        replicate(
            rank,
            DRAWS,
            converged=i >= 5,
            failed={0: "white (Ljung-Box, 25 lags)", 1: "normal distribution"}.get(i, ""),
        )
        for i, rank in enumerate(ranks)
    ]
    return summarize_calibration(results, np.random.default_rng(1))


def test_one_bad_quantity_is_enough(summary: CalibrationSummary) -> None:
    assert summary.worst == "noise.sigma"
    assert summary.p_values["gain"] > 0.9
    assert summary.p_value == pytest.approx(2 * summary.p_values["noise.sigma"])
    assert not summary.calibrated


def test_nothing_is_left_out(summary: CalibrationSummary) -> None:
    assert summary.replicates == len(summary.ranks["gain"]) == REPLICATES
    assert summary.not_converged == 5
    assert summary.not_white == 1
    assert summary.seconds == 2.0


def test_coverage_of_the_axis_leaves_the_noise_out(summary: CalibrationSummary) -> None:
    assert summary.axis_coverage() == [0.5, 1.0, 1.0, 1.0]
    assert summary.coverage["noise.sigma"][0].achieved == 0.0
    assert summary.coverage_p_value < 1e-6
