"""What does a first hour show? The case of `bayes-hw demo`: an axis whose simulator lacks one effect.

Writes the diagnosis report with the truth opened at its end, and its key figure (the record held out, before
and after the effect is added) on white as first_hour.svg for the README.
"""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path

import numpy as np
from pages.first_hour_report import RecordsAlone, Truth, first_hour_report
from study import plainly_named, start_study

from bayes_hw.commands.demo import RECORD_SEED
from bayes_hw.files import write_text_atomically
from bayes_hw.gap.blind.make import write_open_case
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.diagnosis import diagnose
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.identify.four_steps import MAX_ORDER, identify
from bayes_hw.identify.validation import evaluate
from bayes_hw.report.diagnosis.diagnosis_report import diagnosis_report

QUICK_DURATION_S = 30.0
QUICK_ORDER = 2


def main() -> None:
    study = start_study("14_first_hour", __doc__)
    with tempfile.TemporaryDirectory() as folder:
        made = write_open_case(
            Path(folder) / "case",
            RECORD_SEED,
            ("friction",),
            duration_s=QUICK_DURATION_S if study.quick else None,
        )
        case = Case.read(Path(folder) / "case")
        truth = json.loads((Path(folder) / "case" / "truth.json").read_text(encoding="utf-8"))
    few = frozenset(LABEL_BLOCKS) - {"friction"} if study.quick else frozenset[str]()
    rng = np.random.default_rng(study.seed)
    diagnosis = diagnose(case, rng, jobs=study.jobs, without=few, progress=study.progress)
    records = [plainly_named(record, Path(folder)) for record in (*case.train, *case.holdout)]
    found = identify(case.train, name="axis", max_order=QUICK_ORDER if study.quick else MAX_ORDER)
    (fit,) = evaluate(found, case.holdout)
    report = first_hour_report(
        diagnosis_report(diagnosis, study.origin(records)),
        diagnosis.verdict,
        RecordsAlone.of(found.model, fit),
        Truth(made.labels, made.forms, truth["base"]),
    )
    study.write_document(report)
    write_text_atomically(study.out / "first_hour.svg", on_white(report.key_figure.svg))
    verdict = diagnosis.verdict.to_dict()
    study.write_results(
        {
            "truth": list(made.labels),
            "form": list(made.forms),
            "answer": verdict["answer"],
            "probability": verdict["probability"],
            "gap": verdict["gap"],
            "seconds": verdict["seconds"],
        }
    )
    print(diagnosis.sentence())


def on_white(svg: str) -> str:
    """The drawing with a white ground, for pages that may be dark."""
    return re.sub(r"(<svg[^>]*>)", r'\1<rect width="100%" height="100%" fill="#ffffff"/>', svg, count=1)


if __name__ == "__main__":
    main()
