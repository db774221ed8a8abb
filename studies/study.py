"""What every study script shares: its options, its folder, its results, its manifest."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from index import write_index
from manifest import REPORTS, code_digest, new_manifest, read_manifest

from bayes_hw.analysis import Analysis
from bayes_hw.commands.axis import write_analysis
from bayes_hw.executor import Executor, make_executor
from bayes_hw.files import write_json
from bayes_hw.gap.blind.run import DIAGNOSIS
from bayes_hw.progress import Progress
from bayes_hw.provenance import Provenance, provenance
from bayes_hw.record import Record
from bayes_hw.report.page.document import Report
from bayes_hw.report.page.render import render
from bayes_hw.report.posterior.posterior_report import posterior_report

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared"


@dataclass
class Study:
    """One run of one study: its name, its script, its options and when it began.

    A run is finished, and has its manifest, once both its results and its report are written.
    """

    name: str
    script: Path
    quick: bool
    seed: int
    jobs: int
    out: Path
    progress: Progress
    begin: float
    scheduler: str | None = None
    diagnosis: str = DIAGNOSIS
    share: float = 1.0
    counts: Mapping[str, int] = field(default_factory=dict)
    usual_counts: Mapping[str, int] = field(default_factory=dict)
    from_records: bool = True
    began_at: float = field(default_factory=time.time)
    report: Report | None = None
    results_written: bool = False

    def part_of(self, cases: int) -> int:
        """How many of so many cases --share asks for, at least one; one where quick."""
        return 1 if self.quick else max(1, round(self.share * cases))

    def executor(self) -> Executor:
        """Where the replicates of the study run."""
        return make_executor(self.jobs, self.scheduler)

    def write_results(self, results: Mapping[str, Any]) -> None:
        """Write results.json, with the name and seed first."""
        content = {"study": self.name, "seed": self.seed, "quick": self.quick, **results}
        write_json(self.out / "results.json", content)
        self.results_written = True
        self._finish()

    def write_report(self, analysis: Analysis, finish: Callable[[Report], Report] | None = None) -> None:
        """Write the files of the analysis, report.html and report.pdf, and say where they are; `finish` adds
        what the report of the analysis lacks."""
        write_analysis(self.out, analysis)
        records = [*analysis.records, *(p.record for p in analysis.predictions if analysis.held_out)]
        report = posterior_report(analysis, self.origin(records))
        self.write_document(report if finish is None else finish(report))

    def write_document(self, report: Report) -> None:
        """Write report.html and report.pdf, and say where they are."""
        written = render(report, self.out)
        print(f"report: {written.html}\n        {written.pdf}")
        self.report = report
        self._finish()

    def _finish(self) -> None:
        """Write manifest.json, and reports/index.html anew, once results and report are there."""
        if self.report is None or not self.results_written:
            return
        files = [p.name for p in self.out.iterdir() if p.is_file() and p.stat().st_mtime >= self.began_at - 1]
        manifest = new_manifest(
            self.name,
            self.script,
            self.report,
            self.origin(),
            quick=self.quick,
            folder=self.out,
            files=[name for name in files if name != "manifest.json"],
        )
        manifest.write(self.out)
        if self.out.resolve().parent == REPORTS:
            write_index(REPORTS)

    def is_done(self) -> bool:
        """Whether the same command has made what lies in the folder, by the code as it is now."""
        manifest = read_manifest(self.out)
        return manifest is not None and manifest.is_done(self.out, code_digest(self.script), self.command)

    @property
    def command(self) -> str:
        """What makes the same numbers again."""
        another = f" --diagnosis {self.diagnosis}" * (self.diagnosis != DIAGNOSIS)
        another += f" --share {self.share:g}" * (self.share != 1)
        for name, count in self.counts.items():
            another += f" --{name} {count}" * (count != self.usual_counts[name])
        another += " --no-from-records" * (not self.from_records)
        return f"python studies/{self.script.name} --seed {self.seed}" + " --quick" * self.quick + another

    def origin(self, records: Sequence[Record] = ()) -> Provenance:
        """Where the results of this run come from."""
        named = [plainly_named(record, SHARED_DATA.parent) for record in records]
        return provenance(self.command, self.seed, named, time.perf_counter() - self.begin)


def start_study(
    name: str,
    question: str | None,
    *,
    diagnoses: bool = False,
    counts: Mapping[str, int] | None = None,
) -> Study:
    """Parse the options of a study script; one that `diagnoses` can be given another diagnosis to check.

    `counts` are further options, each a number by name, with what they are when left out.

    Ends the script where --unless-done is given and nothing is to be done.
    """
    parser = argparse.ArgumentParser(
        description=question, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="a smaller run of the same study")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="threads (default: all cores)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="run replicates on this Dask cluster instead")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.add_argument(
        "--unless-done", action="store_true", help="skip what this code has made with these options before"
    )
    parser.add_argument("--out", type=Path, default=REPORTS / name, help="folder of the results")
    if diagnoses:
        parser.add_argument("--diagnosis", metavar="MODULE:FUNCTION", help="check another diagnosis")
        parser.add_argument("--share", type=float, default=1.0, help="share of the cases to run")
        parser.add_argument(
            "--from-records",
            action=argparse.BooleanOptionalAction,
            default=True,
            help="where a study has both: diagnose the cases with their model withheld too",
        )
    usual = dict(counts or {})
    for option, count in usual.items():
        parser.add_argument(f"--{option}", type=int, default=count, help=f"how many (default: {count})")
    parsed = parser.parse_args()
    study = Study(
        name,
        Path(sys.argv[0]).resolve(),
        parsed.quick,
        parsed.seed,
        parsed.jobs,
        parsed.out,
        Progress(parsed.quiet),
        time.perf_counter(),
        parsed.scheduler,
        getattr(parsed, "diagnosis", None) or DIAGNOSIS,
        getattr(parsed, "share", 1.0),
        {option: getattr(parsed, option.replace("-", "_")) for option in usual},
        usual,
        getattr(parsed, "from_records", True),
    )
    if parsed.unless_done and study.is_done():
        print(
            f"done: {parsed.out} is of this code, seed and options; leave out --unless-done to run it again"
        )
        sys.exit(0)
    return study


def plainly_named(record: Record, folder: Path) -> Record:
    """The record, its source as seen from `folder`, which is another one on every machine or run."""
    source = Path(record.source)
    if not source.is_relative_to(folder):
        return record
    return replace(record, source=source.relative_to(folder).as_posix())


def skip_without(data: Path) -> None:
    """End the study, saying why, where its measured data is absent."""
    if not data.is_file():
        print(f"skipped: {data} is absent")
        sys.exit(0)


def headline(analysis: Analysis) -> dict[str, Any]:
    """The numbers of an analysis that a results file keeps."""
    posterior = analysis.inference.posterior
    content: dict[str, Any] = {
        "posterior": posterior.to_dict(),
        "residuals": analysis.inference.residuals.to_dict(),
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
    if analysis.identification is not None:
        content["steps"] = [
            {"name": step.name, "cost": step.cost, "fit_percent": step.fit_percent}
            for step in analysis.identification.steps
        ]
    return content
