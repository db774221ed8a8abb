"""Logs of lines that name their values, `t=0.1 u=2 y=3`, with or without a stamp and words before them.

So write programs that print, loggers (log4j, logging, ROS), logfmt and InfluxDB's line protocol. Lines that
name no number are other messages of the program.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, matches
from bayes_hw.formats.long_table import MOST_SIGNALS, table_of_fields
from bayes_hw.formats.table import Table

HEAD_BYTES, HEAD_LINES, FEWEST_LINES = 2**16, 200, 12
LONGEST_LINE = 4096
"""Characters of a line that are looked at."""

PAIR = re.compile(
    r"""(?<![\w.:"'])(?P<name>[A-Za-z_][\w./\[\]-]{0,63}?)\s?[=:]\s?
    (?P<value>[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?|(?i:nan|null|none))
    (?P<unit>[^\W\d_][^\s,;|)\]}"']*|[°%][^\s,;|)\]}"']*)?(?=[\s,;|)\]}]|$)""",
    re.VERBOSE | re.ASCII,
)
"""A name and its number, and the unit that may stand right behind it; no other number follows a comma, since
names begin with letters."""

DATE = re.compile(
    r"""(?<!\d)(?:[0-9]{4}[-/.][0-9]{2}[-/.][0-9]{2}|[0-9]{1,2}[-/.](?:[0-9]{1,2}|[A-Z][a-z]{2})[-/.][0-9]{4})
    [ T_]?\s?[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?(?:\s?Z|\s?[+-][0-9]{2}:?[0-9]{2}(?!\d))?""",
    re.VERBOSE,
)
TIME_OF_DAY = re.compile(r"(?<![\d:])[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?")
SECONDS = re.compile(r"(?<![\w.])[0-9]+\.[0-9]+(?![\w.])|^\W*[0-9]+(?![\w.])")
AT_END = re.compile(r"\s([0-9]{9,19})\s*$")
"""Where a stamp may stand outside of a pair: before the pairs, or as a whole number behind them."""

WORD = re.compile(r"([A-Za-z_][\w.]*)\W*$")
WHOLE = ("i", "u")
"""What InfluxDB writes behind a whole number."""


@dataclass(frozen=True)
class NamedValues:
    """A line's stamp and the name of it, "" where there is none, the word before its first pair, and the
    pairs: name, number and unit as they are written."""

    stamp: str
    clock: str
    word: str
    pairs: tuple[tuple[str, str, str], ...]


def named_values(line: str) -> NamedValues | None:
    """What a line names, None where it names no number."""
    found = list(PAIR.finditer(line))
    if not found:
        return None
    pairs = tuple((m["name"], m["value"].replace(",", "."), m["unit"] or "") for m in found)
    before = line[: found[0].start()]
    word = WORD.search(before)
    own = next((pair for pair in pairs if is_time_name(pair[0])), None)
    if own is not None:
        others = tuple(pair for pair in pairs if pair is not own)
        return NamedValues(own[1], own[0], word[1] if word else "", others)
    stamp = DATE.search(line) or TIME_OF_DAY.search(before) or SECONDS.search(before)
    if stamp is not None:
        return NamedValues(stamp[0].strip(" [({"), "time", word[1] if word else "", pairs)
    behind = AT_END.search(line, found[-1].end())
    return NamedValues(behind[1] if behind else "", "time" if behind else "", word[1] if word else "", pairs)


def holds_key_values(path: Path) -> bool:
    """Whether most lines of a text file name two numbers, or one with a stamp."""
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES).decode("utf-8-sig", "replace")
    if "=" not in head and ":" not in head:
        return False
    lines = [line[:LONGEST_LINE] for line in head.splitlines()[:-1] if line.strip()][:HEAD_LINES]
    held = [named_values(line) for line in lines]
    good = [one for one in held if one is not None and len(one.pairs) + bool(one.clock) > 1]
    return len(good) >= FEWEST_LINES and 2 * len(good) > len(lines)


def read_key_values(
    path: Path, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()
) -> Table:
    """Read the signals that `wanted` names as columns, as `table_of_fields` has them.

    Where a name stands behind several words, as of several axes, it is WORD.NAME. Raises InputError on more
    names than signals can be, and on text that is not UTF-8.
    """
    signals: dict[tuple[str, str], tuple[list[str], list[str]]] = {}
    units: dict[tuple[str, str], str] = {}
    words: dict[str, set[str]] = defaultdict(set)
    clock, others = "", 0
    for line in _lines(path):
        held = named_values(line)
        if held is None:
            others += 1
            continue
        clock = clock or held.clock
        for name, value, unit in held.pairs:
            key = held.word, name
            words[name].add(held.word)
            stamps, values = signals.setdefault(key, ([], []))
            if len(signals) > MOST_SIGNALS:
                raise InputError(
                    f"{path}: its lines name more than {MOST_SIGNALS} signals; select those of the record"
                )
            units.setdefault(key, "" if unit in WHOLE else unit)
            if len(values) < most_rows:
                stamps.append(held.stamp)
                values.append(value)
    names = {key: key[1] if len(words[key[1]]) == 1 else f"{key[0]}.{key[1]}" for key in signals}
    fields = {names[key]: columns for key, columns in signals.items()}
    said = ["lines of names and values"]
    if others:
        said.append(f"{others} lines that name no number left out")
    table = table_of_fields(path, clock, fields, wanted, text if clock else (), tuple(said))
    stated = {names[key]: unit for key, unit in units.items() if unit}
    found = {name: matches(list(stated), name) for name in wanted}
    listed = table.names if clock else table.names[1:]
    return replace(
        table, names=listed, units={name: stated[list(stated)[at[0]]] for name, at in found.items() if at}
    )


def _lines(path: Path) -> Iterator[str]:
    """The beginning of every line that is not blank."""
    try:
        with path.open(encoding="utf-8-sig") as stream:
            begun = False
            for part in iter(lambda: stream.readline(LONGEST_LINE), ""):
                if not begun and not part.isspace():
                    yield part
                begun = not part.endswith("\n")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; write it again") from None
