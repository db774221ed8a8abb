"""A log cut into records of a uniform rate: what its gaps, unmeasured samples and jittered stamps make of
it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.log import time_stamps
from bayes_hw.log.log_columns import LogColumns
from bayes_hw.log.resample import between_measured, describe, resample_columns
from bayes_hw.log.time_grid import MOST_BRIDGED, Grid, fit_grid, parts, stretches
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record_columns import RATE_TOLERANCE
from bayes_hw.scale_checks import CLOCKS

FEWEST_SAMPLES = 32
LOWEST_RATE_HZ, HIGHEST_RATE_HZ = 0.1, 1e6
"""Rates outside are those of stamps in ms, ns or days, not in s."""

MOST_GAPS = 0.5
"""Largest part of a record, in time, that resampling may bridge."""

SAME_RATE = 1e-3
"""Parts of one log whose rates differ by less have the rate of the longest."""

SPLIT = "give --gaps split to begin a new record there"
SPLIT_OR_BRIDGE = (
    "give --gaps bridge to keep single ones as unmeasured, or --gaps split to begin a new record there"
)


@dataclass(frozen=True)
class Part:
    """One record of a log, columns of shape (samples,); `rows` are the rows of the log that its samples come
    from or follow."""

    t: FloatArray
    u: FloatArray
    y: FloatArray
    rate_hz: float
    measured: BoolArray | None
    known: Mapping[str, FloatArray]
    rows: IntArray
    said: tuple[str, ...]

    @property
    def measured_samples(self) -> BoolArray:
        return np.ones(len(self.t), dtype=np.bool_) if self.measured is None else self.measured

    @property
    def has_output(self) -> bool:
        return self.measured is None or bool(self.measured.any())

    def row_of(self, sample: int) -> int:
        """The row of the log that a sample comes from."""
        return int(self.rows[min(sample, len(self.rows) - 1)])


def cut_into_parts(path: Path, log: LogColumns, options: ReadingOptions) -> list[Part]:
    """The records of a log, by `options.gaps` and `options.resample_hz`; raises InputError where they
    leave none.

    A record's rate is that of its grid, or the given one, which has to agree with it. Parts of fewer than 32
    samples are left out, and said.
    """
    _refuse_going_back(path, log)
    if log.is_clock:
        _check_step(path, log.t, log.clock)
    if options.resample_hz is not None and options.gaps == "refuse":
        return [_resampled_whole(path, log, options, options.resample_hz)]
    grids: list[Grid] = []
    for first, stop in stretches(log.t) if log.is_clock else [(0, len(log.t))]:
        grids += _grids(path, log, options, first, stop)
    if options.gaps == "refuse":
        _refuse_missing(path, log, grids)
        _refuse_unmeasured(path, log, options)
    found, short = [], 0
    for grid in grids:
        for part in _parts_of(log, options, grid):
            if len(part.t) < FEWEST_SAMPLES:
                short += len(part.t)
            else:
                found.append(part)
    if not found:
        raise InputError(
            f"{path}: gaps leave no {FEWEST_SAMPLES} samples in a row, which a record needs; give "
            "--resample RATE "
            "(in Hz)" + ("" if options.gaps == "bridge" else ", or --gaps bridge")
        )
    found = [_at_given_rate(path, part, options) for part in _common_rate(found)]
    if len(found) > 1:
        found = [_numbered(part, number, found) for number, part in enumerate(found, start=1)]
    if short:
        word = f"{short} samples left out, in parts of fewer than {FEWEST_SAMPLES}"
        found = [replace(part, said=(*part.said, word)) for part in found]
    if options.resample_hz is not None:
        found = [_resampled_part(path, part, options, options.resample_hz) for part in found]
    return found


def _refuse_going_back(path: Path, log: LogColumns) -> None:
    fault = time_stamps.first_not_increasing(log.t)
    if fault is not None:
        before, here = float(log.t[fault - 1]), float(log.t[fault])
        raise InputError(
            f"{path}: {log.place_of(fault)}: time stamp goes back from {before!r} to {here!r}; "
            "remove the row, or give --time none --sample-rate RATE"
        )


def _check_step(path: Path, t: FloatArray, clock: str) -> None:
    median = float(np.median(np.diff(t)))
    if not 1 / HIGHEST_RATE_HZ <= median <= 1 / LOWEST_RATE_HZ:
        raise InputError(
            f"{path}: time stamps step by {median:.4g} (median); give times in s, at a rate of "
            f"{LOWEST_RATE_HZ:g} to {HIGHEST_RATE_HZ:g} Hz{_in_another_unit(median, clock)}"
        )


def _in_another_unit(step: float, clock: str) -> str:
    """What to do where a step, in s of what the `clock` was taken to count (of Unix stamps, s), would be one
    of 1 to 1000 Hz in another unit; nothing elsewhere."""
    step /= CLOCKS.get(clock, CLOCKS["s"])[0]
    for unit, seconds in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("d", 86_400.0)):
        if unit != clock and 1e-3 <= step * seconds <= 1.0:
            return (
                f"; if they are in {unit}, which makes {1 / (step * seconds):.6g} Hz, give --time-unit {unit}"
            )
    return ""


def _grids(path: Path, log: LogColumns, options: ReadingOptions, first: int, stop: int) -> list[Grid]:
    """The grid of some rows, as one; short stretches that have none are left to be dropped."""
    rows = stop - first
    if not log.is_clock:
        rate = options.sample_rate_hz or 1.0
        return [Grid(first, stop, np.arange(rows), float(log.t[first]), rate, 0.0)]
    if rows < FEWEST_SAMPLES and options.gaps != "refuse":
        return [Grid(first, stop, np.arange(rows), float(log.t[first]), 1.0, 0.0)]
    grid = fit_grid(log.t[first:stop], first) if rows > 2 else None
    if grid is None and options.gaps == "refuse" and rows < len(log.t):
        return [Grid(first, stop, np.arange(rows), float(log.t[first]), 1.0, 0.0)]
    if grid is None:
        raise _uneven(path, log, first, stop)
    return [grid]


def _uneven(path: Path, log: LogColumns, first: int, stop: int) -> InputError:
    at = first + (time_stamps.first_step_change(log.t[first:stop]) if stop - first > 2 else 1)
    before, here = np.diff(log.t)[at - 2 : at]
    return InputError(
        f"{path}: {log.place_of(at)}: time step changes from {before:.4g} s to {here:.4g} s, on no uniform "
        "grid; "
        "give --resample RATE (in Hz) to put the record on one"
    )


def _refuse_missing(path: Path, log: LogColumns, grids: Sequence[Grid]) -> None:
    first = grids[0]
    if len(grids) == 1 and not first.missing:
        return
    holes = np.flatnonzero(np.diff(first.places) > 1)
    at = first.first + int(holes[0]) + 1 if len(holes) else first.stop
    median = float(np.median(np.diff(log.t)))
    step = float(log.t[at] - log.t[at - 1])
    missing = sum(grid.missing for grid in grids)
    gaps = len(grids) - 1
    counts = [f"{missing} {'single sample' if missing == 1 else 'single samples'}"] if missing else []
    counts += [f"{gaps} longer {'gap' if gaps == 1 else 'gaps'}"] if gaps else []
    remedy = SPLIT_OR_BRIDGE if missing else SPLIT
    raise InputError(
        f"{path}: {log.place_of(at)}: time step changes from {median:.4g} s to {step:.4g} s: samples are "
        "missing "
        f"({', '.join(counts)} in all); {remedy}, or --resample RATE (in Hz)"
    )


def _refuse_unmeasured(path: Path, log: LogColumns, options: ReadingOptions) -> None:
    for role, values in (("input", log.u), ("output", log.y)):
        is_empty = np.zeros(0, dtype=np.bool_) if values is None else ~np.isfinite(values)
        if role == "output" and log.is_marked is not None:
            is_empty &= ~log.is_marked
        empty = np.flatnonzero(is_empty)
        if len(empty):
            raise InputError(
                f"{path}: {log.place_of(int(empty[0]))}, {log.kind} {options.wanted[role]!r}: empty cell "
                "or NaN, so "
                f"not measured ({len(empty)} in all); {SPLIT_OR_BRIDGE}"
            )


def _parts_of(log: LogColumns, options: ReadingOptions, grid: Grid) -> list[Part]:
    """The parts of one grid, cut where too many samples in a row are unmeasured."""
    rows = np.arange(grid.first, grid.stop)
    u, y = _on_grid(log.u[rows], grid), None if log.y is None else _on_grid(log.y[rows], grid)
    known = {name: _on_grid(values[rows], grid) for name, values in log.known.items()}
    present = np.isfinite(u) if y is None else np.isfinite(u) & np.isfinite(y)
    if log.is_marked is not None:
        present |= np.isfinite(u) & (_on_grid(log.is_marked[rows].astype(np.float64), grid) == 1)
    nearest = rows[np.searchsorted(grid.places, np.arange(grid.samples), side="right") - 1]
    keeps_stamps = log.is_plain and not grid.missing and grid.jitter == 0
    found = []
    for start, stop in parts(present, MOST_BRIDGED if options.gaps == "bridge" else 0):
        chosen = slice(start, stop)
        t = log.t[rows[chosen]] if keeps_stamps else grid.start_s + np.arange(start, stop) / grid.rate_hz
        measured = np.zeros(stop - start, dtype=np.bool_) if y is None else np.isfinite(y[chosen])
        said = _said_of(u[chosen], measured, y is not None, grid)
        found.append(
            Part(
                t,
                _filled(u[chosen]),
                np.zeros(stop - start) if y is None else _filled(y[chosen]),
                grid.rate_hz,
                None if measured.all() else measured,
                {name: _filled(values[chosen]) for name, values in known.items()},
                nearest[chosen],
                said,
            )
        )
    return found


def _said_of(u: FloatArray, measured: BoolArray, has_output: bool, grid: Grid) -> tuple[str, ...]:
    said = []
    if grid.jitter:
        said.append(
            f"stamps off a uniform grid of {grid.rate_hz:.6g} Hz by up to {100 * grid.jitter:.0f} % of a "
            "step: values "
            "taken as they are, on the grid (--resample RATE interpolates them instead)"
        )
    if has_output and not measured.all():
        said.append(f"{int((~measured).sum())} of {len(measured)} samples unmeasured, kept as such")
    if not np.isfinite(u).all():
        said.append(
            f"command interpolated at {int((~np.isfinite(u)).sum())} samples; where it stepped there, the "
            "angle keeps what was missed"
        )
    return tuple(said)


def _on_grid(values: FloatArray, grid: Grid) -> FloatArray:
    found = np.full(grid.samples, np.nan)
    found[grid.places] = values
    return found


def _filled(values: FloatArray) -> FloatArray:
    """`values` with what was not measured between its neighbours; zeros where nothing was."""
    shown = np.flatnonzero(np.isfinite(values))
    if len(shown) == len(values):
        return values
    return np.interp(np.arange(len(values)), shown, values[shown]) if len(shown) else np.zeros(len(values))


def _common_rate(found: Sequence[Part]) -> list[Part]:
    """The parts at the rate of the longest, where theirs are the same within what short parts can tell."""
    rate = max(found, key=lambda part: len(part.t)).rate_hz
    return [
        replace(part, rate_hz=rate) if abs(part.rate_hz / rate - 1) < SAME_RATE else part for part in found
    ]


def _at_given_rate(path: Path, part: Part, options: ReadingOptions) -> Part:
    given, rate = options.sample_rate_hz, part.rate_hz
    if given is None or given == rate:
        return part
    _check_rate(path, rate, given)
    said = f"taken at the given {given:g} Hz, the time stamps saying {rate:.8g} Hz"
    return replace(part, rate_hz=given, said=(*part.said, said))


def _check_rate(path: Path, rate: float, given: float) -> None:
    if not abs(rate / given - 1) <= RATE_TOLERANCE:
        raise InputError(
            f"{path}: the time stamps say {rate:.6g} Hz, --sample-rate says {given:g} Hz; "
            "correct one, or give --time none to ignore the stamps"
        )


def _numbered(part: Part, number: int, found: Sequence[Part]) -> Part:
    stretch = f"{part.t[0]:.6g} s to {part.t[-1]:.6g} s of the log"
    said = f"part {number} of {len(found)}: {stretch}, counted from its start"
    return replace(part, t=part.t - part.t[0], said=(*part.said, said))


def _resampled_whole(path: Path, log: LogColumns, options: ReadingOptions, rate_hz: float) -> Part:
    """Every row of a log, however uneven, on a grid of `rate_hz`; unmeasured samples stay as such."""
    measured = np.zeros(len(log.t), dtype=np.bool_) if log.y is None else np.isfinite(log.y)
    y = np.zeros(len(log.t)) if log.y is None else _filled_at(log.t, log.y)
    known = {name: _filled_at(log.t, values) for name, values in log.known.items()}
    uniform = time_stamps.is_uniform(log.t)
    rate = time_stamps.mean_rate(log.t) if uniform else 1 / float(np.median(np.diff(log.t)))
    if not log.is_clock and options.sample_rate_hz is not None:
        rate = options.sample_rate_hz
    t = log.t
    mask = None if measured.all() else measured
    part = Part(t, _filled_at(t, log.u), y, rate, mask, known, np.arange(len(t)), ())
    part = _at_given_rate(path, part, options)
    if uniform and part.rate_hz == rate_hz:
        return part
    ends = time_stamps.gaps(t)
    missing = t[ends] - t[ends - 1]
    share = float(missing.sum() / (t[-1] - t[0]))
    if share > MOST_GAPS:
        longest = int(missing.argmax())
        raise InputError(
            f"{path}: {log.place_of(int(ends[longest]))}: a gap of {missing[longest]:.4g} s; gaps are "
            f"{100 * share:.0f} % of the record: cut it into parts without them, as --gaps split does"
        )
    said = describe(t, rate_hz, log.place_of)
    return _resampled(path, replace(part, said=(*part.said, said)), options, rate_hz)


def _filled_at(t: FloatArray, values: FloatArray) -> FloatArray:
    shown = np.isfinite(values)
    return values if shown.all() or not shown.any() else np.interp(t, t[shown], values[shown])


def _resampled_part(path: Path, part: Part, options: ReadingOptions, rate_hz: float) -> Part:
    if part.rate_hz == rate_hz:
        return part
    said = describe(part.t, rate_hz, lambda index: f"sample {index + 1}")
    return _resampled(path, replace(part, said=(*part.said, said)), options, rate_hz)


def _resampled(path: Path, part: Part, options: ReadingOptions, rate_hz: float) -> Part:
    """The part on a grid of `rate_hz`; a command that is a position is interpolated, not averaged."""
    try:
        t, u, y = resample_columns(part.t, part.u, part.y, rate_hz)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if len(t) < FEWEST_SAMPLES:
        raise InputError(
            f"{path}: --resample {rate_hz:g} leaves {len(t)} samples of the "
            f"{FEWEST_SAMPLES} that a record needs; give a higher rate"
        )
    if options.input_position is not None:
        u = np.interp(t, part.t, part.u)
    return replace(
        part,
        t=t,
        u=u,
        y=y,
        rate_hz=rate_hz,
        measured=None if part.measured is None else between_measured(part.t, part.measured, t),
        known={name: np.interp(t, part.t, values) for name, values in part.known.items()},
        rows=part.rows[np.clip(np.searchsorted(part.t, t, side="right") - 1, 0, len(part.rows) - 1)],
    )
