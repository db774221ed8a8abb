"""A blind check from end to end with stand-in diagnoses: sealed, unseen, resumable, and tamper-evident."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Generator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from serial_executor import SerialExecutor

from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.executor import Outcome, TaskFunction, run_task
from bayes_hw.gap.blind.evidence import read_evidence
from bayes_hw.gap.blind.folders import ORIGIN, folder_digest, read_seal, read_truth
from bayes_hw.gap.blind.make import make_set
from bayes_hw.gap.blind.run import failures, run_set
from bayes_hw.gap.blind.score import score_evidence
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

HERE = SerialExecutor()
LABELS = [["encoder_quantization"], [], ["wind", "outliers"]]
SHORT = {"durations_s": (40.0,)}
FILES = ["case.json", "holdout.csv", "model.json", "train_1.csv", "train_2.csv", "train_3.csv"]


@pytest.fixture(scope="module")
def blind_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("blind") / "set"
    make_set(folder, 3, 5, "easy", labels=LABELS, changes=SHORT, executor=HERE)
    return folder


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands need no worker processes."""
    monkeypatch.setattr("bayes_hw.executor.make_executor", lambda *_: HERE)


@pytest.fixture
def copied(blind_set: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(blind_set, tmp_path / "set"))


@pytest.mark.compiles("cascades")
def test_cases_are_in_the_fixed_format(blind_set: Path) -> None:
    """Every record can be read, the model too, at one rate; the commands are as sealed."""
    for number in range(3):
        case = blind_set / "cases" / f"case_{number:04d}"
        assert sorted(path.name for path in case.iterdir()) == FILES
        model = HammersteinWiener.read(case / "model.json")
        for name in FILES:
            if name.endswith(".csv"):
                record = Record.read(case / name)
                assert record.sample_rate_hz == pytest.approx(model.sample_rate_hz)
                assert len(record) == 800


def test_truth_says_what_the_records_carry(blind_set: Path) -> None:
    files = read_truth(blind_set / "truth.zip")
    truths = [json.loads(files[f"case_{number:04d}.json"]) for number in range(3)]
    assert [t["effects"] for t in truths] == LABELS
    assert all(1.4 < gap < 6.4 for t in truths for gap in t["gap_over_sigma"])
    record = Record.read(blind_set / "cases" / "case_0001" / "holdout.csv")
    clean = np.array([float(x) for x in files["case_0001_holdout.csv"].split()])
    assert np.std(record.y - clean) == pytest.approx(truths[1]["base"]["noise.sigma"], rel=0.06)


@pytest.mark.slow
def test_same_seed_same_bytes_and_another_seed_other_ones(blind_set: Path, tmp_path: Path) -> None:
    make_set(tmp_path / "again", 1, 5, "easy", labels=LABELS[:1], changes=SHORT, executor=HERE)
    seals = [
        make_set(tmp_path / name, 1, seed, labels=[[]], changes=SHORT, executor=HERE)
        for name, seed in (("a", 5), ("b", 6), ("c", 5))
    ]
    assert seals[0] == seals[2] != seals[1]
    assert read_seal(tmp_path / "a")["sha256"] == seals[0]
    first, second = blind_set / "cases" / "case_0000", tmp_path / "again" / "cases" / "case_0000"
    assert folder_digest(first) == folder_digest(second)


class StoppedExecutor(SerialExecutor):
    """Stops, as by Ctrl-C, before the second task."""

    def _completed(
        self, function: TaskFunction, pending: Mapping[int, Any]
    ) -> Generator[tuple[int, Outcome], None, None]:
        first = next(iter(pending))
        yield first, run_task(function, pending[first])
        raise KeyboardInterrupt


def test_stopped_make_is_finished_to_the_same_bytes(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    with pytest.raises(KeyboardInterrupt):
        make_set(folder, 2, 5, "easy", labels=[[], []], changes=SHORT, executor=StoppedExecutor())
    assert not (folder / "seal.json").exists()
    finished = make_set(folder, 2, 5, "easy", labels=[[], []], changes=SHORT, executor=HERE)
    assert sorted(path.name for path in folder.iterdir()) == ["cases", "seal.json", "truth.zip"]
    whole = make_set(tmp_path / "whole", 2, 5, "easy", labels=[[], []], changes=SHORT, executor=HERE)
    assert finished == whole
    with pytest.raises(InputError, match="holds a blind set already"):
        make_set(folder, 2, 5, "easy", executor=HERE)


def test_diagnosis_sees_its_case_alone(blind_set: Path, tmp_path: Path) -> None:
    run_set(blind_set, tmp_path, diagnosis="stand_in:by_the_files", executor=HERE)
    for number in range(3):
        verdict = json.loads((tmp_path / f"case_{number:04d}" / "verdict.json").read_text())
        assert verdict["seen"] == FILES


def test_from_records_no_model_is_to_be_had(blind_set: Path, tmp_path: Path) -> None:
    """The diagnosis sees every file but model.json, case.json names none, and the verdicts say so."""
    run_set(blind_set, tmp_path, diagnosis="stand_in:by_the_files", from_records=True, executor=HERE)
    for number in range(3):
        verdict = json.loads((tmp_path / f"case_{number:04d}" / "verdict.json").read_text())
        assert verdict["seen"] == [name for name in FILES if name != "model.json"]
        assert verdict["described"] == ["holdout", "train"]
    assert json.loads((tmp_path / "verdicts.json").read_text())["from_records"] is True
    with pytest.raises(InputError, match="belongs to another run"):
        run_set(blind_set, tmp_path, diagnosis="stand_in:by_the_files", executor=HERE)


@pytest.mark.slow
def test_what_is_part_of_g_is_no_gap_without_a_model(tmp_path: Path) -> None:
    labels = [["transport_delay"], ["wind", "unmodelled_mode"]]
    make_set(tmp_path / "set", 2, 6, "easy", labels=labels, changes=SHORT, executor=HERE)
    for from_records, kinds in ((False, ["single", "pair"]), (True, ["none", "single"])):
        out = tmp_path / str(from_records)
        run_set(tmp_path / "set", out, diagnosis="stand_in:by_the_files",
                from_records=from_records, executor=HERE)  # fmt: skip
        truths = read_evidence(tmp_path / "set", out).truths
        assert [truth.kind for truth in truths] == kinds
    assert truths[1].effects == ("wind",) and len(truths[1].gap_over_sigma) == 1


def test_stopped_run_goes_on_to_the_same_verdicts(blind_set: Path, tmp_path: Path) -> None:
    """With one finished case removed only that one is diagnosed again."""
    digest = run_set(blind_set, tmp_path, diagnosis="stand_in:by_the_files", executor=HERE)
    kept = tmp_path / "case_0000" / "verdict.json"
    stamp = kept.stat().st_mtime_ns
    (tmp_path / "finished" / "task_000002.json").unlink()
    shutil.rmtree(tmp_path / "case_0002")
    assert run_set(blind_set, tmp_path, diagnosis="stand_in:by_the_files", executor=HERE) == digest
    assert kept.stat().st_mtime_ns == stamp
    with pytest.raises(InputError, match="belongs to another run"):
        run_set(blind_set, tmp_path, seed=2, diagnosis="stand_in:by_the_files", executor=HERE)


def test_failed_diagnosis_counts_as_wrong(blind_set: Path, tmp_path: Path) -> None:
    run_set(blind_set, tmp_path, diagnosis="stand_in:fails", executor=HERE)
    assert failures(tmp_path) == {"case_0000": "ValueError: cannot fit"}
    score = score_evidence(read_evidence(blind_set, tmp_path), np.random.default_rng(1))
    assert score.failed == 1
    assert score.headline["single effects named right"].hits == 0


OPEN_TRUTHS = (
    "set/cases/truth/case_0000.json",
    "set/truth/a.csv",
    "set/cases/case_0000/notes.json",
    "set/answers.json",
    "set/cases/case_0000_holdout.csv",
    "set/cases/case_0001/answers.ZIP",
    "set/answers.tar.gz",
    "truth/case_0000.json",
)
"""Whatever it is called and wherever it lies in the set, and a truth beside the set."""


@pytest.mark.parametrize("given", ["set", "set/cases"])
@pytest.mark.usefixtures("copied", "in_this_process")
def test_run_refuses_what_may_be_the_truth(
    tmp_path: Path, given: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each alone is refused by its name; with all of them gone the same command runs."""
    arguments = ["blind", "run", str(tmp_path / given), "--out", str(tmp_path / "out")]
    arguments += ["--diagnosis", "stand_in:by_the_files", "--jobs", "1"]
    for where in OPEN_TRUTHS:
        (tmp_path / where).parent.mkdir(exist_ok=True)
        (tmp_path / where).write_text(json.dumps([{"effects": ["wind"]}]))
        assert main(arguments) == 2, where
        folder = (tmp_path / where).parent
        named = str(folder if folder.name == "truth" else tmp_path / where)
        assert f"{named}: the truth lies open" in capsys.readouterr().err, where
        (tmp_path / where).unlink()
        if folder.name == "truth":
            folder.rmdir()
    assert main(arguments) == 0


def test_run_refuses_links_out_of_the_set(copied: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (copied / "extra").symlink_to(elsewhere)
    with pytest.raises(InputError, match="extra: the truth lies open, or may lie there"):
        run_set(copied, tmp_path / "out", diagnosis="stand_in:by_the_files", executor=HERE)


def test_seal_gives_nothing_away_and_binds_the_cases(copied: Path, tmp_path: Path) -> None:
    """Its seed would make the truth again; cases that were changed are found out by the truth."""
    seal = read_seal(copied)
    assert set(seal) == {"schema", "sha256", "number"}
    holdout = copied / "cases" / "case_0001" / "holdout.csv"
    holdout.write_text("".join(holdout.read_text().splitlines(keepends=True)[:-5]))
    run_set(copied, tmp_path / "out", diagnosis="stand_in:by_the_files", executor=HERE)
    with pytest.raises(InputError, match="cases have changed"):
        read_evidence(copied, tmp_path / "out", seal=seal["sha256"])


def test_a_tampered_verdict_is_not_made_valid_by_running_again(copied: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    digest = run_set(copied, out, diagnosis="stand_in:by_the_files", executor=HERE)
    read_evidence(copied, out, run_sha256=digest)
    with pytest.raises(InputError, match="verdicts have changed"):
        read_evidence(copied, out, run_sha256="0" * 64)
    verdict = out / "case_0001" / "verdict.json"
    verdict.write_text(json.dumps(json.loads(verdict.read_text()) | {"answer": ["backlash"]}))
    with pytest.raises(InputError, match="not what the diagnosis wrote"):
        run_set(copied, out, diagnosis="stand_in:by_the_files", executor=HERE)


def test_a_list_of_verdicts_is_not_changed_unseen(copied: Path, tmp_path: Path) -> None:
    """Cases called failed after the run would not count as wrong."""
    out = tmp_path / "out"
    run_set(copied, out, diagnosis="stand_in:by_the_files", executor=HERE)
    content = json.loads((out / "verdicts.json").read_text())
    (out / "verdicts.json").write_text(json.dumps(content | {"failed": {"case_0001": "x"}}))
    with pytest.raises(InputError, match="verdicts have changed"):
        read_evidence(copied, out)


def test_a_run_that_was_let_see_the_truth_is_no_blind_one(copied: Path, tmp_path: Path) -> None:
    (copied / "truth").mkdir()
    run_set(copied, tmp_path / "out", diagnosis="stand_in:by_the_files", truth_is_open=True, executor=HERE)
    with pytest.raises(InputError, match="score it with --practice"):
        read_evidence(copied, tmp_path / "out")


def test_run_refuses_a_truth_that_is_not_the_sealed_one(copied: Path, tmp_path: Path) -> None:
    shutil.copy(copied / "truth.zip", copied / "cases" / "truth.zip")
    with pytest.raises(InputError, match="the truth lies open"):
        run_set(copied, tmp_path / "out", diagnosis="stand_in:fails", executor=HERE)
    with pytest.raises(InputError, match="not the truth"):
        run_set(copied / "truth.zip", tmp_path / "out", diagnosis="stand_in:fails", executor=HERE)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ("set/truth.zip", "truth has changed"),
        ("set/cases/case_0000/train_1.csv", "cases have changed"),
        ("out/case_0001/verdict.json", "verdicts have changed"),
        ("out/case_0001/holdout_prediction.csv", "verdicts have changed"),
    ],
)
def test_score_refuses_what_was_changed(copied: Path, tmp_path: Path, changed: str, message: str) -> None:
    out = tmp_path / "out"
    run_set(copied, out, diagnosis="stand_in:by_the_files", executor=HERE)
    read_evidence(copied, out, seal=read_seal(copied)["sha256"])
    with pytest.raises(InputError, match="not that of --seal"):
        read_evidence(copied, out, seal="0" * 64)
    path = tmp_path / changed
    path.write_bytes(path.read_bytes() + b" ")
    with pytest.raises(InputError, match=message):
        read_evidence(copied, out)


def test_forged_seal_is_found_by_the_run(copied: Path, tmp_path: Path) -> None:
    """A truth replaced together with seal.json after the run is not the one that the run saw sealed."""
    run_set(copied, tmp_path / "out", diagnosis="stand_in:by_the_files", executor=HERE)
    truth, seal = copied / "truth.zip", copied / "seal.json"
    truth.write_bytes(truth.read_bytes() + b" ")
    content = read_seal(copied) | {"sha256": hashlib.sha256(truth.read_bytes()).hexdigest()}
    seal.write_text(json.dumps(content))
    with pytest.raises(InputError, match="not that of the run"):
        read_evidence(copied, tmp_path / "out")


@pytest.mark.usefixtures("undrawn", "in_this_process")
def test_commands_from_make_to_score(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """make, run, score: the seal is printed, score.json and both reports are written."""
    made, out, scored = (str(tmp_path / name) for name in ("set", "verdicts", "score"))
    labels = ["--effects", "sensor_drift", "none"]
    common = ["--quiet", "--jobs", "1"]
    assert main(["blind", "make", "--n", "2", "--kind", "hard", *labels, "--out", made, *common]) == 0
    seal = read_seal(Path(made))["sha256"]
    assert seal in capsys.readouterr().out
    assert main(["blind", "make", "--n", "2", "--out", made, *common]) == 2
    run = ["blind", "run", made, "--out", out, "--diagnosis", "stand_in:always_nothing", *common]
    assert main(run) == 0
    assert main(["blind", "score", made, out, "--seal", seal, "--out", scored, *common]) == 0
    content = json.loads((Path(scored) / "score.json").read_text())
    assert content["headline"]["no false alarm"]["hits"] == 1
    assert content["headline"]["single effects named right"]["hits"] == 0
    assert content["seal"] == seal
    assert {path.name for path in Path(scored).iterdir()} == {"score.json", "report.html", "report.pdf"}


@pytest.mark.slow
def test_make_draws_unseen_faults_when_asked(tmp_path: Path) -> None:
    """The same seed gives other faults than without the option; what is drawn from stands in the truth."""
    details, origins = {}, {}
    for name in ("known", "unseen"):
        made = tmp_path / name
        options = ["--effects", "other", "--off-catalogue", name, "--seed", "3", "--quiet", "--jobs", "1"]
        assert main(["blind", "make", "--n", "1", "--kind", "easy", *options, "--out", str(made)]) == 0
        files = read_truth(made / "truth.zip")
        details[name] = json.loads(files["case_0000.json"])["detail"]
        origins[name] = json.loads(files[ORIGIN])["changes"]
    assert details["known"] != details["unseen"]
    assert origins == {"known": {}, "unseen": {"off_catalogue": "unseen"}}


def test_practice_layout(blind_set: Path, tmp_path: Path) -> None:
    """Cases beside an open truth are refused, and scored where --practice says that they are practice."""
    practice = tmp_path / "practice"
    shutil.copytree(blind_set / "cases", practice)
    (practice / "truth").mkdir()
    for name, content in read_truth(blind_set / "truth.zip").items():
        (practice / "truth" / name).write_text(content)
    with pytest.raises(InputError, match="the truth lies open"):
        run_set(practice, tmp_path / "out", diagnosis="stand_in:always_nothing", executor=HERE)
    run_set(
        practice, tmp_path / "out", diagnosis="stand_in:always_nothing", truth_is_open=True, executor=HERE
    )
    score = score_evidence(read_evidence(practice, tmp_path / "out", practice=True), np.random.default_rng(1))
    assert (score.cases, score.failed) == (3, 0)
    assert score.headline["no false alarm"].hits == 1


def test_unknown_effects_and_diagnoses_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="gremlins"):
        make_set(tmp_path / "set", 1, 1, labels=[["gremlins"]], executor=HERE)
    (tmp_path / "cases" / "case_0000").mkdir(parents=True)
    nothing = json.dumps({"model": "case.json", "train": [], "holdout": []})
    (tmp_path / "cases" / "case_0000" / "case.json").write_text(nothing)
    with pytest.raises(InputError, match="nowhere"):
        run_set(tmp_path, tmp_path / "out", diagnosis="nowhere:diagnose", executor=HERE)
