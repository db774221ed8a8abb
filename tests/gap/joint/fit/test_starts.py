"""A record held out that is cut out of a running operation is predicted from a state that fits it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from joint_axis import RATE, SIGMA, form, measured, response_with, some_effect

import bayes_hw as bw
from bayes_hw.arrays import FloatArray
from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.files import write_csv
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.starts import Starts
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.posing import counted_from
from bayes_hw.record import Record
from bayes_hw.record_start import record_start

EFFECTS = {
    "none": (),
    "friction": (some_effect(form("friction", "Coulomb, motor")),),
    "backlash": (some_effect(form("backlash", "dynamic")),),
}


def cut(record: Record, first: int) -> Record:
    """From a sample on, its angles counted from there, as commands do."""
    t = record.t[first:] - record.t[first]
    found = replace(record, t=t, u=record.u[first:], y=record.y[first:])
    begin = record_start(found.u, found.y, RATE)
    return found if begin.is_zero else counted_from(found, begin)


def rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def true_fit(effects: tuple[Effect, ...], record: Record) -> JointFit:
    response, values = response_with(effects, 400)
    response = replace(response, records=[record])
    return JointFit(response, evaluate(response, response.coordinates(values)))


@pytest.mark.parametrize(
    ("name", "first"), [pytest.param("friction", 1207, marks=pytest.mark.slow), ("backlash", 1555)]
)
def test_the_true_model_predicts_a_cut_record_as_well_as_its_noise_lets_it(name: str, first: int) -> None:
    """From rest it is off by several deviations; a record that begins at rest is left as it was."""
    train, whole = measured(EFFECTS[name], 2400, (1, 2))
    fit = true_fit(EFFECTS[name], train)
    assert not Starts.of(fit, [train], [whole]).moving
    record = cut(whole, first)
    starts = Starts.of(fit, [train], [record])
    scored = starts.unscored(record)
    assert 0 < scored < len(record) / 3
    errors = (record.y - starts.predict(fit, record))[scored:]
    from_rest = (record.y - Starts.of(fit, [train], [record], start="rest").predict(fit, record))[scored:]
    assert rms(errors) < 1.15 * SIGMA < 0.3 * rms(from_rest)


def test_what_records_at_rest_show_as_well_is_no_sign_of_motion() -> None:
    """A drift at every beginning, which the model lacks, is best explained by motion before the record; where
    the records trained on, which begin at rest, have it too, none is believed."""
    drift = 0.03 * np.exp(-np.arange(2400) / 60)
    plain, *held_out = measured(EFFECTS["none"], 2400, (1, 2))
    train, whole = (replace(record, y=record.y + drift) for record in (plain, *held_out))
    alone, fit = true_fit(EFFECTS["none"], plain), true_fit(EFFECTS["none"], train)
    assert Starts.of(alone, [plain], [whole]).moving
    assert not Starts.of(fit, [train], [whole]).moving


def test_draws_of_the_state_are_as_wide_as_it_is_uncertain() -> None:
    """Of the angle at the first samples, over records: standardised by the draws, errors are of size one."""
    effects = EFFECTS["none"]
    train, *others = measured(effects, 1800, tuple(range(1, 6)))
    fit, rng, found = true_fit(effects, train), np.random.default_rng(1), []
    for whole in others:
        record = cut(whole, 1207)
        starts = Starts.of(fit, [train], [record], start="free")
        drawn = np.array([starts.predict(fit, record, fit.values, rng) for _ in range(12)])
        truth = fit.response.simulate(fit.values, whole.u).y[1207:] - record.origin
        at = starts.unscored(record) + 10
        found.append((truth[at] - drawn[:, at].mean()) / max(float(drawn[:, at].std()), 1e-3 * SIGMA))
    assert 0.3 < rms(np.array(found)) < 2.0


@pytest.mark.slow
def test_a_diagnosis_scores_what_follows_the_beginning_and_says_so() -> None:
    train, whole = measured((), 1100, (1, 2))
    record = cut(whole, 500)
    found = diagnose_records([train], [record], np.random.default_rng(1))
    assert any("begins in motion" in note and "not scored" in note for note in found.verdict.notes)
    gap = found.verdict.gap_holdout
    assert gap.rmse_after < 1.5 * gap.noise_floor
    assert len(found.after) == len(record)
    inside = (found.low <= record.y) & (record.y <= found.high)
    assert inside.mean() > 0.85
    assert float(np.median(found.high - found.low)) < 6 * SIGMA
    from_rest = found.posterior.fit.response.simulate(found.posterior.fit.values, record.u).y
    assert rms((record.y - from_rest)[len(record) // 2 :]) > 3 * gap.rmse_after


def slewing(record: Record) -> Record:
    """The record beneath a slew that has begun long before it, without any rest."""
    return replace(record, u=record.u + 0.3, y=record.y + 0.2 * record.t)


def test_both_doors_refuse_to_train_on_what_never_rests(tmp_path: Path) -> None:
    train, held = measured((), 600, (1, 2))
    moving = slewing(train)
    with pytest.raises(InputError, match=r"begins in motion, and comes to rest nowhere.*start=\"rest\""):
        bw.diagnose([moving], [held])
    for record, name in ((moving, "a"), (held, "b")):
        write_csv(tmp_path / f"{name}.csv", {"t": record.t, "u": record.u, "y": record.y})
    given = ["diagnose", str(tmp_path / "a.csv"), "--holdout", str(tmp_path / "b.csv")]
    assert main([*given, "--out", str(tmp_path / "out")]) != 0
    assert not (tmp_path / "out").exists()
