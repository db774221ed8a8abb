"""What every study script shares: its options, its folder, its results file."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bayes_hw.analysis import Analysis
from bayes_hw.commands.axis import write_analysis
from bayes_hw.executor import Executor, make_executor
from bayes_hw.files import write_text_atomically
from bayes_hw.gap.blind.run import DIAGNOSIS
from bayes_hw.progress import Progress
from bayes_hw.provenance import Provenance, provenance
from bayes_hw.record import Record
from bayes_hw.report.document import Report
from bayes_hw.report.posterior_report import posterior_report
from bayes_hw.report.render import render

REPORTS = Path(__file__).resolve().parents[1] / "reports"
SHARED_DATA = Path(__file__).resolve().parents[2] / "shared"


@dataclass(frozen=True)
class Study:
    """One run of one study: its name, its options and when it began."""

    name: str
    quick: bool
    seed: int
    jobs: int
    out: Path
    progress: Progress
    begin: float
    scheduler: str | None = None
    diagnosis: str = DIAGNOSIS
    share: float = 1.0

    def executor(self) -> Executor:
        """Where the replicates of the study run."""
        return make_executor(self.jobs, self.scheduler)

    def write_results(self, results: Mapping[str, Any]) -> None:
        """Write results.json, with the name and seed first."""
        content = {"study": self.name, "seed": self.seed, "quick": self.quick, **results}
        write_text_atomically(
            self.out / "results.json", json.dumps(content, indent=1, allow_nan=False) + "\n"
        )

    def write_report(self, analysis: Analysis) -> None:
        """Write the files of the analysis, report.html and report.pdf, and say where they are."""
        write_analysis(self.out, analysis)
        records = [*analysis.records, *(p.record for p in analysis.predictions if analysis.held_out)]
        self.write_document(posterior_report(analysis, self.origin(records)))

    def write_document(self, report: Report) -> None:
        """Write report.html and report.pdf, and say where they are."""
        written = render(report, self.out)
        print(f"report: {written.html}\n        {written.pdf}")

    def origin(self, records: Sequence[Record] = ()) -> Provenance:
        """Where the results of this run come from."""
        command = f"python studies/{Path(sys.argv[0]).name} --seed {self.seed}" + " --quick" * self.quick
        return provenance(command, self.seed, records, time.perf_counter() - self.begin)


def start_study(name: str, question: str | None, *, diagnoses: bool = False) -> Study:
    """Parse the options of a study script; one that `diagnoses` can be given another diagnosis to check."""
    parser = argparse.ArgumentParser(
        description=question, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="a smaller run of the same study")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="threads (default: all cores)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="run replicates on this Dask cluster instead")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.add_argument("--out", type=Path, default=REPORTS / name, help="folder of the results")
    if diagnoses:
        parser.add_argument("--diagnosis", metavar="MODULE:FUNCTION", help="check another diagnosis")
        parser.add_argument("--share", type=float, default=1.0, help="share of the cases to run")
    parsed = parser.parse_args()
    return Study(
        name,
        parsed.quick,
        parsed.seed,
        parsed.jobs,
        parsed.out,
        Progress(parsed.quiet),
        time.perf_counter(),
        parsed.scheduler,
        getattr(parsed, "diagnosis", None) or DIAGNOSIS,
        getattr(parsed, "share", 1.0),
    )


def skip_without(data: Path) -> None:
    """End the study, saying why, where its measured data is absent."""
    if not data.is_file():
        print(f"skipped: {data} is absent")
        sys.exit(0)


def headline(analysis: Analysis) -> dict[str, Any]:
    """The numbers of an analysis that a results file keeps."""
    posterior = analysis.dominant.posterior
    content: dict[str, Any] = {
        "posterior": posterior.to_dict(),
        "residuals": analysis.dominant.residuals.to_dict(),
        "coverage": [
            {
                "record": name,
                "nominal": covered.nominal,
                "achieved": covered.achieved,
                "interval95": list(covered.interval),
            }
            for name, covered in analysis.coverages
        ],
        "prediction_fit_percent": {p.record.name: p.fit_percent for p in analysis.predictions},
        "held_out": analysis.held_out,
        "fits": [
            {"record": fit.record, "hammerstein_wiener": fit.hammerstein_wiener, "linear": fit.linear}
            for fit in analysis.fits
        ],
    }
    if analysis.everything is not None:
        content["posterior_all_free"] = analysis.everything.posterior.to_dict()
    if analysis.identification is not None:
        content["steps"] = [
            {"name": step.name, "cost": step.cost, "fit_percent": step.fit_percent}
            for step in analysis.identification.steps
        ]
    return content
