"""Joint diagnoses as the blind check calls them, and the evidence they decided on, kept."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from bayes_hw.files import read_small_text, write_json
from bayes_hw.gap.any_train import diagnose_around
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.joint.decision.given_decision import GivenEvidence
from bayes_hw.gap.joint.decision.joint_decision import JointEvidence
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis, diagnose_records
from bayes_hw.record import Record

EVIDENCE, GIVEN_EVIDENCE = "joint_evidence.json", "given_evidence.json"


def diagnose_from_records(folder: Path, out: Path, seed: int, within_s: float = float("inf")) -> None:
    """Diagnose the records that FOLDER/case.json names, its model unread; OUT/joint_evidence.json too."""
    description = json.loads(read_small_text(folder / "case.json"))
    train, holdout = (
        [Record.read(folder / name) for name in description[key]] for key in ("train", "holdout")
    )
    rng = np.random.default_rng(seed)
    diagnosis = diagnose_records(train, holdout, rng, name=folder.name, within_s=within_s)
    diagnosis.write(out)
    evidence = JointEvidence.of(diagnosis.found).to_dict()
    write_json(out / EVIDENCE, evidence, None)


def diagnose_given_model(folder: Path, out: Path, seed: int, within_s: float = float("inf")) -> None:
    """Diagnose the case in FOLDER as `diagnose_any_case` does; where that went through ports,
    OUT/given_evidence.json too."""
    case = Case.read(folder)
    diagnosis = diagnose_around(case, np.random.default_rng(seed), within_s=within_s)
    diagnosis.write(out)
    if isinstance(diagnosis, JointDiagnosis):
        evidence = GivenEvidence.of(diagnosis.found, case.model.noise_sigma).to_dict()
        write_json(out / GIVEN_EVIDENCE, evidence, None)
