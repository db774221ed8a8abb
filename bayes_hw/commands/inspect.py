"""bayes-hw inspect: what a log holds, what would be taken for what, and the command that reads it."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_common, add_record_options

NAME = "inspect"
SUMMARY = "what a log holds, what would be taken for what and why, and the command that reads it"
EXAMPLE = "bayes-hw inspect night_0314.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files, one after the other; options answer what they ask."""
    parser.add_argument("sources", metavar="FILE", nargs="+", help="a log of any format that is read")
    add_record_options(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Say what is found; raises InputError on what is no log, and where a question is open, which it
    names."""
    from bayes_hw.commands.inputs import reading_options
    from bayes_hw.commands.speech import say
    from bayes_hw.errors import InputError
    from bayes_hw.inspection.inspected_file import inspect_file
    from bayes_hw.record_files import checked_file

    options = reading_options(parsed, needs_output=False)
    for path in map(Path, parsed.sources):
        checked_file(path)
        found = inspect_file(path, options)
        for line in found.lines:
            say(line)
        if found.choices:
            say("to read it, whichever is so:")
        for line in found.answers(path, f"{path.stem}_record.csv"):
            say(f"  {line}")
        if found.questions:
            raise InputError(f"{path}: {found.questions[0].removeprefix(f'{path}: ')}")
        say("to read it:")
        say(f"  {found.command(path, 'convert', f'{path.stem}_record.csv')}")
        say(f"  {found.command(path, 'identify', f'{path.stem}_model/')}")
