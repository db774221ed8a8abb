"""What a command says to the person who runs it."""

from __future__ import annotations

import argparse
import math
import shlex
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from bayes_hw.commands.options import add_record_options, add_start
from bayes_hw.errors import InputError
from bayes_hw.report.page.typography import visible

if TYPE_CHECKING:
    from bayes_hw.gap.answer.axis_with_effects import AxisWithEffects
    from bayes_hw.infer.posterior import Posterior
    from bayes_hw.report.page.document import Report
    from bayes_hw.report.page.render import RenderedReport


MOST_DECIMALS = 9
"""Decimals beyond which a number is written with a power of ten."""


def rounded(value: float, sd: float) -> str:
    """`value` to the decimal place of the second digit of `sd`, its uncertainty."""
    if not (math.isfinite(value) and math.isfinite(sd) and sd > 0):
        return f"{value:.6g}"
    decimals = 1 - int(f"{sd:.1e}".split("e")[1])
    if decimals > MOST_DECIMALS:
        magnitude = int(f"{value:.0e}".split("e")[1])
        return f"{value:.{max(decimals + magnitude, 0)}e}"
    return f"{round(value, decimals):.{max(decimals, 0)}f}"


def say_estimate(
    name: str, mean: float, sd: float, hdi94: tuple[float, float], unit: str, *, unreached: bool = False
) -> None:
    """A parameter on stdout; one without any spread was held where it is, an `unreached` limit met by no
    command of the records."""
    after = f" {unit}" if unit else ""
    if sd == 0:
        say(f"{name:32} {mean:.4g}{after}, held")
        return
    at, spread, low, high = (rounded(value, sd) for value in (mean, sd, *hdi94))
    doubt = "; no command reaches it, and how far beyond it lies is its prior's" if unreached else ""
    say(f"{name:32} {at} +- {spread}{after}, 94 % HDI [{low}, {high}]{doubt}")


def say(message: str) -> None:
    """One line on stdout."""
    print(visible(message))


def say_page(page: Report, written: RenderedReport) -> None:
    """The page's sentence and where it lies, on stdout; a warning for what is red on it."""
    for badge in page.badges:
        if badge.state == "bad":
            warn(f"red on the page: {badge.label} ({badge.detail})")
    say(page.verdict)
    say(f"report: {written.html} and {written.pdf}")


def note(message: str) -> None:
    """One line on stdout of what was done without being asked; stderr stays for the one line of an error."""
    print(visible(f"note: {' '.join(message.split())}"))


def warn(message: str) -> None:
    """One line on stderr."""
    print(visible(f"bayes-hw: warning: {' '.join(message.split())}"), file=sys.stderr)


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


def refuse_refuted(corrected: AxisWithEffects | None, folder: str) -> None:
    """Raise InputError where something is missing that is not in the model: nothing can rest on it."""
    if corrected is not None and corrected.answer == ("other",) and not corrected.simulated:
        raise InputError(
            f"{folder}: this axis lacks something that was not found, so that no design can rest on its "
            "model; do the next experiment of verdict.json, and diagnose again"
        )


def warn_of_refuted(posterior: Posterior) -> None:
    """A warning where tests of the residuals refute the model that was sampled."""
    if posterior.failed_tests:
        warn(
            f"the model does not hold: {posterior.refuted_by[0]}; bayes-hw diagnose RECORD... --holdout "
            "RECORD finds what it lacks and gives a corrected posterior"
        )
