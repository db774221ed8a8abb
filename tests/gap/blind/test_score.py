"""The score of a handful of cases, worked by hand."""

from __future__ import annotations

import json

import numpy as np
import pytest
from blind_cases import truth, verdict

from bayes_hw.gap.blind.evidence import FAILED, Evidence
from bayes_hw.gap.blind.score import GOALS, score_evidence, score_to_dict

TRUTHS = (
    truth("wind", gap=0.8, name="case_0000"),
    truth("friction", gap=2.5, name="case_0001"),
    truth(name="case_0002"),
    truth("other", name="case_0003"),
    truth("wind", "friction", name="case_0004"),
    truth("wind", name="case_0005"),
)
VERDICTS = (
    verdict("wind", block="disturbance", closed=0.5, closed_interval=(0.4, 0.9), before=np.array([1.0, 1.0]),
            after=np.array([0.5, 0.5])),
    verdict("backlash", sure=0.5, block="drive"),
    verdict("wind"),
    verdict("other"),
    verdict("wind"),
    FAILED,
)  # fmt: skip


def the_score():  # type: ignore[no-untyped-def]
    evidence = Evidence(TRUTHS, VERDICTS, "", "", "")
    return evidence, score_evidence(evidence, np.random.default_rng(1))


def test_headline_by_hand() -> None:
    _, score = the_score()
    counts = {name: (value.hits, value.trials) for name, value in score.headline.items()}
    assert counts == {
        "single effects named right": (1, 3),
        "single effects named, up to stated confusion": (1, 3),
        "single effects most probable": (1, 3),
        "block right": (2, 3),
        "no false alarm": (0, 1),
        "other said of off-catalogue": (1, 1),
        "both of a pair named": (0, 1),
        "at least one of a pair named": (1, 1),
        "right when 95 % sure or more": (2, 4),
        "closure interval holds": (1, 1),
        "base intervals hold": (0, 0),
    }
    assert set(GOALS) <= set(counts)


def test_groups_closure_and_failures() -> None:
    _, score = the_score()
    assert {name: (s.hits, s.trials) for name, s in score.by_effect.items()} == {
        "friction": (0, 1),
        "wind": (1, 2),
    }
    assert {name: (s.hits, s.trials) for name, s in score.by_strength.items()} == {
        "0 to 1": (1, 1),
        "2 to 3": (1, 4),
    }
    winds = score.figures_by_effect["wind"]
    assert {name: (s.hits, s.trials) for name, s in winds.items()} == {
        "named right": (1, 2),
        "most probable": (1, 2),
        "block right": (1, 2),
        "closure interval holds": (1, 1),
        "base intervals hold": (0, 0),
    }
    assert list(score.figures_by_strength) == ["0 to 1", "2 to 3"]
    assert score.failed == 1
    (closure,) = score.closures
    assert closure.true == pytest.approx(0.75)
    assert closure.held


def test_chance_by_hand() -> None:
    """Without the pair: wind twice, friction, none, other once each of five."""
    _, score = the_score()
    assert score.chance == pytest.approx({"uniform": 1 / 19, "by frequency": 7 / 25, "most frequent": 0.4})


def test_score_json_holds_numbers_only() -> None:
    evidence, score = the_score()
    content = json.loads(json.dumps(score_to_dict(score, evidence), allow_nan=False))
    assert content["headline"]["block right"]["share"] == pytest.approx(2 / 3)
    assert content["confusion"]["wind"] == {"wind": 1, "no verdict": 1}
