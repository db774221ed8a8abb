"""What does the diagnosis say of the practice cases, whose truth lies beside them?

Every case of the two open sets is diagnosed without its truth, and scored like a blind check. It is
none: the constants of the decision were set with these cases in sight. Finished cases stay in OUT/work until
the results are written, so that a run that was stopped goes on. Skipped where the sets are absent.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from blind_check.check import joined
from blind_check.white_choice import of_white_choice
from study import SHARED_DATA, Study, skip_without, start_study

from bayes_hw.gap.blind.evidence import Evidence, read_evidence
from bayes_hw.gap.blind.run import run_set
from bayes_hw.gap.blind.score import score_evidence, score_to_dict
from bayes_hw.report.blind.blind_report import blind_report, share_text

SETS = ("practice", "practice_hard")
QUICK_CASES = 1


def main() -> None:
    study = start_study("07_practice_cases", __doc__, diagnoses=True)
    folders = [SHARED_DATA / name for name in SETS]
    for folder in folders:
        skip_without(folder / "case_000" / "case.json")
    parts = {folder.name: evidence_of(study, folder) for folder in folders}
    together = joined(list(parts.values()), list(parts))
    score = score_evidence(together, np.random.default_rng(study.seed))
    plain = score_evidence(of_white_choice(together), np.random.default_rng(study.seed))
    report = blind_report(score, together, study.origin(), {"Akaike, white residuals": plain})
    study.write_document(
        replace(
            report,
            title="The practice cases",
            subtitle=f"{score.cases} open cases, diagnosed without their truth; no blind check, since the "
            "constants of the decision were set with them in sight",
        )
    )
    results = {
        name: score_to_dict(score_evidence(part, np.random.default_rng(study.seed)), part)
        for name, part in parts.items()
    }
    study.write_results(results)
    shutil.rmtree(study.out / "work")
    for name, value in score.headline.items():
        print(f"{name:48} {share_text(value)}")


def evidence_of(study: Study, folder: Path) -> Evidence:
    """Verdicts and truths of one open set."""
    verdicts = study.out / "work" / folder.name
    if study.quick:
        folder = first_cases(folder, study.out / "work" / f"{folder.name}_first", QUICK_CASES)
    run_set(
        folder,
        verdicts,
        study.seed,
        diagnosis=study.diagnosis,
        truth_is_open=True,
        executor=study.executor(),
        progress=study.progress,
    )
    return read_evidence(folder, verdicts, practice=True)


def first_cases(folder: Path, target: Path, count: int) -> Path:
    """A set of the first cases of another, with their truth."""
    (target / "truth").mkdir(parents=True, exist_ok=True)
    for number in range(count):
        name = f"case_{number:03d}"
        shutil.copytree(folder / name, target / name, dirs_exist_ok=True)
        for path in (folder / "truth").glob(f"{name}*"):
            shutil.copy(path, target / "truth")
    return target


if __name__ == "__main__":
    main()
