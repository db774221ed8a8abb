"""What a command says to the person who runs it."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

from bayes_hw.report.page.typography import visible

if TYPE_CHECKING:
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
