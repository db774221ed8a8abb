"""What a command says to the person who runs it."""

from __future__ import annotations

import sys

from bayes_hw.report.plain_text import visible


def say(message: str) -> None:
    """One line on stdout."""
    print(visible(message))


def warn(message: str) -> None:
    """One line on stderr."""
    print(visible(f"bayes-hw: warning: {' '.join(message.split())}"), file=sys.stderr)
