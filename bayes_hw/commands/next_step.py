"""The next command: the last line of every command's answer."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence

from bayes_hw.commands.options import add_record_options, add_start
from bayes_hw.commands.speech import say


def say_next(parsed: argparse.Namespace, *command: str) -> None:
    """The next command, ready to be copied; nothing when quiet."""
    if not parsed.quiet:
        say(f"next: {shlex.join(['bayes-hw', *command])}")


def reading_options(parsed: argparse.Namespace) -> list[str]:
    """The options that say how records are read and begin, as they were given, to be given again."""
    parser = argparse.ArgumentParser(add_help=False)
    add_record_options(parser)
    add_start(parser)
    found: list[str] = []
    for action in parser._actions:
        value = getattr(parsed, action.dest, action.default)
        if value == action.default:
            continue
        values = (
            []
            if value is True
            else value
            if isinstance(value, Sequence) and not isinstance(value, str)
            else [value]
        )
        option = action.option_strings[-1]
        if isinstance(action, argparse._AppendAction):
            found += [part for each in values for part in (option, str(each))]
        else:
            found += [option, *(str(each) for each in values)]
    return found


def diagnose_next(model: str, train: Sequence[str], holdout: Sequence[str]) -> list[str]:
    """The command that asks why a model leaves something of its records; the last one is held out where none
    is, empty where it is the only one."""
    if not holdout:
        train, holdout = train[:-1], train[-1:]
    if not train:
        return []
    return ["diagnose", "--model", model, "--train", *train, "--holdout", *holdout, "--out", "diagnosis/"]
