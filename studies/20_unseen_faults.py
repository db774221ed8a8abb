"""Is `other` said of faults that nobody had in mind while the diagnosis was made?

Sealed cases of two kinds (easy, hard) whose fault is drawn from a group off the catalogue on which the
diagnosis had never been changed when the report was made (`bayes_hw.plant.effects.unseen`). Writes
report.html, report.pdf and results.json, with the answers by fault; a run that was stopped goes on.

The misses of the report led to one change afterwards: mains hum, a sine that a model corrected by every
sample follows, was taken for chaotic backlash, surely; a line in time is no longer laid to chaos.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from blind_check.check import check_blind, joined
from blind_check.seeds import REPORT_SEEDS
from study import Study, start_study

from bayes_hw.gap.blind.counts import Share
from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.gap.blind.score import GOALS, score_evidence, score_to_dict
from bayes_hw.report.blind.blind_report import NAMED_WRONG, PROVENANCE, blind_report, share_text
from bayes_hw.report.blind.figures_blind import shares
from bayes_hw.report.page.document import Report, Section, Table

LAST = 11_999
"""Seed that those of this study count down from."""

NUMBERS = {"easy": 24, "hard": 16}
QUICK_NUMBERS = {"easy": 1}


def main() -> None:
    study = start_study("20_unseen_faults", __doc__, diagnoses=True)
    numbers = QUICK_NUMBERS if study.quick else {k: study.part_of(n) for k, n in NUMBERS.items()}
    parts = {kind: evidence_of(study, kind, count) for kind, count in numbers.items()}
    together = joined(list(parts.values()), list(parts))
    score = score_evidence(together, np.random.default_rng(study.seed))
    found = by_fault(together)
    study.write_document(report_by_fault(blind_report(score, together, study.origin()), found))
    study.write_results(
        {
            "seeds": [seed_of(study, kind) for kind in parts],
            "by_fault": {fault: share.to_dict() for fault, share in found.items()},
            **{
                kind: score_to_dict(score_evidence(part, np.random.default_rng(study.seed)), part)
                for kind, part in parts.items()
            },
        }
    )
    shutil.rmtree(study.out / "work")
    for name, value in score.headline.items():
        print(f"{name:48} {share_text(value)}")


def seed_of(study: Study, kind: str) -> int:
    """The seed of the set of one kind: down from LAST, away from those of the blind check, which count up."""
    seed = LAST - 10 * study.seed - list(NUMBERS).index(kind)
    assert seed in REPORT_SEEDS
    return seed


def evidence_of(study: Study, kind: str, count: int) -> Evidence:
    """The finished check of one kind."""
    return check_blind(
        study.out / "work" / kind,
        count,
        seed_of(study, kind),
        kind,
        labels=[("other",)],
        changes={"off_catalogue": "unseen"},
        diagnosis=study.diagnosis,
        executor=study.executor(),
        progress=study.progress,
    )


def by_fault(evidence: Evidence) -> dict[str, Share]:
    """Of every fault in how many of its cases `other` was said."""
    cases, said = Counter[str](), Counter[str]()
    for truth, verdict in zip(evidence.truths, evidence.verdicts, strict=True):
        fault = truth.detail[0].split(":")[-1].strip().replace("_", " ")
        cases[fault] += 1
        said[fault] += verdict.answer == ("other",)
    return {fault: Share(said[fault], cases[fault]) for fault in sorted(cases)}


def report_by_fault(report: Report, found: Mapping[str, Share]) -> Report:
    """The pages of a blind check, the faults first, without what says nothing of cases that share a label."""
    table = Table(
        ("fault", "other was said in"),
        tuple((fault, share_text(share)) for fault, share in found.items()),
        "Cases by fault; per cent with the 95 % binomial interval.",
    )
    kept = tuple(section for section in report.sections if section.title in (NAMED_WRONG, PROVENANCE))
    return replace(
        report,
        title="Faults that the diagnosis never met",
        key_figure=shares(found, "Faults off the catalogue", GOALS["other said of off-catalogue"]),
        sections=(Section("By fault", (table,)), *kept),
    )


if __name__ == "__main__":
    main()
