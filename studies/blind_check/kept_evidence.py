"""What joint diagnoses of a blind check decided on, read back."""

from __future__ import annotations

import json
from pathlib import Path

from bayes_hw.files import read_small_text
from bayes_hw.gap.blind.joint_ballot import EVIDENCE, GIVEN_EVIDENCE
from bayes_hw.gap.joint.decision.given_decision import GivenEvidence
from bayes_hw.gap.joint.decision.joint_decision import JointEvidence


def read_evidence_of(folder: Path) -> JointEvidence:
    """OUT/CASE/joint_evidence.json."""
    return JointEvidence.from_dict(json.loads(read_small_text(folder / EVIDENCE)))


def read_given_evidence_of(folder: Path) -> GivenEvidence | None:
    """OUT/CASE/given_evidence.json, None where there is none."""
    path = folder / GIVEN_EVIDENCE
    return GivenEvidence.from_dict(json.loads(read_small_text(path))) if path.exists() else None
