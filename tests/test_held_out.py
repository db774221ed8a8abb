"""What is held out where nobody said, that a last third is simulated from where its record begins, and that
what is trained on begins at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import simulated_records
from joint_axis import measured

from bayes_hw.errors import InputError
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.held_out import held_out_of
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import posed
from bayes_hw.record import Record


def test_what_is_given_stays() -> None:
    first, second = measured((), 60, (1, 2))
    chosen = held_out_of([first], [second])
    assert (chosen.train, chosen.holdout, chosen.lead, chosen.notes) == ((first,), (second,), 0, ())


def test_of_several_alike_the_last() -> None:
    first, second, third = measured((), 60, (1, 2, 3))
    chosen = held_out_of([first, second, third], [])
    assert chosen.train == (first, second) and chosen.holdout == (third,)
    assert third.name in chosen.notes[0]


def test_of_two_records_no_more_than_a_third_of_all() -> None:
    first, second = measured((), 60, (1, 2))
    chosen = held_out_of([first, second], [])
    assert chosen.train[0] is first and len(chosen.train[1]) == chosen.lead == 20
    assert chosen.holdout == (second,)
    assert "the last 2 s of" in chosen.notes[0]


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


@pytest.fixture
def in_motion(small_axis: HammersteinWiener) -> Record:
    """A record that moves for two seconds, rests for six and moves again."""
    record = simulated_records.measured(small_axis, 1200, seed=4)
    u = record.u.copy()
    u[:80], u[80:200] = 0.6, 0.0
    y = small_axis.simulate(u).y + 0.001 * np.random.default_rng(1).standard_normal(1200)
    (found,) = posed([replace(record, u=u, y=y).window(2.0, 60.0)]).records
    return found


def test_a_record_in_motion_is_trained_on_from_where_it_first_rests(
    small_axis: HammersteinWiener, in_motion: Record
) -> None:
    """Its angles count from there; one that never rests is refused in a sentence."""
    holdout = simulated_records.measured(small_axis, 600, seed=5)
    chosen = held_out_of([in_motion], [holdout])
    assert len(chosen.notes) == 1 and "left out" in chosen.notes[0]
    (train,) = chosen.train
    assert 600 < len(train) < len(in_motion) and abs(float(train.y[:20].mean())) < 0.005
    assert chosen.holdout == (holdout,)
    (absolute,) = held_out_of([in_motion], [holdout], origin="absolute").train
    assert absolute.origin == in_motion.origin and len(absolute) == len(train)
    still = simulated_records.measured(small_axis, 600, seed=6, rest=40)
    assert held_out_of([still], [holdout]).train == (still,)
    assert held_out_of([in_motion], [holdout], "rest").train == (in_motion,)
    restless = replace(in_motion, u=np.where(in_motion.u == 0, 0.1, in_motion.u))
    with pytest.raises(InputError, match="begins in motion, and comes to rest nowhere"):
        held_out_of([restless], [holdout])


def test_a_last_record_in_motion_is_held_out_whole(small_axis: HammersteinWiener, in_motion: Record) -> None:
    first, second = (simulated_records.measured(small_axis, 1200, seed=seed, rest=40) for seed in (6, 7))
    chosen = held_out_of([first, second, in_motion], [])
    assert chosen.holdout == (in_motion,) and len(chosen.notes) == 1
