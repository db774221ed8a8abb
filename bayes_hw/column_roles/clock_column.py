"""Which column of a log holds its time stamps, and which those of one signal alone."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, split_name
from bayes_hw.formats.split_seconds import halves_of
from bayes_hw.formats.table import Table
from bayes_hw.log.clock import Stamps, read_stamps
from bayes_hw.log.log_columns import cut_stamps
from bayes_hw.log.time_stamps import rate_of_cut_stamps
from bayes_hw.reading_options import Columns, ReadingOptions

CLOCK_NAME = re.compile(r"(^|[_. ])(t|time|timestamp|stamp|clock)([_. ]|$)|time$", re.IGNORECASE)
"""Names of columns that may be the clock of a signal."""


WHOLE_SECONDS = ("sec", "secs", "seconds", "tv_sec")
"""Names of stamps whose fractions stand in another column."""


def rows_of(table: Table) -> int:
    """Rows of the longest column."""
    return max((len(values) for values in table.values.values()), default=0)


def clock_of(table: Table, options: ReadingOptions) -> tuple[Stamps | None, str | None, str]:
    """The column of time stamps: the one named, else by its name, else the first that increases evenly."""
    asked = options.columns.time
    names = list(table.values)
    if asked is not None and asked != Columns.time and asked in names:
        return _stamps(table, asked), asked, "named"
    split = [name for name in names if halves_of(name) is not None]
    named = [name for name in names if is_time_name(name) and name not in split]
    for name in [*([asked] if asked in names else []), *split, *named]:
        assert name is not None
        stamps = _stamps(table, name)
        if stamps is not None and _increases(stamps.seconds):
            return stamps, name, "by its name"
    for name in names:
        stamps = _stamps(table, name)
        if stamps is None or _counts_rows(table, name) or _goes_back(stamps.seconds):
            continue
        if _increases(stamps.seconds) and _is_even(stamps.seconds):
            return stamps, name, "it increases evenly"
    return None, None, ""


def _counts_rows(table: Table, name: str) -> bool:
    """Whether a column numbers the rows, from 0 or 1, and states no unit of time."""
    values = table.values[name]
    if values.dtype.kind in "UO" or len(values) < 2 or name in table.units:
        return False
    return values[0] in (0, 1) and bool((np.diff(values) == 1).all())


def _goes_back(t: FloatArray) -> bool:
    """Whether stamps rise and fall, as the fractions of a second beside whole ones do."""
    steps = np.diff(t[np.isfinite(t)])
    return bool((steps > 0).any() and (steps < 0).any())


def on_one_clock(table: Table, options: ReadingOptions) -> tuple[Table, Stamps | None]:
    """The columns that have clocks of their own at the stamps of the first of them, and those stamps; as it
    is, and None, where none has one that increases."""
    stamps: dict[str, Stamps] = {}
    for name, column in table.clocks.items():
        if name in table.values and table.values[name].dtype.kind not in "UO":
            try:
                found = read_stamps(column, name, options.time_unit or table.clock_units.get(name))
            except InputError:
                continue
            if _increases(found.seconds) and len(found.seconds) == len(table.values[name]):
                stamps[name] = found
    if not stamps:
        return table, None
    base = next(iter(stamps.values()))
    moved = {
        name: np.interp(base.seconds, own.seconds + _behind(own, base), table.values[name])
        for name, own in stamps.items()
    }
    return replace(table, values={**table.values, **moved}), base


def _behind(clock: Stamps, base: Stamps) -> float:
    """The origin of a clock less that of another, s; none where one of them counts from anything."""
    if clock.origin_ns is None or base.origin_ns is None:
        return 0.0
    return (clock.origin_ns - base.origin_ns) / 1e9


def second_clock(table: Table, clock: Stamps, options: ReadingOptions) -> tuple[ReadingOptions, list[str]]:
    """The clock of the output, where one of its own stands before it in the table."""
    names = list(table.values)
    output = next((name for name in names if split_name(name)[0] == options.columns.output), None)
    if output is None or options.columns.time is None:
        return options, []
    own = (options.columns.time, *(halves_of(options.columns.time) or ()))
    for name in reversed(names[: names.index(output)]):
        if name in own:
            break
        stamps = _stamps(table, name) if CLOCK_NAME.search(name) else None
        if stamps is None or not (_increases(stamps.seconds) and _is_even(stamps.seconds)):
            continue
        if len(stamps.seconds) == len(clock.seconds) and np.array_equal(stamps.seconds, clock.seconds):
            continue
        return replace(options, output_time=name), [f"clock of {output!r}: {name!r}, one of its own"]
    return options, []


def no_clock(table: Table, options: ReadingOptions) -> str:
    """What is asked where no column is a clock."""
    if rows_of(table) < 4:
        return f"holds {rows_of(table)} rows of data; give a log with samples"
    asked = options.columns.time
    named = [
        name
        for name in table.values
        if name == asked or is_time_name(name) or name.casefold() in WHOLE_SECONDS
    ]
    if named:
        try:
            seconds = read_stamps(table.values[named[0]], named[0], table.units.get(named[0])).seconds
        except InputError as error:
            return f"which column is the clock? {named[0]!r}: {error}"
        cut = rate_of_cut_stamps(seconds[np.isfinite(seconds)])
        if cut is not None:
            return cut_stamps(cut)
    why = f" {named[0]!r} holds no stamps that increase;" if named else ""
    return f"which column is the clock?{why} give --time NAME, or --time none --sample-rate HZ"


def _stamps(table: Table, name: str) -> Stamps | None:
    try:
        return read_stamps(table.values[name], name, table.units.get(name))
    except InputError:
        return None


def _increases(t: FloatArray) -> bool:
    """Or, the newest standing first, decreases."""
    steps = np.diff(t[np.isfinite(t)])
    return len(steps) > 2 and max(float(np.mean(steps > 0)), float(np.mean(steps < 0))) > 0.9


def _is_even(t: FloatArray) -> bool:
    steps = np.diff(t[np.isfinite(t)])
    median = float(np.median(steps))
    return median > 0 and float(np.mean(np.abs(steps - median) < median / 3)) > 0.8


def rate_of(clock: Stamps | None, options: ReadingOptions) -> float | None:
    """Samples a second: by the median step of the stamps, else as given; None without either."""
    if clock is None:
        return options.sample_rate_hz
    step = abs(float(np.nanmedian(np.diff(clock.seconds))))
    return 1 / step if step > 0 else None
