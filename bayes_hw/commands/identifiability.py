"""bayes-hw identifiability."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import (
    RECORD_HELP,
    add_common,
    add_output,
    add_record_options,
    add_sampling,
    add_start,
)

NAME = "identifiability"
SUMMARY = "what records can and cannot tell: flat directions, freed gains, profiles, a verdict a parameter"
EXAMPLE = "bayes-hw identifiability model/model.json train_1.csv train_2.csv --out identifiability/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of this command."""
    parser.add_argument("model", metavar="MODEL", help="model.json that priors are centred on")
    parser.add_argument("records", nargs="+", metavar="RECORD", help=RECORD_HELP)
    parser.add_argument("--title", default="", help="title of the report")
    add_output(parser, "folder for identifiability.json, freed_draws.csv, report.html and report.pdf")
    add_record_options(parser)
    add_start(parser)
    add_sampling(parser, resumable=False)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Analyse, write, and say one verdict a parameter."""
    import numpy as np

    from bayes_hw.commands.inputs import sampler_settings
    from bayes_hw.commands.next_step import reading_options, say_next
    from bayes_hw.commands.records import records_of
    from bayes_hw.commands.speech import say, say_page, warn
    from bayes_hw.files import check_output_folder
    from bayes_hw.identifiability.analysis import analyse_identifiability
    from bayes_hw.model.hammerstein_wiener import HammersteinWiener
    from bayes_hw.progress import Progress
    from bayes_hw.provenance import provenance_of
    from bayes_hw.report.identifiability.identifiability_report import identifiability_report
    from bayes_hw.report.page.render import render

    settings = sampler_settings(parsed)
    out = Path(parsed.out)
    check_output_folder(out)
    model = HammersteinWiener.read(parsed.model)
    given = records_of(parsed, parsed.records, model=model)
    records = given.records
    result = analyse_identifiability(
        parsed.title or model.name,
        model,
        records,
        np.random.default_rng(parsed.seed),
        start=given.start,
        settings=settings,
        jobs=parsed.jobs,
        progress=Progress(parsed.quiet),
    )
    result.write(out)
    origin = provenance_of(parsed, records)
    page = identifiability_report(result, origin)
    written = render(page, out)
    if not result.converged:
        warn("NOT CONVERGED: see identifiability.json")
    if not result.agreement.agrees:
        warn(f"invariants with and without the gains free differ by {result.agreement.largest:.1f} errors")
    for verdict in result.verdicts:
        say(f"{verdict.name:32} {verdict.verdict}: {verdict.reason}")
    for test in result.assumptions:
        say(f"{test.name + ' = 1':32} {test.decision}")
    if result.trade is not None:
        say(result.trade.sentence)
    say_page(page, written)
    again = reading_options(parsed)
    say_next(parsed, "sample", "--model", parsed.model, *parsed.records, *again, "--out", "posterior/")
