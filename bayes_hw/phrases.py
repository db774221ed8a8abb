"""Phrases as the parts of a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def listed(words: Sequence[str]) -> str:
    """One or more phrases: a, b and c."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def log_evidence(gained: float) -> str:
    """How much likelier the records are under one explanation than under another, as a natural logarithm."""
    return f"log evidence {gained:+.0f}"
