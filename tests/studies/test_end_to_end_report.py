"""The first page says whether the intervals hold, and whether the check found the fault that it must."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from calibration_summary import CalibrationStudy, summarize_calibration
from pages.end_to_end_report import EndToEndStudy, end_to_end_report
from prior_calibration import DRAWS, CalibrationCase
from recovery import LEVELS
from recovery_summary import summarize_recovery

from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.provenance import provenance
from bayes_hw.report.page.document import Report, Table
from bayes_hw.report.page.render import to_html

FACTS = {
    "source": "drawn",
    "commands": "sweep",
    "noise": "AR(1), Student t",
    "rate_hz": 20.0,
    "true_order": 5,
    "true_modes": 1,
    "true_delay_s": 0.05,
}


def replicates(count: int, seed: int, narrow: float = 1.0) -> list[dict[str, Any]]:
    rng = np.random.default_rng(seed)
    names = ("saturation.lower", "dead_zone.half_width", "mode1.frequency_hz")
    extremity = np.clip(narrow * 2 * np.abs(0.5 - rng.random((count, 3))), 0, 1)
    return [
        {
            "inside": {n: [bool(x <= level) for level in LEVELS] for n, x in zip(names, row, strict=True)},
            "at_best": {name: [False, True, True] for name in names[1:]},
            "width": dict(zip(names, 1 + 0.2 * row, strict=True)),
            "lacking": [],
            "converged": True,
            "cpu_seconds": [1.0, 2.0],
            "facts": FACTS,
            "order": 8,
            "estimate": {"dead_zone.half_width": [0.006, 0.0079, 0.0002]},
        }
        for row in extremity
    ]


def ranks(model: HammersteinWiener) -> CalibrationStudy:
    rng = np.random.default_rng(1)
    results = [
        {
            "ranks": {"gain": rank, "noise.sigma": rank, "log_likelihood": rank},
            "inside": {name: [True] * 4 for name in ("gain", "noise.sigma")},
            "converged": True,
            "problems": [],
            "failed_tests": [],
            "seconds": 1.0,
        }
        for rank in rng.integers(0, DRAWS, size=60).tolist()
    ]
    one = summarize_calibration(results, rng)
    return CalibrationStudy(CalibrationCase(model, np.zeros(100)), one, {"sigma off": one}, {0: one}, (0.5,))


def page(model: HammersteinWiener, wide: float, capped: float, count: int = 60) -> Report:
    rng = np.random.default_rng(2)
    axes = replicates(count, 1, wide)
    twins, proxies = replicates(12, 4), replicates(12, 5, capped)
    study = EndToEndStudy(
        wide=summarize_recovery(axes, rng),
        effect_free=summarize_recovery(replicates(30, 3), rng),
        in_motion=summarize_recovery(replicates(30, 4), rng),
        twin=summarize_recovery(twins, rng),
        capped=summarize_recovery(proxies, rng),
        axes=tuple(axes),
        members=tuple(zip(twins, proxies, strict=True)),
        most_steps=1500,
        ranks=ranks(model),
    )
    return end_to_end_report(study, provenance("test", 1, [], 1.0))


@pytest.mark.slow
def test_intervals_that_hold_and_a_fault_that_is_found(small_axis: HammersteinWiener) -> None:
    report = page(small_axis, 1.0, 1.8)
    assert "every kind of parameter stays in its band" in report.verdict
    assert "fails as it must" in report.verdict
    states = {badge.label: badge.state for badge in report.badges}
    assert states["intervals hold"] == states["fault found"] == "good"
    assert "heavy tails" in to_html(report)
    section = next(part for part in report.sections if part.title == "Coverage")
    table = next(block for block in section.blocks if isinstance(block, Table))
    assert [row[-1] for row in table.rows] == ["", *["0.0 / 100.0 / 100.0"] * 3]


@pytest.mark.usefixtures("undrawn")
def test_narrow_intervals_and_a_missed_fault_are_said(small_axis: HammersteinWiener) -> None:
    report = page(small_axis, 1.8, 1.0)
    assert "NOT calibrated" in report.verdict
    assert "did NOT find" in report.verdict
    states = {badge.label: badge.state for badge in report.badges}
    assert states["intervals do not hold"] == states["fault missed"] == "bad"


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_few_axes_tell_nothing(small_axis: HammersteinWiener) -> None:
    report = page(small_axis, 1.0, 1.8, count=5)
    assert {badge.label: badge.state for badge in report.badges}["too few axes to tell"] == "warn"
    assert "is not excluded" in report.verdict


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_the_fault_stands_beside_the_defaults(small_axis: HammersteinWiener) -> None:
    """Kinds and twins are told both ways, and a twin that was refused says so."""
    report = page(small_axis, 1.0, 1.8)
    section = next(part for part in report.sections if part.title == "A check that can fail")
    by_kind, by_member = (block for block in section.blocks if isinstance(block, Table))
    defaults, proxy = (float(cell.split()[0]) for cell in by_kind.rows[-3][1:])
    assert defaults > 85 > proxy
    assert len(by_member.rows) == 12
    assert by_member.rows[0][4] == "0.00790 ± 0.00020"
    held = [row[3].split(" of ") for row in by_member.rows]
    assert sum(int(inside) for inside, _ in held) == round(36 * defaults / 100)
