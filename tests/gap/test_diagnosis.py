"""The whole diagnosis of one simulated case with a large gap."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind_check.ballot import Ballot, ballot_of
from drive_axis import RATE, SIGMA, coloured, command
from fitted import AXIS, simulated_with

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.simulator import simulate_loop
from bayes_hw.errors import InputError
from bayes_hw.file_schemas import check_file
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.notes import of_left_out
from bayes_hw.gap.answer.sentence import sentence
from bayes_hw.gap.answer.train_axis import TrainAxis
from bayes_hw.gap.any_corrected import read_corrected_axis
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.criticism.left_out import LeftOut
from bayes_hw.gap.diagnosis import Diagnosis, diagnose
from bayes_hw.gap.effects.catalogue import EncoderEccentricity
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.answer.corrected_model import predict_corrected, read_corrected, simulate_corrected
from bayes_hw.model.blocks import Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SAMPLES = 500
SEEDS = (69, 78, 74)
"""Of the commands; the record held out, the last, stays within the travel of the others."""

ECCENTRICITY = (0.02, 0.012, 0.5)
TRUE_SIZE = float(np.hypot(*ECCENTRICITY[:2]))
STRUCK = frozenset({"unmodelled_mode", "cubic_stiffness", "friction", "torque_ripple"})
"""Left out for speed."""


@pytest.fixture(scope="module")
def clean() -> list[np.ndarray]:
    inputs = [command(SAMPLES, seed) for seed in SEEDS]
    return simulated_with(EncoderEccentricity(), ECCENTRICITY, inputs)


@pytest.fixture(scope="module")
def case(clean: list[np.ndarray]) -> Case:
    """Two records to train on and one held out; the nominal limits and gain are off."""
    t = np.arange(SAMPLES) / RATE
    records = [
        Record(
            str(seed), t, command(SAMPLES, seed), y + coloured(SAMPLES, SIGMA, 0.3, seed), RATE, AXIS.units
        )
        for seed, y in zip(SEEDS, clean, strict=True)
    ]
    linear = replace(AXIS.linear, gain=1.03 * AXIS.linear.gain)
    nominal = replace(AXIS, linear=linear, saturation=Saturation(-0.31, 0.31))
    return Case.of_records("tiny", nominal, records[:2], records[2:])


@pytest.fixture(scope="module")
def diagnosis(case: Case) -> Diagnosis:
    return diagnose(case, np.random.default_rng(1), jobs=1, without=STRUCK)


def test_its_ballot_judged_again_gives_the_same_verdict(diagnosis: Diagnosis) -> None:
    """Read back as from its file; other constants make another answer of it."""
    labels = [name for name in diagnosis.verdict.probability if name not in ("none", "other")]
    constants = Calibration.built_in()
    content = json.loads(json.dumps(ballot_of(diagnosis, labels, constants).to_dict(), allow_nan=False))
    ballot = Ballot.from_dict(content)
    judgement = ballot.judge(constants)
    assert judgement.answer == diagnosis.verdict.answer
    assert dict(judgement.probability) == pytest.approx(dict(diagnosis.verdict.probability), abs=1e-12)
    assert () in ballot.remains
    cautious = replace(constants, single_gain=1e6)
    assert ballot.judge(cautious).answer != judgement.answer


@pytest.mark.parametrize(("costs", "doubted"), [
    ((100.0, 103.9, 500.0), False), ((100.0, 104.1, 500.0), True), ((100.0,), False),
])  # fmt: skip
def test_starts_that_disagree_are_said_before_anything_else(
    diagnosis: Diagnosis, costs: tuple[float, ...], doubted: bool
) -> None:
    """Only one start reached the best fit of the base model: all else rests on it."""
    found = replace(diagnosis, attribution=replace(diagnosis.attribution, base_costs=costs))
    assert sentence(found).startswith("In doubt") == doubted
    assert "Model and records differ by" in sentence(found)


def test_names_the_effect_and_its_size(diagnosis: Diagnosis) -> None:
    """Label, block, probability, parameters within five standard deviations."""
    verdict = diagnosis.verdict
    assert verdict.answer == ("encoder_eccentricity",)
    assert verdict.where.block == "sensor"
    assert verdict.probability["encoder_eccentricity"] > 0.9 > 0.1 > verdict.probability["none"]
    assert set(verdict.probability) == {"none", "other", *LABEL_BLOCKS} - STRUCK
    sizes = verdict.parameters
    size = np.hypot(sizes["encoder_eccentricity.sine"].mean, sizes["encoder_eccentricity.cosine"].mean)
    assert size == pytest.approx(TRUE_SIZE, rel=0.15)
    period = sizes["encoder_eccentricity.period"]
    assert abs(period.mean - ECCENTRICITY[2]) < 5 * period.sd
    assert "eccentric" in diagnosis.sentence()


@pytest.mark.slow
def test_a_gap_that_nothing_explains_is_measured_against_the_encoder_noise(case: Case) -> None:
    """With the effect struck from a catalogue of two others: the noise that takes up the gap is no floor."""
    tried = {"command_bias", "gain_asymmetry"}
    found = diagnose(case, np.random.default_rng(1), without=frozenset(set(LABEL_BLOCKS) - tried))
    assert found.verdict.answer == ("other",)
    for gap in (found.verdict.gap_train, found.verdict.gap_holdout):
        assert gap.noise_floor == pytest.approx(SIGMA, rel=0.5)
        assert gap.rmse_before > 2 * gap.noise_floor
        assert gap.closed == 0.0
    low, high = found.verdict.base["noise.sigma"].hdi94
    assert low < SIGMA < gap.noise_floor < high
    assert max(found.verdict.where.segments) > 2
    assert "differ by 0 times" not in sentence(found)
    assert "It acts in the encoder" in sentence(found)


def test_base_parameters_are_estimated_beside_it(diagnosis: Diagnosis) -> None:
    base = diagnosis.verdict.base
    truth = {
        "saturation.lower": AXIS.saturation.lower,
        "saturation.upper": AXIS.saturation.upper,
        "dead_zone.half_width": AXIS.dead_zone.half_width,
        "gain": AXIS.linear.gain,
        "noise.sigma": SIGMA,
    }
    for name, value in truth.items():
        assert abs(base[name].mean - value) < 5 * base[name].sd, name
    assert {"mode1.frequency_hz", "mode2.damping_ratio"} <= set(base)


def test_the_gap_shrinks_to_the_floor(diagnosis: Diagnosis, clean: list[np.ndarray], case: Case) -> None:
    """Said and true closed fraction on the record held out, by the noise-free output; the band covers."""
    gap = diagnosis.verdict.gap_holdout
    true = 1 - np.mean((diagnosis.after - clean[2]) ** 2) / np.mean((diagnosis.before - clean[2]) ** 2)
    assert true > 0.9
    assert gap.closed == pytest.approx(true, abs=0.08)
    assert gap.closed_hdi94[0] - 0.03 <= true <= gap.closed_hdi94[1] + 0.03
    assert gap.rmse_after == pytest.approx(SIGMA, rel=0.2)
    assert gap.rmse_before > 1.5 * gap.rmse_after
    y = case.holdout[0].y
    assert 0.88 < np.mean((diagnosis.low <= y) & (y <= diagnosis.high)) <= 0.99


def test_writes_all_files(diagnosis: Diagnosis, case: Case, tmp_path: Path) -> None:
    out = tmp_path / "new"
    diagnosis.write(out)
    content = json.loads((out / "verdict.json").read_text())
    assert content["answer"] == ["encoder_eccentricity"] and content["seconds"] > 0
    with (out / "holdout_prediction.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert header[:5] == ["t", "before", "after", "lo", "hi"]
    table = np.array(rows, dtype=float)
    np.testing.assert_allclose(table[:, 0], case.holdout[0].t)
    assert (table[:, 3] < table[:, 2]).all() and (table[:, 2] < table[:, 4]).all()
    written = {path.name for path in out.iterdir()}
    assert written == {"verdict.json", "holdout_prediction.csv", "corrected.json"}


def test_the_missing_force_is_written_for_other_alone(diagnosis: Diagnosis, tmp_path: Path) -> None:
    """Both training records, one below the other; gone with the next answer of another kind."""
    other = replace(diagnosis, verdict=replace(diagnosis.verdict, answer=("other",)))
    other.write(tmp_path)
    with (tmp_path / "free_residual.csv").open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    assert [row["record"] for row in rows] == ["0"] * SAMPLES + ["1"] * SAMPLES
    residual = np.concatenate(diagnosis.attribution.base.fit.residuals)
    shown = np.array([float(row["response"]) for row in rows])
    assert np.mean((residual - shown) ** 2) < 0.5 * np.mean(residual**2)
    diagnosis.write(tmp_path)
    assert not (tmp_path / "free_residual.csv").exists()


def test_held_out_outputs_are_never_fitted(case: Case, diagnosis: Diagnosis) -> None:
    """Another output of the record held out: predictions and parameters stay, the score moves."""
    held = case.holdout[0]
    spoilt = replace(case, holdout=(replace(held, y=held.y + 0.1),))
    again = diagnose(spoilt, np.random.default_rng(1), jobs=1, without=STRUCK)
    np.testing.assert_array_equal(again.before, diagnosis.before)
    np.testing.assert_array_equal(again.after, diagnosis.after)
    assert again.verdict.answer == diagnosis.verdict.answer
    assert again.verdict.probability == diagnosis.verdict.probability
    assert again.verdict.gap_holdout.rmse_after > 5 * diagnosis.verdict.gap_holdout.rmse_after


@pytest.mark.parametrize(("error", "said"), [(8.0, 0), (4.0, 1)])
def test_another_answer_is_spoken_of_where_left_out_blocks_are_clearly_for_it(
    error: float, said: int
) -> None:
    """Twenty nats behind are three standard errors or not."""
    compared = {("wind",): LeftOut(-20.0, error, 0.1), (): LeftOut(0.0, 0.0, 0.9)}
    notes = of_left_out(("wind",), compared)
    assert len(notes) == said
    assert all("better by no effect, by 20 ± 4 " in note for note in notes)
    assert of_left_out((), compared) == of_left_out(("friction",), compared) == []


def test_its_corrected_model_simulates_and_predicts_what_it_said(
    diagnosis: Diagnosis, case: Case, tmp_path: Path
) -> None:
    """From the file alone: the record held out to the last digit, and a band that holds it."""
    diagnosis.write(tmp_path)
    data = read_corrected(tmp_path / "corrected.json")
    assert data is not None and [item["label"] for item in data["effects"]] == ["encoder_eccentricity"]
    (held_out,) = case.holdout
    simulation = simulate_corrected(data, held_out.u)
    np.testing.assert_allclose(simulation.y, diagnosis.after, atol=1e-12)
    assert np.std(held_out.y - simulation.y) < 0.7 * np.std(held_out.y - diagnosis.before)
    mean, low, high = predict_corrected(data, held_out.u)
    np.testing.assert_allclose(mean, diagnosis.after, atol=1e-12)
    assert 0.88 < float(np.mean((low < held_out.y) & (held_out.y < high))) < 0.99
    model = HammersteinWiener.from_dict(data)
    assert model.saturation.upper == pytest.approx(diagnosis.verdict.base["saturation.upper"].mean, rel=0.02)
    assert check_file(tmp_path / "corrected.json") == "model"


def test_its_corrected_model_is_an_axis_to_design_with(
    diagnosis: Diagnosis, case: Case, tmp_path: Path
) -> None:
    """From the file alone: draws about the verdict's numbers, its words, the effect in a loop, and what a
    command would tell of it: nothing where the axis stands still, more the longer it moves."""
    diagnosis.write(tmp_path)
    axis = read_corrected_axis(tmp_path)
    assert isinstance(axis, TrainAxis) and axis.simulated
    for name, estimate in diagnosis.verdict.base.items():
        if name != "noise.sigma":
            assert abs(axis.posterior.summaries[name].mean - estimate.mean) < estimate.sd
    assert axis.answer == ("encoder_eccentricity",) and "% sure" in axis.words
    assert axis.motion["velocity"] == max(np.abs(r.u).max() for r in case.train)
    values = axis.posterior.draws(5, np.random.default_rng(1))
    plain = AxisDraws.of_posterior(axis.posterior, values)
    draws = replace(plain, effect=axis.loop_of(values))
    controller, reference = Controller("P", 20.0, 0.5), np.linspace(0.0, 3.0, 200)
    shown = [simulate_loop(one, controller, reference).y for one in (draws, plain)]
    assert np.abs(shown[0] - shown[1]).max() > 3 * diagnosis.case.model.noise_sigma
    told = axis.expected_information()
    (u, *_) = (r.u for r in case.train)
    still, half, whole = (told.nats(u * share) for share in (0.0, 0.5, 1.0))
    assert abs(still) < 1e-6 < half < whole and told.narrowing(u) < 0.8
    assert told.outputs(u).shape[1] == len(u)


@pytest.mark.parametrize(
    "change", [{"effects": ["slip (silent)"]}, {"values": [1.0]}, {"scale": {}}, {"draws": [["a"]]}]
)
def test_a_damaged_corrected_model_is_refused(
    diagnosis: Diagnosis, tmp_path: Path, change: dict[str, object]
) -> None:
    diagnosis.write(tmp_path)
    data = read_corrected(tmp_path / "corrected.json")
    assert data is not None
    with pytest.raises(InputError, match=r"give a corrected\.json"):
        simulate_corrected({**data, "train": {**data["train"], **change}}, np.zeros(10))


@pytest.mark.slow
def test_an_estimated_level_changes_no_verdict(case: Case, diagnosis: Diagnosis) -> None:
    """Records that count from levels a deviation and more off; predictions are of the angles themselves."""
    off = (0.9, -1.4, 1.2)
    moved = [
        replace(record, y=record.y - by * SIGMA, origin=by * SIGMA, level_sd=SIGMA)
        for record, by in zip((*case.train, *case.holdout), off, strict=True)
    ]
    shifted = Case.of_records("shifted", case.model, moved[:2], moved[2:])
    found = diagnose(shifted, np.random.default_rng(1), jobs=1, without=STRUCK)
    assert found.verdict.answer == diagnosis.verdict.answer
    name = "encoder_eccentricity.period"
    ours, theirs = found.verdict.parameters[name], diagnosis.verdict.parameters[name]
    assert abs(ours.mean - theirs.mean) < theirs.sd
    assert found.verdict.gap_holdout.closed == pytest.approx(diagnosis.verdict.gap_holdout.closed, abs=0.05)
    apart = found.after + found.case.holdout[0].origin - diagnosis.after
    assert np.abs(apart).mean() < 0.5 * SIGMA
