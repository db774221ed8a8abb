"""What is held out where nobody said, and that a last third is simulated from where its record begins."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import measured

from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.held_out import held_out_of


def test_what_is_given_stays() -> None:
    first, second = measured((), 60, (1, 2))
    chosen = held_out_of([first], [second])
    assert (chosen.train, chosen.holdout, chosen.lead, chosen.said) == ((first,), (second,), 0, "")


def test_of_several_alike_the_last() -> None:
    first, second, third = measured((), 60, (1, 2, 3))
    chosen = held_out_of([first, second, third], [])
    assert chosen.train == (first, second) and chosen.holdout == (third,)
    assert third.name in chosen.said


def test_of_two_records_no_more_than_a_third_of_all() -> None:
    first, second = measured((), 60, (1, 2))
    chosen = held_out_of([first, second], [])
    assert chosen.train[0] is first and len(chosen.train[1]) == chosen.lead == 20
    assert chosen.holdout == (second,)
    assert "the last 2 s of" in chosen.said


def test_a_last_record_that_is_a_little_longer_is_held_out_whole() -> None:
    first, second = measured((), 60, (1, 2))
    (third,) = measured((), 66, (3,))
    chosen = held_out_of([first, second, third], [])
    assert chosen.train == (first, second) and chosen.holdout == (third,) and chosen.lead == 0


@pytest.mark.compiles("cascades")
def test_of_one_record_the_last_third_which_is_scored_alone() -> None:
    (record,) = measured((), 900, (1,))
    chosen = held_out_of([record], [])
    assert (len(chosen.train[0]), chosen.lead) == (600, 600)
    found = diagnose_records(chosen.train, chosen.holdout, np.random.default_rng(1), lead=chosen.lead)
    assert len(found.after) == len(found.holdout[0]) == 300
    assert found.holdout[0].t[0] == pytest.approx(record.t[600])
    gap = found.verdict.gap_holdout
    assert gap.rmse_after < 1.5 * gap.noise_floor
