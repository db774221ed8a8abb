"""Bands and counts of a calibration from records alone: right intervals pass, narrow ones are found out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from recovery import LEVELS
from recovery_summary import coverage_band, kind_of, summarize_recovery

NAMES = ("saturation.lower", "saturation.upper", "dead_zone.half_width", "mode1.frequency_hz")


def replicates(count: int, seed: int, *, narrow: float = 1.0) -> list[dict[str, Any]]:
    """Results of `recover` whose estimates are normal and whose intervals are `narrow` times too narrow."""
    rng = np.random.default_rng(seed)
    extremity = 2 * np.abs(0.5 - rng.random((count, len(NAMES))))
    shrunk = np.clip(extremity * narrow, 0, 1)
    return [
        {
            "inside": {n: [bool(x <= level) for level in LEVELS] for n, x in zip(NAMES, row, strict=True)},
            "at_best": {name: [True, True, True] for name in NAMES if name != NAMES[-1]},
            "width": dict.fromkeys(NAMES, 1.1),
            "lacking": [],
            "converged": True,
            "cpu_seconds": [1.0, 2.0],
            "facts": {"true_modes": 1},
        }
        for row in shrunk
    ]


@pytest.mark.slow
def test_right_intervals_stay_in_their_bands_in_nineteen_of_twenty_studies() -> None:
    rng = np.random.default_rng(1)
    held = [summarize_recovery(replicates(40, seed), rng).holds for seed in range(40)]
    assert 33 <= sum(held) <= 40


def test_intervals_of_half_their_width_are_found_out() -> None:
    summary = summarize_recovery(replicates(12, 3, narrow=1.6), np.random.default_rng(1))
    assert not summary.holds
    assert summary.outside()


def test_counts_are_pooled_by_kind() -> None:
    results = replicates(5, 4)
    results[0]["lacking"] = ["mode1"]
    results.append({"refused": "no excitation", "facts": {"true_modes": 2}})
    summary = summarize_recovery(results, np.random.default_rng(1))
    assert summary.coverage["limits"][0].replicates == 10
    assert summary.coverage["dead zone"][-1].inside == sum(
        r["inside"]["dead_zone.half_width"][-1] for r in results[:5]
    )
    assert (summary.axes, summary.refused, summary.converged) == (6, 1, 5)
    assert (summary.modes, summary.lacking) == (7, 1)
    assert summary.median_width == pytest.approx(1.1)
    assert summary.seconds == pytest.approx(3.0)
    assert summary.all_parameters.replicates == 20


def test_misses_are_told_from_those_of_the_noise() -> None:
    """Paired with the estimate at best by name: what has none, and modes that the fit lacks, do not count."""
    results = replicates(2, 5)
    results[0]["inside"] = {NAMES[0]: [False] * 3, NAMES[2]: [False, True, True], NAMES[3]: [False] * 3}
    results[0]["at_best"] = {NAMES[0]: [False] * 3, NAMES[1]: [False] * 3, NAMES[2]: [True] * 3}
    results[1]["inside"] = {NAMES[0]: [False] * 3, NAMES[1]: [True] * 3}
    summary = summarize_recovery(results, np.random.default_rng(1))
    assert (summary.missed, summary.missed_alone) == (2, 1)
    assert [entry.inside for entry in summary.at_best["limits"]] == [2, 2, 2]
    assert summary.at_best["limits"][-1].replicates == 3
    assert "mode frequencies" not in summary.at_best
    assert summary.all_at_best[0].replicates == 4
    assert summary.to_dict()["all_at_best"][0]["hits"] == 3


def test_names_belong_to_kinds() -> None:
    assert kind_of("mode3.damping_ratio") == "mode damping ratios"
    assert kind_of("noise.sigma") == "noise"


def test_a_band_holds_its_nominal_counts_and_not_all_of_them() -> None:
    size = 200
    band, p_value = coverage_band(
        {"limits": np.round(size * np.array(LEVELS)).astype(np.int64)},
        {"limits": size},
        np.random.default_rng(2),
    )
    nominal = size * np.array(LEVELS)
    assert np.all(band["limits"][0] < nominal)
    assert np.all(band["limits"][1] > nominal)
    assert band["limits"][1][0] < 0.62 * size
    assert p_value > 0.9
