"""Phrases as the parts of a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence

MOST_DECIMALS = 9
"""Decimals beyond which a number is written with a power of ten."""


def listed(words: Sequence[str]) -> str:
    """One or more phrases: a, b and c."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def with_article(noun: str) -> str:
    """One of what the noun names: a mode, an excess."""
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"


def log_evidence(gained: float) -> str:
    """How much likelier the records are under one explanation than under another, as a natural logarithm."""
    return f"log evidence {gained:+.0f}"


def plainly(value: float, digits: int = 3) -> str:
    """A number to so many digits that count, without a power of ten: 5604 to two is 5600."""
    return f"{float(f'{value:.{digits}g}'):.10g}"


def in_percent(share: float) -> str:
    """A share in per cent, two digits that count, no exponent: 0.0123 is 1.2 %, 1.36 is 140 %."""
    return f"{plainly(100 * share, 2)} %"


def rounded(value: float, sd: float) -> str:
    """`value` to the decimal place of the second digit of `sd`, its uncertainty."""
    if not (math.isfinite(value) and math.isfinite(sd) and sd > 0):
        return f"{value:.6g}"
    decimals = 1 - int(f"{sd:.1e}".split("e")[1])
    if decimals > MOST_DECIMALS:
        magnitude = int(f"{value:.0e}".split("e")[1])
        return f"{value:.{max(decimals + magnitude, 0)}e}"
    return f"{round(value, decimals):.{max(decimals, 0)}f}"
