"""verdict.json: the keys of the format, and numbers that are not finite."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arviz_stats.base import array_stats

from bayes_hw.gap.answer.locate import Location
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate, Verdict, highest_density_interval
from bayes_hw.gap.effects.labels import LABEL_BLOCKS

KEYS = {
    *("schema", "answer", "probability", "confusable", "where", "gap", "parameters", "base"),
    *("next_experiment", "seconds"),
}
GAP_KEYS = {"rmse_before", "rmse_after", "noise_floor", "closed", "closed_hdi94"}


@pytest.fixture
def verdict() -> Verdict:
    where = Location("drive", {"drive": 1.0}, (0.1, 0.4), "reversing", {"all": 2.0}, {"u": 0.1}, (1.0,))
    gap = Closure(0.02, 0.01, 0.01, float("nan"), (float("-inf"), 0.9))
    size = Estimate(0.01, 0.001, (0.008, 0.012), "deg")
    probability = {"none": 0.01, "other": 0.02, **dict.fromkeys(LABEL_BLOCKS, 0.001)}
    return Verdict(
        answer=("backlash",),
        probability=probability,
        confusable=[("backlash", "friction")],
        where=where,
        gap_train=gap,
        gap_holdout=gap,
        parameters={"backlash.half_gap": size},
        base={"gain": size},
        next_experiment="slow reversals",
        seconds=1.5,
    )


def test_an_answer_is_as_certain_as_its_least_certain_label(verdict: Verdict) -> None:
    """An empty one as it is that nothing is missing."""
    two = replace(verdict, answer=("backlash", "other"))
    assert verdict.certainty == two.probability["backlash"] == 0.001
    assert replace(two, probability={**two.probability, "backlash": 0.5}).certainty == 0.02
    assert replace(verdict, answer=()).certainty == 0.01


def test_keys_are_those_of_the_format(verdict: Verdict, tmp_path: Path) -> None:
    verdict.write(tmp_path / "verdict.json")
    content = json.loads((tmp_path / "verdict.json").read_text())
    assert set(content) >= KEYS
    assert content["schema"] == "bayes-hw/verdict/1"
    assert content["answer"] == ["backlash"] and content["confusable"] == [["backlash", "friction"]]
    assert set(content["probability"]) == {*LABEL_BLOCKS, "none", "other"}
    assert set(content["gap"]) == {"train", "holdout"}
    assert set(content["gap"]["holdout"]) == GAP_KEYS
    assert set(content["where"]) >= {"block", "band_hz", "regime", "share"}
    for entry in (*content["parameters"].values(), *content["base"].values()):
        assert set(entry) == {"mean", "sd", "hdi94", "unit"}
    assert content["next_experiment"] == "slow reversals"


def test_numbers_that_are_not_finite_are_null(verdict: Verdict, tmp_path: Path) -> None:
    verdict.write(tmp_path / "verdict.json")
    text = (tmp_path / "verdict.json").read_text()
    assert "NaN" not in text and "Infinity" not in text
    gap = json.loads(text)["gap"]["train"]
    assert gap["closed"] is None and gap["closed_hdi94"] == [None, 0.9]


def test_an_estimate_of_draws() -> None:
    """Mean, standard deviation and the shortest interval of normal draws."""
    draws = np.random.default_rng(1).normal(3, 0.5, 20_000)
    found = Estimate.of(draws, "deg")
    assert found.mean == pytest.approx(3, abs=0.02) and found.sd == pytest.approx(0.5, rel=0.03)
    assert found.hdi94 == pytest.approx((3 - 0.94, 3 + 0.94), abs=0.06)


@pytest.mark.parametrize("relative_error", [1e-6, 0.05, 1.0])
def test_an_estimate_of_a_positive_parameter(relative_error: float) -> None:
    """Moments and shortest interval are those of log-normal draws, which stay positive however uncertain."""
    found = Estimate.log_normal(59.0, relative_error, "Hz")
    draws = 59.0 * np.exp(relative_error * np.random.default_rng(2).standard_normal(1_000_000))
    drawn = Estimate.of(draws, "Hz")
    spread = found.sd
    assert found.mean == pytest.approx(drawn.mean, abs=0.005 * spread)
    assert spread == pytest.approx(drawn.sd, rel=0.02)
    assert found.hdi94 == pytest.approx(drawn.hdi94, abs=0.05 * spread)
    assert 0 < found.hdi94[0] < found.hdi94[1]


def test_an_estimate_without_error() -> None:
    """A parameter that is known, such as a share of repeated samples that is all of them."""
    found = Estimate.log_normal(1.0, 0.0, "")
    assert (found.mean, found.sd, found.hdi94) == (1.0, 0.0, (1.0, 1.0))


@pytest.mark.parametrize("count", [1, 7, 2048])
def test_the_highest_density_interval_is_that_of_arviz(count: int) -> None:
    draws = np.random.default_rng(count).gamma(2.0, size=count)
    np.testing.assert_allclose(highest_density_interval(draws, 0.94), array_stats.hdi(draws, 0.94))


def test_draws_that_never_change_have_no_spread() -> None:
    """Their mean is off by rounding, which is no standard deviation."""
    held = np.full(1000, 0.0142999169816044151)
    assert held.std() > 0
    estimate = Estimate.of(held, "deg")
    assert (estimate.mean, estimate.sd) == (held[0], 0.0)
