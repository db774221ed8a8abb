"""bayes-hw look: what the records show, no model needed."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import RECORD_HELP, add_common, add_output, add_record_options

NAME = "look"
SUMMARY = "what the records show before any model: one page to zoom, and what to record next"
EXAMPLE = "bayes-hw look night.csv --out look/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records, and where the page goes."""
    parser.add_argument("records", nargs="+", metavar="RECORD", help=RECORD_HELP)
    parser.add_argument("--title", default="", help="title of the page (default: the records' names)")
    add_output(parser, "folder for look.json and report.html")
    add_record_options(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Look, write, and say what was seen; raises InputError on bad input before anything is written."""
    import json

    from bayes_hw.commands.inputs import read_records
    from bayes_hw.commands.speech import say
    from bayes_hw.files import check_output_folder, staged, write_text_atomically
    from bayes_hw.look.look import look
    from bayes_hw.report.look.page import to_html

    out = Path(parsed.out)
    check_output_folder(out)
    seen = look(read_records(parsed, parsed.records))
    page = to_html(seen, parsed.title)
    with staged(out) as place:
        write_text_atomically(place / "look.json", json.dumps(seen.to_dict(), allow_nan=False, indent=1) + "\n")
        write_text_atomically(place / "report.html", page)
    if parsed.quiet:
        return
    say(seen.advice.sentence)
    for heading, items in (("not shown", seen.advice.cannot_show), ("record next", seen.advice.record_next)):
        for item in items:
            say(f"{heading}: {item}")
    say(f"page: {out / 'report.html'}")
    say(f"next: bayes-hw identify {' '.join(parsed.records)} --out model/")
