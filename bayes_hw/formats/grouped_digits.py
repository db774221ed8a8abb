"""Numbers whose digits stand in groups of three: `1.000,5`, `1,000.5`, `1 000,5`, `1'000.5`, `1.234.567`."""

from __future__ import annotations

import re
from collections.abc import Sequence

BLANKS = "'’ \u00a0\u202f"
GROUPED = re.compile(
    rf"""\s*[+-]?[1-9][0-9]{{0,2}}(?:(?:\.[0-9]{{3}})+,[0-9]*|(?:,[0-9]{{3}})+\.[0-9]*
    |(?:[{BLANKS}][0-9]{{3}})+(?:[.,][0-9]*)?|(?:\.[0-9]{{3}}){{2,}}|(?:,[0-9]{{3}}){{2,}})\s*""",
    re.VERBOSE,
)
"""Of one group before no decimal sign a cell alone does not tell whether it is one: `1.234`."""

_ONE_GROUP = {sign: re.compile(rf"[+-]?[1-9][0-9]{{0,2}}(?:\{sign}[0-9]{{3}})+") for sign in ".,"}


def decimal_sign(cell: str) -> str:
    """Of a grouped number, empty where it has none or is no such number."""
    if not GROUPED.fullmatch(cell):
        return ""
    group = next(sign for sign in cell.strip(" +-") if not sign.isdigit())
    last = next(sign for sign in reversed(cell.strip()) if not sign.isdigit())
    return "" if last == group else last


def without_groups(cells: Sequence[str]) -> list[str]:
    """The cells of a column, those in groups without these and with a decimal point.

    A number that may be one group or a fraction is a group where the column has others in groups with the
    same sign, and no cell in which that sign can only be a decimal one.
    """
    grouped = [cell.strip() for cell in cells if GROUPED.fullmatch(cell)]
    signs = {next(sign for sign in cell.lstrip("+-") if not sign.isdigit()) for cell in grouped}
    doubted = {
        sign
        for sign in signs & set(_ONE_GROUP)
        if all(
            _ONE_GROUP[sign].fullmatch(cell.strip()) or GROUPED.fullmatch(cell)
            for cell in cells
            if sign in cell
        )
    }
    return [_plain(cell, doubted) for cell in cells]


def _plain(cell: str, groups: set[str]) -> str:
    if GROUPED.fullmatch(cell):
        decimal = decimal_sign(cell)
        digits = "".join(sign for sign in cell.strip() if sign.isdigit() or sign in "+-" or sign == decimal)
        return digits.replace(",", ".")
    sign = next((sign for sign in groups if _ONE_GROUP[sign].fullmatch(cell.strip())), None)
    return cell if sign is None else cell.replace(sign, "")
