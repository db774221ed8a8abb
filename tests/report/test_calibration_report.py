"""The verdict follows the ranks: good news only when the right likelihood passes and the wrong ones fail."""

import numpy as np
import pytest
from calibration_summary import CalibrationStudy, summarize_calibration
from pages.calibration_report import calibration_report
from prior_calibration import DRAWS, CalibrationCase

from bayes_hw.provenance import provenance
from bayes_hw.report.page.render import to_html


def replicates(count, seed, *, spread=1.0, white=True):
    """Results of `calibrate_once` whose ranks come from posteriors `spread` times too narrow."""
    rng = np.random.default_rng(seed)
    results = []
    for _ in range(count):
        extremity = np.clip(0.5 + spread * (rng.random(2) - 0.5), 0, 0.999)
        ranks = (extremity * (DRAWS + 1)).astype(int).tolist()
        distance = 2 * np.abs(extremity - 0.5)
        inside = [[bool(d <= p) for p in (0.5, 0.8, 0.94, 0.94)] for d in distance]
        results.append(
            {
                "ranks": {"gain": ranks[0], "noise.sigma": ranks[1], "log_likelihood": ranks[1]},
                "inside": {"gain": inside[0], "noise.sigma": inside[1]},
                "converged": True,
                "problems": [],
                "failed_tests": [] if white else ["white (Ljung-Box, 25 lags)"],
                "seconds": 1.0,
            }
        )
    return summarize_calibration(results, rng)


@pytest.fixture(scope="module")
def right():
    return replicates(300, 1)


@pytest.fixture(scope="module")
def wrong():
    return replicates(80, 2, spread=2.0, white=False)


def study(case_model, right, wrong):
    case = CalibrationCase(case_model, np.zeros(100))
    return CalibrationStudy(case, right, {"sigma off": wrong}, {0: wrong, 1: right}, (0.5,))


def page(result):
    return calibration_report(result, provenance("test", 1, [], 1.0))


def test_calibrated_and_able_to_fail(small_axis, right, wrong):
    result = study(small_axis, right, wrong)
    report = page(result)
    assert result.passed
    assert report.verdict.startswith("The posterior is calibrated: over 300 axes")
    assert "finds every likelihood that was made wrong on purpose (sigma off)" in report.verdict
    assert {badge.state for badge in report.badges} == {"good"}


@pytest.mark.usefixtures("undrawn")
def test_uncalibrated_comes_first(small_axis, right, wrong):
    report = page(study(small_axis, wrong, right))
    assert report.verdict.startswith("The posterior is NOT calibrated")
    assert "NOT found out by the same check: sigma off" in report.verdict
    assert [badge.state for badge in report.badges][:3] == ["bad", "bad", "bad"]


@pytest.mark.usefixtures("undrawn")
def test_order_table_shows_coverage_and_residual_test(small_axis, right, wrong):
    text = to_html(page(study(small_axis, right, wrong)))
    assert "80 of 80" in text
    assert "0 of 300" in text
    assert "AR(1) (true)" in text
