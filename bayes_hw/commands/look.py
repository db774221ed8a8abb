"""bayes-hw look: what the records show, no model needed."""

from __future__ import annotations

import argparse
import shlex
from itertools import chain
from pathlib import Path

from bayes_hw.commands.options import RECORD_HELP, add_common, add_output, add_record_options

NAME = "look"
SUMMARY = "what the records show before any model: one page to zoom, and what to record next"
EXAMPLE = "bayes-hw look night.csv --out look/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records, and where the page goes."""
    parser.add_argument("records", nargs="+", metavar="RECORD", help=RECORD_HELP)
    parser.add_argument("--title", default="", help="title of the page (default: the axis's name)")
    add_output(parser, "folder for look.json and report.html")
    add_record_options(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Look, write, and say what was seen; raises InputError on bad input before anything is written."""
    from bayes_hw.commands.inputs import read_records
    from bayes_hw.commands.next_step import reading_options
    from bayes_hw.commands.records import axis_name
    from bayes_hw.commands.speech import say, warn
    from bayes_hw.entrance import check_scale
    from bayes_hw.files import check_output_folder
    from bayes_hw.first_look.look import look
    from bayes_hw.report.look.page import PAGE, write

    out = Path(parsed.out)
    check_output_folder(out)
    records = read_records(parsed, parsed.records)
    if "scale" not in parsed.accept:
        for doubt in chain.from_iterable(map(check_scale, records)):
            warn(doubt)
    seen = look(records)
    write(seen, out, parsed.title or axis_name(parsed.records))
    if parsed.quiet:
        return
    for line in str(seen.advice).splitlines():
        say(line)
    say(f"page: {out / PAGE}")
    again = [*parsed.records, *reading_options(parsed)]
    say(f"next: bayes-hw identify {shlex.join(again)} --out model/")
