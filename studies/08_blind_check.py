"""Is the diagnosis right on cases whose effect is withheld?

Cases of three kinds (easy, hard, wide) are drawn from the torque-level plant with seeds that no calibration
has seen, sealed, diagnosed without their truth within the time that the command line gives a search, and
scored: with their model, and with the model withheld too unless --no-from-records says not to. Writes
report.html and report.pdf on all cases, results.json also by kind; finished cases stay in OUT/work until the
results are written, so that a run that was stopped goes on.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping

import numpy as np
from blind_check.check import check_blind, joined
from blind_check.seeds import CALIBRATION_SEEDS, REPORT_SEEDS
from blind_check.white_choice import of_white_choice
from study import Study, start_study

from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.gap.blind.run import DIAGNOSIS, FROM_RECORDS
from bayes_hw.gap.blind.score import Score, score_evidence, score_to_dict
from bayes_hw.report.blind.blind_report import blind_report, share_text
from bayes_hw.time_budget import SEARCH_S

ROUND = 26
"""Counted up, for seeds never seen, once a report's misses have been read and the code has changed since."""

NUMBERS = {"easy": 240, "hard": 140, "wide": 20}
QUICK_NUMBERS = {"easy": 2}
BASELINES = {
    "largest correlation": "blind_check.largest_correlation:largest_correlation",
    "black box": "blind_check.black_box:black_box",
}


def main() -> None:
    study = start_study("08_blind_check", __doc__, diagnoses=True)
    numbers = QUICK_NUMBERS if study.quick else {k: round(n * study.share) for k, n in NUMBERS.items()}
    parts = {kind: evidence_of(study, kind, count) for kind, count in numbers.items()}
    scores = {kind: score_evidence(part, np.random.default_rng(study.seed)) for kind, part in parts.items()}
    together = joined(list(parts.values()), list(parts))
    score = score_evidence(together, np.random.default_rng(study.seed))
    baselines = {
        "Akaike, white residuals": score_evidence(
            of_white_choice(together), np.random.default_rng(study.seed)
        ),
        **{name: baseline_score(study, numbers, function) for name, function in BASELINES.items()},
    }
    alone = {
        kind: evidence_of(study, kind, count, from_records=True)
        for kind, count in numbers.items()
        if study.from_records
    }
    alone_score = (
        score_evidence(joined(list(alone.values()), list(alone)), np.random.default_rng(study.seed))
        if alone
        else None
    )
    study.write_document(blind_report(score, together, study.origin(), baselines, alone_score))
    results = {kind: score_to_dict(scores[kind], part) for kind, part in parts.items()}
    from_records = {
        kind: score_to_dict(score_evidence(part, np.random.default_rng(study.seed)), part)
        for kind, part in alone.items()
    }
    study.write_results(
        {
            "calibration_seeds": [CALIBRATION_SEEDS.start, CALIBRATION_SEEDS.stop],
            "report_seeds": [seed_of(study, kind) for kind in parts],
            "baselines": {
                name: {figure: value.to_dict() for figure, value in one.headline.items()}
                for name, one in baselines.items()
            },
            "from_records": from_records,
            **results,
        }
    )
    shutil.rmtree(study.out / "work")
    for kind, one in scores.items():
        for name, value in one.headline.items():
            print(f"{kind:6} {name:48} {share_text(value)}")
    if alone_score is not None:
        for name, value in alone_score.headline.items():
            print(f"alone  {name:48} {share_text(value)}")


def seed_of(study: Study, kind: str) -> int:
    """The seed of the set of one kind, outside the seeds of the calibration."""
    seed = REPORT_SEEDS.start + 100 * ROUND + 10 * study.seed + list(NUMBERS).index(kind)
    assert seed in REPORT_SEEDS
    assert seed not in CALIBRATION_SEEDS
    return seed


def baseline_score(study: Study, numbers: Mapping[str, int], function: str) -> Score:
    """How a plain diagnosis does on all of the cases."""
    parts = [evidence_of(study, kind, count, function) for kind, count in numbers.items()]
    return score_evidence(joined(parts), np.random.default_rng(study.seed))


def evidence_of(
    study: Study, kind: str, count: int, diagnosis: str = "", *, from_records: bool = False
) -> Evidence:
    """The finished check of one kind, of the study's diagnosis unless another is given; from records alone of
    the diagnosis that needs no model."""
    own = study.diagnosis == DIAGNOSIS and not diagnosis
    if from_records and own:
        diagnosis = FROM_RECORDS
    return check_blind(
        study.out / "work" / kind,
        count,
        seed_of(study, kind),
        kind,
        diagnosis=diagnosis or study.diagnosis,
        options={"within_s": SEARCH_S} if own else None,
        from_records=from_records,
        executor=study.executor(),
        progress=study.progress,
    )


if __name__ == "__main__":
    main()
