"""bayes-hw completion: the script that has a shell complete commands, options and files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from bayes_hw.commands.options import add_common

NAME = "completion"
SUMMARY = "print the script that completes commands, options and files in bash, zsh or fish"
EXAMPLE = (
    "bayes-hw completion bash > ~/.local/share/bash-completion/completions/bayes-hw\n"
    "  bayes-hw completion zsh > ~/.zfunc/_bayes-hw          # with ~/.zfunc in fpath\n"
    "  bayes-hw completion fish > ~/.config/fish/completions/bayes-hw.fish"
)

FILES = ("RECORD", "FILE", ".json", ".csv", "CASE", "VERDICTS")
"""Parts of metavars whose arguments are paths of files."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shell."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell")
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Print the script, made by shtab from the parser itself."""
    import sys

    import shtab

    for action in _actions(parsed.parser):
        words = action.metavar if isinstance(action.metavar, str) else ""
        if words == "DIR":
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
        elif any(part in words for part in FILES):
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    sys.stdout.write(shtab.complete(parsed.parser, parsed.shell) + "\n")


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Every option and argument of the parser and of its commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
