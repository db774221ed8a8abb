"""bayes-hw validate: files of the fixed formats held against their JSON Schemas."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_common

NAME = "validate"
SUMMARY = "hold case, model, controller, posterior and verdict files against their JSON Schemas"
EXAMPLE = "bayes-hw validate model/model.json posterior/posterior.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The files, and what they are where their names do not say."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="JSON files")
    parser.add_argument(
        "--kind",
        choices=("case", "model", "controller", "posterior", "verdict"),
        help="what the files are (default: as their names or contents say)",
    )
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Name the kind of every file; raises InputError on the first that is not what it should be."""
    from bayes_hw.commands.speech import say
    from bayes_hw.file_schemas import check_file

    for name in parsed.files:
        kind = check_file(Path(name), parsed.kind)
        say(f"{name}: a valid {kind}")
