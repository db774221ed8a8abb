"""The sentence on an answer says when it helps, and when it does not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Verdict
from bayes_hw.gap.joint.finding import sentence, unfollowed
from bayes_hw.record import Record


def said(closed: float, interval: tuple[float, float], fitted: float = 0.01) -> str:
    """Of friction that closes so much of record c, where its error is 0.01, and `fitted` on the others."""
    verdict = SimpleNamespace(
        answer=("friction",),
        probability={"friction": 0.99},
        base={},
        gap_train=Closure(0.02, fitted, 0.005, 0.9, (0.8, 1.0)),
        gap_holdout=Closure(0.02, 0.01, 0.005, closed, interval),
    )
    return sentence(cast(Verdict, verdict), simulated=True, held_out="c")


@pytest.mark.parametrize(
    ("closed", "interval", "end"),
    [
        (0.8, (0.7, 0.9), "80 % of the avoidable error is gone on c, held out."),
        (-0.02, (-0.3, 0.2), "0 % of the avoidable error is gone on c, held out."),
        (-18.0, (-20.0, -16.0), "c, held out, is predicted worse than without."),
    ],
)
def test_a_record_that_is_predicted_worse_is_told(
    closed: float, interval: tuple[float, float], end: str
) -> None:
    assert said(closed, interval).endswith(end)


def test_an_explanation_that_the_record_held_out_refutes_is_not_said_to_be_sure() -> None:
    """One sentence, friction named, without the 99 % that the records trained on speak for it."""
    refuted, held = said(-2.3, (-2.4, -2.2)), said(0.8, (0.7, 0.9))
    assert "in doubt" in refuted and "friction" in refuted
    assert refuted.count(".") == 1
    assert "sure" in held and "sure" not in refuted


def test_a_record_held_out_that_the_answer_fails_on_comes_first() -> None:
    """Its error is five times that on the records fitted to."""
    failed = said(0.8, (0.7, 0.9), fitted=0.002)
    assert failed.startswith("Model and record held out disagree: its error there is 5 times")
    assert failed.endswith(said(0.8, (0.7, 0.9)))


def test_records_that_do_not_follow_tell_nothing() -> None:
    """A drive that was off; beside a record that follows it is not said of all."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, 60), 50)
    off = Record.from_arrays(np.arange(3000) / 50, u, 1e-3 * rng.standard_normal(3000))
    on = replace(off, y=np.cumsum(u) / 50)
    assert "does not follow" in unfollowed([off])
    assert unfollowed([off, on]) == ""
