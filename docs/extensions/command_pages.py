"""A page of every command from its parser, written to docs/generated/commands.md."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from effect_gallery import write_if_changed
from sphinx.application import Sphinx

TARGET = Path(__file__).resolve().parents[1] / "generated" / "commands.md"


def commands(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    """The parsers of all commands and their steps."""
    found = []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                found += [below, *commands(below)]
    return found


def generate(app: Sphinx) -> None:
    """Write the page."""
    os.environ["COLUMNS"] = "100"
    from bayes_hw.cli import build_parser

    parts = [
        "# Commands",
        "Every command takes `--seed` (same seed, same machine: same numbers), `--jobs N` and `--quiet`. "
        "Exit status: 0 done, 2 bad input or usage (one line on stderr), 1 anything else. What follows is "
        "what `--help` prints.",
    ]
    for parser in commands(build_parser()):
        parts += [f"## {parser.prog}", f"```text\n{parser.format_help().rstrip()}\n```"]
    TARGET.parent.mkdir(exist_ok=True)
    write_if_changed(TARGET, "\n\n".join(parts) + "\n")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the page before Sphinx looks for its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
