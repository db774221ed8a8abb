"""Texts for people: every character shows, phrases become sentences."""

from __future__ import annotations

import unicodedata

HIDDEN_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn"})
"""Unicode's controls, format marks, lone surrogates, private and unassigned code points."""

LAYOUT_CHARACTERS = frozenset("\u00ad\u200b\u2060")
"""Format characters without a visible effect of their own beyond line breaking; they are dropped."""


def visible(text: str) -> str:
    """`text` on one line, with each character that would not show written as its code, ‹U+202E›.

    White space of every kind becomes a plain space (no-break spaces stay). Direction marks and overrides are
    written out, so that a name cannot rearrange what surrounds it.
    """
    return "".join(_visible_character(character) for character in text)


def _visible_character(character: str) -> str:
    if character in LAYOUT_CHARACTERS:
        return ""
    if character in "\t\n\v\f\r\u2028\u2029":
        return " "
    if unicodedata.category(character) in HIDDEN_CATEGORIES:
        return f"‹U+{ord(character):04X}›"
    return character
