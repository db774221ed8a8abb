"""What each command of the command line does."""

from __future__ import annotations

import argparse
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from bayes_hw.errors import InputError, solvable
from bayes_hw.folder_claim import claimed_folder

LIGHT = frozenset({"completion", "convert", "demo", "inspect", "look", "plan", "validate"})
"""Commands that run no compiled code themselves."""


def run(parsed: argparse.Namespace) -> None:
    """Run the command that `parsed` names.

    Beside the options it holds `command_line` and `checkpoint`, the folder that keeps an unfinished run.
    Raises InputError on bad input, before anything is written.
    """
    if parsed.jobs < 1:
        raise InputError(f"--jobs {parsed.jobs}: must be one or more")
    if parsed.seed < 0:
        raise InputError(f"--seed {parsed.seed}: must be zero or more")
    if "out" in parsed and not parsed.out:
        raise InputError("--out: is empty; name a place for the results")
    claim = claimed_folder(Path(parsed.out)) if getattr(parsed, "out_is_folder", False) else nullcontext()
    from bayes_hw.commands.early import refuse_early

    refuse_early(parsed)
    named = [parsed.record] if "record" in parsed else getattr(parsed, "records", [parsed.command])
    with solvable(", ".join(map(str, named))), claim, _told_of_compilation(parsed):
        if "run" in parsed:
            parsed.run(parsed)
        else:
            from bayes_hw.commands.axis import COMMANDS

            COMMANDS[parsed.command](parsed)


def _told_of_compilation(parsed: argparse.Namespace) -> AbstractContextManager[None]:
    """A word where a command has to wait for what the first use compiles."""
    if parsed.command in LIGHT:
        return nullcontext()
    from bayes_hw.first_use import told_of_compilation
    from bayes_hw.progress import Progress

    return told_of_compilation(Progress(parsed.quiet).say)
