"""Headers of tables: a name with its unit, in the ways in which logs write them.

Headers of channels that each have a clock of their own: a property a row, its name and value by turns.

TwinCAT Scope writes such files: lines `Name`, `Data-Type`, `SampleTime[ms]`, `Unit` and others, each key
repeated before the value of every channel, then rows of a time in ms and a value by turns.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from bayes_hw.quantities import KNOWN_WORDS

UNIT_WORDS = KNOWN_WORDS | frozenset((
    "ms", "millisecond", "milliseconds", "us", "µs", "μs", "microsecond", "microseconds", "ns", "nsec",
    "nanosecond", "nanoseconds", "min", "minute", "minutes", "hour", "hours", "d", "day", "days", "mrad",
    "urad", "µrad", "μrad", "nrad", "mdeg", "udeg", "µdeg", "μdeg", "uas", "µas", "μas",
    "turn", "turns", "rpm", "hourangle", "hms", "step", "steps", "mil", "v", "volt",
    "mv", "kv", "a", "ampere", "ma", "n", "n·m", "kn", "w", "kw", "j", "m", "mm", "cm", "km", "µm", "um",
    "k", "kelvin", "c", "°c", "degc", "hz", "khz", "pa", "hpa", "mbar", "bar", "g", "kg", "-", "1", "%",
    "iso", "iso8601", "unix", "epoch", "utc", "tai", "mjd", "jd", "date", "datetime", "timestamp", "none",
))  # fmt: skip
"""Words that tell a unit from another word in brackets or in a row of units."""

TIME_WORDS = (
    "time",
    "timestamp",
    "t",
    "datetime",
    "date",
    "epoch",
    "stamp",
    "x_value",
    "mjd",
    "utc",
    "clock",
)
SUFFIXES = {
    "s": "s", "sec": "s", "ms": "ms", "msec": "ms", "us": "us", "usec": "us", "ns": "ns", "nsec": "ns",
    "min": "min", "deg": "deg", "rad": "rad", "mrad": "mrad", "arcsec": "arcsec", "arcmin": "arcmin",
    "deg_s": "deg/s", "deg_per_s": "deg/s", "deg_per_sec": "deg/s", "degps": "deg/s", "dps": "deg/s",
    "rad_s": "rad/s", "rad_per_s": "rad/s", "radps": "rad/s", "mrad_s": "mrad/s", "arcsec_s": "arcsec/s",
    "arcsec_per_s": "arcsec/s", "arcmin_s": "arcmin/s", "rpm": "rpm", "counts": "counts",
}  # fmt: skip
"""Endings of names after an underscore, and the units that they state."""

_UNIT_ALONE = re.compile(
    r"(?:deg(?:rees?)?|rad(?:ians?)?|mrad|arcsec|arcmin|°)(?:\s*/\s*s(?:ec)?)?|rpm|dps|(?:milli|micro|nano)?seconds"
    r"|hours|minutes|[mun]s",
    re.IGNORECASE,
)
"""Names of columns that are a unit and nothing else."""

_BRACKETS = re.compile(r"^(.*?)[\s_]*[\[({<]([^\[\](){}<>]*)[\])}>]\s*$", re.DOTALL)
_INDEX = re.compile(r"\w\[\d+\]$")
"""One of several: `position[0]`."""
_SLASH = re.compile(r"^([^/]*[^/\s])/(?=(?:[sVAh°]|.*\S{2}.*)$)(\S+)$")
"""A quantity over its unit: `Time/s`, `Rate/(deg/s)`; of one letter, in the case of the unit alone."""
_SPLITTERS = re.compile(r"^(.*\S)\s*(?:,|:|\s/|\sin\s)\s*(\S+)$")


def looks_like_unit(text: str) -> bool:
    """Whether every word of `text` is that of a unit."""
    words = [
        word for word in re.split(r"[/*^·.\s()²⁻¹]+|per|(?<=[a-z°])-?[0-9]\b", text.strip().lower()) if word
    ]
    return (
        0 < len(words) <= 4
        and len(text) <= 32
        and all(word in UNIT_WORDS or _is_number(word) for word in words)
    )


def _is_number(word: str) -> bool:
    return bool(re.fullmatch(r"[0-9]+([.,][0-9]+)?(e-?[0-9]+)?", word))


def bare_unit(cell: str) -> str:
    """A cell of a row of units without the brackets around it."""
    text = cell.strip()
    return text[1:-1].strip() if len(text) > 1 and text[0] + text[-1] in ("[]", "()", "{}", "<>") else text


def split_name(cell: str) -> tuple[str, str | None]:
    """Name and unit of a header's cell such as `u [deg/s]`, `u (deg/s)`, `u, deg/s`, `u / deg` or
    `u_deg_s`, or `u/deg`."""
    text = cell.strip()
    if _INDEX.search(text):
        return text, None
    if _UNIT_ALONE.fullmatch(text):
        return text, SUFFIXES.get(text.lower(), text)
    for pattern in (_BRACKETS, _SPLITTERS, _SLASH):
        match = pattern.match(text)
        if match and match[1].strip() and looks_like_unit(match[2]):
            return match[1].strip().rstrip(" /,:"), bare_unit(match[2])
    for suffix in sorted(SUFFIXES, key=len, reverse=True):
        if text.lower().endswith(f"_{suffix}") and len(text) > len(suffix) + 1:
            return text[: -len(suffix) - 1], SUFFIXES[suffix]
    return text, None


def unit_of(cell: str) -> str | None:
    """The unit that a header's cell states."""
    return split_name(cell)[1]


def matches(names: Sequence[str], wanted: str) -> list[int]:
    """Positions of the columns that `wanted` names: exactly, else without their units, else in any case."""
    bare = [split_name(name)[0] for name in names]
    bracketed = [match[1].strip() if (match := _BRACKETS.match(name)) else name for name in names]
    folded = wanted.casefold()
    for found in (
        [i for i, name in enumerate(names) if name == wanted],
        [i for i, name in enumerate(bare) if name == wanted],
        [i for i, name in enumerate(bracketed) if name == wanted],
        [i for i, name in enumerate(names) if name.casefold() == folded],
        [i for i, name in enumerate(bare) if name.casefold() == folded],
    ):
        if found:
            return found
    return []


def is_time_name(name: str) -> bool:
    """Whether a column of this name is likely to be a clock."""
    bare = split_name(name)[0].casefold().strip("_ ")
    return bare in TIME_WORDS or bare.endswith(("time", "timestamp", "_t", "mjd"))


LEAST_ROWS = 3
"""Properties from which on such a block is no accident."""

NAME, UNIT = "name", "unit"


def paired_header(rows: Sequence[Sequence[str]], columns: int) -> tuple[list[str], list[str]] | None:
    """Names and units of the columns (times and values by turns), None where `rows` are no such header.

    The first clock is called "time", the others after their channel; a repeated key is that of the last row.
    """
    properties = {}
    for row in rows:
        keys = {cell.strip().lower() for cell in row[0:columns:2]}
        if columns >= 2 and columns % 2 == 0 and len(row) >= columns - 1 and len(keys) == 1 and keys != {""}:
            values = [cell.strip() for cell in row[1:columns:2]]
            properties[keys.pop()] = values + [""] * (columns // 2 - len(values))
    named = properties.get(NAME, [])
    if len(properties) < LEAST_ROWS or not named or not all(named):
        return None
    names, units = [], []
    for number, (name, unit) in enumerate(zip(named, properties.get(UNIT, [""] * len(named)), strict=True)):
        names += ["time" if number == 0 else f"{name} time", name]
        units += ["ms", unit.strip("[]()")]
    return names, units


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
