"""Phrases as the parts of a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def listed(words: Sequence[str]) -> str:
    """One or more phrases: a, b and c."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def log_evidence(gained: float) -> str:
    """How much likelier the records are under one explanation than under another, as a natural logarithm."""
    return f"log evidence {gained:+.0f}"


def in_percent(share: float) -> str:
    """A share in per cent, two digits that count, no exponent: 0.0123 is 1.2 %, 1.36 is 140 %."""
    return f"{float(f'{100 * share:.2g}'):.10g} %"
