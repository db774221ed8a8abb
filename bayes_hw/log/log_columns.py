"""The columns of a log under one clock: stamps as seconds, other files and clocks interpolated, repeats
gone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.formats.table import Column, Table
from bayes_hw.log import time_stamps
from bayes_hw.log.clock import StampError, Stamps, read_stamps
from bayes_hw.log.clock_offset import clock_offset
from bayes_hw.log.marked_readings import without_marks
from bayes_hw.log.time_grid import MOST_BRIDGED
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record_checks import HOUR_S, clock_change
from bayes_hw.scale_checks import NO_CLOCK


@dataclass(frozen=True)
class LogColumns:
    """Stamps, command, output (None where there is none) and known signals of one log, shape (rows,).

    NaN is what was not measured; `is_marked` where the output says so itself, the command being known. `rows`
    are the rows of the file, which `place` names in its words, `is_clock` whether the stamps are the file's,
    `is_absolute` whether they were seconds as they are; `clock` as in `bayes_hw.record.Record`.
    """

    t: FloatArray
    u: FloatArray
    y: FloatArray | None
    known: Mapping[str, FloatArray]
    units: Mapping[str, str]
    rows: IntArray
    place: Callable[[int], str]
    kind: str
    is_clock: bool
    is_plain: bool
    said: tuple[str, ...]
    clock: str = "s"
    is_marked: BoolArray | None = None

    def place_of(self, index: int) -> str:
        """Where in the file the row of an index stands."""
        return self.place(int(self.rows[index]))

    def chosen(self, keep: IntArray) -> LogColumns:
        """These rows alone."""
        return replace(
            self,
            t=self.t[keep],
            u=self.u[keep],
            y=None if self.y is None else self.y[keep],
            known={name: values[keep] for name, values in self.known.items()},
            rows=self.rows[keep],
            is_marked=None if self.is_marked is None else self.is_marked[keep],
        )


def log_columns(tables: Sequence[tuple[Path, Table]], options: ReadingOptions) -> LogColumns:
    """The columns that `options` name, from the record's own file, which is the first, and those joined
    to it.

    Raises InputError where one is in none of them, columns have different lengths without clocks of their
    own,
    or stamps cannot be read, go back, or repeat with other values.
    """
    path, table = tables[0]
    wanted = options.wanted
    alone = not options.needs_output and options.columns.output == "y"
    sources = {name: _source(tables, name) for name in [*wanted.values(), *options.known]}
    for role, name in [*wanted.items(), *(("known", name) for name in options.known)]:
        has_clock = role == "time" and wanted["input"] in table.clocks
        absent = sources[name] is None and (bool(table.values) or name in table.missing)
        if absent and not has_clock and not (role == "output" and alone):
            raise _absent(path, table, name, role)
    said = [*table.said]
    time, clock_name = options.columns.time, wanted["input"]
    stamps = None if time is None else _stamps(path, table, time, clock_name, options.time_unit)
    if stamps is not None and stamps.said:
        said.append(f"time: {stamps.said}")
    length = len(_float(path, table, wanted["input"])) if wanted["input"] in table.values else 0
    if stamps is None:
        assert options.sample_rate_hz is not None
        t: FloatArray = np.arange(length) / options.sample_rate_hz
        said.append(f"time counted from 0 s at the given rate of {options.sample_rate_hz:g} Hz")
    else:
        t = stamps.seconds
    signals: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    offsets: dict[Path, float] = {}
    of_output: BoolArray | None = None
    if options.clock_offset is not None and stamps is not None:
        for other_path, other in tables[1:]:
            offsets[other_path], sentence = _offset(tables[0], (other_path, other), stamps, options)
            said.append(sentence)
    _check_lengths(path, table, [name for name in wanted.values() if name in table.values], t)
    for role, name in [*((r, n) for r, n in wanted.items() if r != "time"), *((n, n) for n in options.known)]:
        source = sources[name]
        if source is None:
            continue
        other_path, other = source
        stated = _float(other_path, other, name)
        values = without_marks(other_path, other, name, role, stated, options)
        is_marked = np.isnan(values) & ~np.isnan(stated)
        if is_marked.any():
            said.append(f"{name!r} not measured at {is_marked.sum()} samples, by the readings there")
        own = _own_clock(other_path, other, name, role, options, is_first=other is table)
        if own is not None and stamps is not None:
            behind = 0.0 if other is table else offsets.get(other_path, 0.0)
            values, sentence = _at(t, stamps, own, values, other_path, name, behind)
            if sentence:
                said.append(sentence)
        if len(values) != len(t):
            raise _lengths(path, table, [n for n in wanted.values() if n in table.values])
        signals[role] = values
        if role == "output" and own is None and is_marked.any():
            of_output = is_marked
        if name in other.units:
            units[role] = other.units[name]
    log = LogColumns(
        t,
        signals["input"],
        signals.get("output"),
        {name: signals[name] for name in options.known},
        units,
        np.arange(len(t)),
        table.place,
        table.kind,
        stamps is not None,
        stamps is None or stamps.origin_ns is None,
        tuple(said),
        NO_CLOCK if stamps is None else stamps.unit,
        of_output,
    )
    is_joined = len(tables) > 1 or bool(table.clocks) or options.output_time is not None
    log = _without_summer_time(path, _oldest_first(log), options)
    return _in_part(path, _trimmed(_in_order(path, log), is_joined), options)


def _source(tables: Sequence[tuple[Path, Table]], name: str) -> tuple[Path, Table] | None:
    return next(((path, table) for path, table in tables if name in table.values), None)


def _absent(path: Path, table: Table, name: str, role: str) -> InputError:
    shown = ", ".join(repr(other[:40]) for other in table.names[:20])
    more = ", ..." if len(table.names) > 20 else ""
    without = ", or give --time none --sample-rate RATE" if role == "time" else ""
    if role == "known":
        return InputError(
            f"{path}: no {table.kind} {name!r}, a known input; it has {shown or 'none'}{more}: record it "
            "with the command, or give the file that holds it with --join FILE"
        )
    if table.names and all(map(str.isdecimal, table.names)):
        return InputError(
            f"{path}: row 1 holds numbers: there is no header; name columns by number, from 1 to "
            f"{len(table.names)}, such as --time 1 --input 2 --output 3, or put a header before it, such as "
            "t,u,y"
        )
    return InputError(
        f"{path}: no {table.kind} {name!r} for the {role}; it has {shown or 'none'}{more}: "
        f"map one with --{role} NAME{without}"
    )


def _float(path: Path, table: Table, name: str) -> FloatArray:
    values = table.values[name]
    if values.dtype.kind in "UO":
        raise InputError(f"{path}: {table.kind} {name!r} holds text; give a column of numbers")
    return np.asarray(values, dtype=np.float64)


def _stamps(path: Path, table: Table, name: str, clock_of: str, unit: str | None) -> Stamps:
    own = name not in table.values or (clock_of in table.clocks and len(table.clocks[clock_of]) > 0)
    column = table.clocks[clock_of] if own and clock_of in table.clocks else table.values[name]
    stated = table.clock_units.get(clock_of) if own else table.units.get(name)
    return _read(path, table, column, name, unit or stated)


def _read(path: Path, table: Table, column: Column, name: str, unit: str | None) -> Stamps:
    try:
        stamps = read_stamps(column, name, unit)
    except StampError as error:
        place = f"{table.place(error.index)}, " if len(column) else ""
        raise InputError(f"{path}: {place}{table.kind} {name!r}: {error}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    empty = np.flatnonzero(~np.isfinite(stamps.seconds))
    if len(empty):
        raise InputError(
            f"{path}: {table.place(int(empty[0]))}, {table.kind} {name!r}: empty cell where a time stamp "
            "is to be; "
            "fill it in or remove the row"
        )
    return stamps


def _own_clock(
    path: Path, table: Table, name: str, role: str, options: ReadingOptions, *, is_first: bool
) -> Stamps | None:
    """The clock of a signal where it is not that of the record."""
    time = options.columns.time
    if time is None:
        if is_first:
            return None
        raise InputError(f"{path}: --join needs the clock of the record; give --time NAME")
    if role == "output" and options.output_time is not None and options.output_time in table.values:
        unit = table.units.get(options.output_time)
        return _read(
            path, table, table.values[options.output_time], options.output_time, options.time_unit or unit
        )
    if name in table.clocks:
        unit = table.clock_units.get(name)
        return _read(path, table, table.clocks[name], name, options.time_unit or unit)
    if is_first:
        return None
    if time not in table.values:
        raise _absent(path, table, time, "time")
    return _read(path, table, table.values[time], time, options.time_unit or table.units.get(time))


def _offset(
    first: tuple[Path, Table], second: tuple[Path, Table], stamps: Stamps, options: ReadingOptions
) -> tuple[float, str]:
    """How far the clock of a joined file is ahead, in s, from the signal that both files log; in words."""
    name, time = options.clock_offset or "", options.columns.time or ""
    for path, table in (first, second):
        if name not in table.values:
            raise InputError(
                f"{path}: no {table.kind} {name!r}, which --clock-offset compares: name one that both files "
                "log"
            )
    (path, table), (other_path, other) = first, second
    own = _read(other_path, other, other.values[time], time, options.time_unit or other.units.get(time))
    a, b = _float(path, table, name), _float(other_path, other, name)
    if len(a) != len(stamps.seconds) or len(b) != len(own.seconds):
        raise InputError(f"{other_path}: {name!r} has not as many samples as there are time stamps")
    try:
        found = clock_offset(stamps.seconds, a, _seconds_of(stamps, own, other_path, name), b)
    except InputError as error:
        raise InputError(f"{other_path}: --clock-offset {name!r}: {error}") from None
    low, high = found.interval
    return found.seconds, (
        f"clock of {other_path.name} ahead by {1000 * found.seconds:.4g} ms [{1000 * low:.4g}, "
        f"{1000 * high:.4g}] (94 %), from {name!r} in both files; taken out"
    )


def _seconds_of(base: Stamps, own: Stamps, path: Path, name: str) -> FloatArray:
    """The stamps of another clock in s on the record's."""
    if (base.origin_ns is None) != (own.origin_ns is None):
        raise InputError(
            f"{path}: the clock of {name!r} and that of the record do not count from the same time: one is "
            "absolute, the other not; give both in Unix time or both in s"
        )
    if base.origin_ns is None or own.origin_ns is None:
        return own.seconds
    return own.seconds + (own.origin_ns - base.origin_ns) / 1e9


def _at(
    t: FloatArray, base: Stamps, own: Stamps, values: FloatArray, path: Path, name: str, ahead: float = 0.0
) -> tuple[FloatArray, str]:
    """`values` with a clock of their own, `ahead` by so many s, interpolated linearly at `t`; NaN beyond it
    and in its gaps."""
    when = _seconds_of(base, own, path, name) - ahead
    keep = np.isfinite(when[: len(values)]) & np.isfinite(values[: len(when)])
    when, values = when[: len(keep)][keep], values[: len(keep)][keep]
    if len(when) == len(t) and np.array_equal(when, t):
        return values, ""
    fresh = np.concatenate([[True], np.diff(when) != 0]) if len(when) else np.zeros(0, dtype=np.bool_)
    when, values = when[fresh], values[fresh]
    if len(when) < 2 or (np.diff(when) <= 0).any():
        raise InputError(f"{path}: the time stamps of {name!r} do not increase; sort its rows")
    if when[0] > t[-1] or when[-1] < t[0]:
        raise InputError(
            f"{path}: the clock of {name!r} has no time in common with the record: {when[0]:.6g} to "
            f"{when[-1]:.6g} s "
            f"against {t[0]:.6g} to {t[-1]:.6g} s; check which clocks they are"
        )
    step = float(np.median(np.diff(when)))
    found = np.interp(t, when, values, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(when, t), 1, len(when) - 1)
    hole = (
        (when[after] - when[after - 1] > (MOST_BRIDGED + 1.5) * step)
        & (t > when[after - 1])
        & (t < when[after])
    )
    found[hole] = np.nan
    return found, f"{name!r} interpolated linearly from a clock of its own ({1 / step:.6g} Hz)"


def _check_lengths(path: Path, table: Table, names: Sequence[str], t: FloatArray) -> None:
    own = set(table.clocks)
    lengths = {len(table.values[name]) for name in names if name not in own}
    if len(lengths | {len(t)}) > 1 and not own:
        raise _lengths(path, table, names)


def _lengths(path: Path, table: Table, names: Sequence[str]) -> InputError:
    found = ", ".join(f"{name!r} has {len(table.values[name])}" for name in names)
    return InputError(f"{path}: {found} samples; give {table.kind}s of one length")


def _oldest_first(log: LogColumns) -> LogColumns:
    if not log.is_clock or not time_stamps.runs_backwards(log.t):
        return log
    said = "rows turned round: the newest stood first"
    return replace(log.chosen(np.arange(len(log.t))[::-1]), said=(*log.said, said))


def _without_summer_time(path: Path, log: LogColumns, options: ReadingOptions) -> LogColumns:
    """Stamps that run on where their clock jumps by an hour; raises InputError where gaps are refused."""
    while log.is_clock and (change := clock_change(log.t)) is not None:
        place = log.place_of(change.first)
        if options.gaps == "refuse":
            raise InputError(f"{path}: {place}: {change}")
        t = log.t.copy()
        t[change.first :] -= np.copysign(HOUR_S, t[change.first] - t[change.first - 1])
        said = f"summer time: the hour by which the clock jumps at {place} taken out"
        log = replace(log, t=t, said=(*log.said, said))
    return log


def _in_order(path: Path, log: LogColumns) -> LogColumns:
    """Without rows that repeat one before; raises InputError where a stamp repeats with other values."""
    if not log.is_clock:
        return log
    _, first, inverse = np.unique(log.t, return_index=True, return_inverse=True)
    if len(first) == len(log.t):
        return log
    earlier = first[inverse]
    again = np.flatnonzero(earlier != np.arange(len(log.t)))
    columns = [log.u, *([] if log.y is None else [log.y]), *log.known.values()]
    same = np.ones(len(again), dtype=np.bool_)
    for values in columns:
        a, b = values[again], values[earlier[again]]
        same &= (a == b) | (np.isnan(a) & np.isnan(b))
    if not same.all():
        at = int(again[~same][0])
        if log.t[at] < log.t[at - 1]:
            raise InputError(
                f"{path}: {log.place_of(at)}: time stamp goes back from {float(log.t[at - 1])!r} to "
                f"{float(log.t[at])!r}; remove the row, or give --time none --sample-rate RATE"
            )
        cut = time_stamps.rate_of_cut_stamps(log.t)
        if cut is not None:
            raise InputError(f"{path}: {log.place_of(at)}: {cut_stamps(cut)}")
        raise InputError(
            f"{path}: {log.place_of(at)}: time stamp repeats {float(log.t[at])!r} with other values; "
            "remove one of "
            "the rows, or give --time none --sample-rate RATE"
        )
    kept = log.chosen(np.setdiff1d(np.arange(len(log.t)), again))
    said = f"{len(again)} rows dropped that repeat one before, the first at {log.place_of(int(again[0]))}"
    return replace(kept, said=(*log.said, said))


def cut_stamps(rate_hz: float) -> str:
    """What is said of stamps without their fractions of a second."""
    return (
        f"time stamps are cut to whole seconds, some {rate_hz:g} rows having the same one; give --time none "
        f"--sample-rate {rate_hz:g}"
    )


def _trimmed(log: LogColumns, is_joined: bool) -> LogColumns:
    """Without the rows at both ends that a joined clock does not reach."""
    if not is_joined or log.y is None:
        return log
    shown = np.flatnonzero(np.isfinite(log.u) & np.isfinite(log.y))
    if len(shown) == 0 or len(shown) == len(log.t):
        return log
    kept = log.chosen(np.arange(shown[0], shown[-1] + 1))
    out = len(log.t) - len(kept.t)
    return replace(kept, said=(*log.said, f"{out} rows beyond a joined clock left out")) if out else log


def _in_part(path: Path, log: LogColumns, options: ReadingOptions) -> LogColumns:
    if options.part_s is None or len(log.t) == 0:
        return log
    start, stop = options.part_s
    s = log.t - log.t[0]
    keep = np.flatnonzero((s >= start - 1e-9) & (s < stop))
    if len(keep) == 0:
        raise InputError(
            f"{path}: --part {start:g} {stop:g}: no sample there; the record lasts {s.max():g} s"
        )
    said = f"cut to {start:g} s to {stop:g} s after the first sample"
    return replace(log.chosen(keep), said=(*log.said, said))
