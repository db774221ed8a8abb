"""Plain text of the computing modules as a page sets it: signs, powers of ten, squares."""

from __future__ import annotations

import re
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


MINUS = "−"
NO_BREAK_SPACE = "\u00a0"
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

_POWER_OF_TEN = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]?\d+)\b")
_EXPONENT = re.compile(r"(?<=[\w)|])\^(-?\d)(?!\w|\.\d)")
_MINUS_SIGN = re.compile(r"(?<![\w.)\]%-])-(?=[\d∞])|(?<= )-(?= )|(?:(?<=\()|(?<== ))-(?=[\w(])")
"""Before a number, between spaces, and where a formula in brackets or behind a sign of equality begins."""


def typeset(text: str) -> str:
    """`text` of the program's own making: 4.4e-05 as 4.4 × 10⁻⁵, -1 as −1, +- as ±, s^2 as s².

    Not for names that a user chose, which stand as they are.
    """
    shown = _POWER_OF_TEN.sub(_as_power_of_ten, text.replace("+-", "±"))
    return _MINUS_SIGN.sub(MINUS, typeset_unit(shown))


def typeset_unit(unit: str) -> str:
    """`unit` with raised exponents: deg/s^2 as deg/s²."""
    return _EXPONENT.sub(lambda found: found[1].translate(SUPERSCRIPTS), unit)


def squared_unit(unit: str) -> str:
    """The unit of a square: deg², (deg/s)²."""
    return (f"{unit}²" if unit.isalpha() else f"({typeset_unit(unit)})²") if unit else ""


def power_of_ten(exponent: int) -> str:
    """10 with `exponent` raised."""
    return f"10{str(exponent).translate(SUPERSCRIPTS)}"


def _as_power_of_ten(found: re.Match[str]) -> str:
    return f"{found[1]}{NO_BREAK_SPACE}×{NO_BREAK_SPACE}{power_of_ten(int(found[2]))}"
