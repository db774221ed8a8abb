"""Numbers that are not written as one: sexagesimal angles, and numbers with their unit behind them."""

from __future__ import annotations

import re
from typing import NamedTuple

SEXAGESIMAL = re.compile(
    r"""([+-]?)\s*([0-9]{1,3})\s*(?P<first>[:°ºdhᵈʰ ])\s*([0-5]?[0-9])\s*(?:[:'′mᵐ ])\s*
    ((?:[0-5]?[0-9]|60)(?:[.,][0-9]*)?)\s*(?:["″sˢ]|'')?""",
    re.VERBOSE,
)
"""Degrees or hours, minutes of 60 and seconds of 60, to which a last digit may have been rounded."""

WITH_UNIT = re.compile(
    r"([+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?)\s*([^0-9\s.,:+-][^0-9:]{0,15})"
)
"""A number and what stands behind it."""

DEGREES_AN_HOUR = 15.0
"""Of hour angle."""


class Quantity(NamedTuple):
    """A number and its unit, None where the cell states none."""

    value: float
    unit: str | None


def quantity_of(cell: str) -> Quantity | None:
    """`12:30:36` and `12d30m36s` are 12.51 degrees, `1h02m03s` an hour angle in degrees, `0.5 deg/s` a number
    with its unit; None for any other text.

    Angles with colons state no unit: they are taken for degrees unless an option says otherwise.
    """
    found = SEXAGESIMAL.fullmatch(cell.strip())
    if found is not None:
        whole, minutes = float(found[2]), float(found[4])
        seconds = float(found[5].replace(",", "."))
        value = (whole + minutes / 60 + seconds / 3600) * (-1 if found[1] == "-" else 1)
        if found["first"] in "hʰ":
            return Quantity(value * DEGREES_AN_HOUR, "deg")
        return Quantity(value, None if found["first"] in ": " else "deg")
    found = WITH_UNIT.fullmatch(cell.strip())
    if found is None:
        return None
    return Quantity(float(found[1].replace(",", ".")), found[2].strip())
