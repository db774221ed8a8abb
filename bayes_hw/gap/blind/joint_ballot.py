"""The diagnosis from records alone as the blind check calls it, and the evidence it decided on, kept."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from bayes_hw.files import read_small_text, write_text_atomically
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records, write_results
from bayes_hw.gap.joint.joint_evidence import JointEvidence
from bayes_hw.record import Record

EVIDENCE = "joint_evidence.json"


def diagnose_from_records(folder: Path, out: Path, seed: int) -> None:
    """Diagnose the records that FOLDER/case.json names, its model unread; OUT/joint_evidence.json too."""
    description = json.loads(read_small_text(folder / "case.json"))
    train, holdout = (
        [Record.read(folder / name) for name in description[key]] for key in ("train", "holdout")
    )
    diagnosis = diagnose_records(train, holdout, np.random.default_rng(seed), name=folder.name)
    write_results(diagnosis, out)
    evidence = JointEvidence.of(diagnosis.found).to_dict()
    write_text_atomically(out / EVIDENCE, json.dumps(evidence, allow_nan=False) + "\n")


def read_evidence_of(folder: Path) -> JointEvidence:
    """OUT/CASE/joint_evidence.json."""
    return JointEvidence.from_dict(json.loads(read_small_text(folder / EVIDENCE)))
