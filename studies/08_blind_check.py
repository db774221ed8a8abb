"""Is the diagnosis right on cases whose effect is withheld?

Cases of three kinds (easy, hard, wide) are drawn from the torque-level plant with seeds that no calibration
has seen, sealed, diagnosed without their truth, and scored. Writes report.html and report.pdf on all cases,
results.json also by kind; finished cases stay in OUT/work until the results are written, so that a run that
was stopped goes on.
"""

from __future__ import annotations

import shutil

import numpy as np
from study import Study, start_study

from bayes_hw.gap.blind.check import check_blind, joined
from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.gap.blind.score import score_evidence, score_to_dict
from bayes_hw.gap.blind.seeds import CALIBRATION_SEEDS, REPORT_SEEDS
from bayes_hw.report.blind_report import blind_report, share_text

NUMBERS = {"easy": 140, "hard": 160, "wide": 100}
QUICK_NUMBERS = {"easy": 2}


def main() -> None:
    study = start_study("08_blind_check", __doc__, diagnoses=True)
    numbers = QUICK_NUMBERS if study.quick else NUMBERS
    parts = {kind: evidence_of(study, kind, count) for kind, count in numbers.items()}
    scores = {kind: score_evidence(part, np.random.default_rng(study.seed)) for kind, part in parts.items()}
    together = joined(list(parts.values()))
    score = score_evidence(together, np.random.default_rng(study.seed))
    study.write_document(blind_report(score, together, study.origin()))
    results = {kind: score_to_dict(scores[kind], part) for kind, part in parts.items()}
    study.write_results(
        {
            "calibration_seeds": [CALIBRATION_SEEDS.start, CALIBRATION_SEEDS.stop],
            "report_seeds": [seed_of(study, kind) for kind in parts],
            **results,
        }
    )
    shutil.rmtree(study.out / "work")
    for kind, one in scores.items():
        for name, value in one.headline.items():
            print(f"{kind:6} {name:48} {share_text(value)}")


def seed_of(study: Study, kind: str) -> int:
    """The seed of the set of one kind, outside the seeds of the calibration."""
    seed = REPORT_SEEDS.start + 10 * study.seed + list(NUMBERS).index(kind)
    assert seed in REPORT_SEEDS
    assert seed not in CALIBRATION_SEEDS
    return seed


def evidence_of(study: Study, kind: str, count: int) -> Evidence:
    """The finished check of one kind."""
    return check_blind(
        study.out / "work" / kind,
        count,
        seed_of(study, kind),
        kind,
        diagnosis=study.diagnosis,
        executor=study.executor(),
        progress=study.progress,
    )


if __name__ == "__main__":
    main()
