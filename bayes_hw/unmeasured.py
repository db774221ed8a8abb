"""Readings that stand for none: marks such as -999 that a log writes where nothing was measured, and readings
at the end of a converter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, stretches_of
from bayes_hw.errors import InputError
from bayes_hw.record_checks import TURNS, flat_stretches

ENDS, NOTHING = "ends", "none"
"""Words of `--missing`: readings at either end of the converter; that nothing is a mark."""

JUMP_FACTOR = 8.0
"""An angle goes to a mark and comes back from it by this many times the largest of its other steps."""

JUMP_SHARE = 0.8
"""Least part of the stretches of one reading that do so, where it is a mark."""

BEYOND = 8.0
"""A command that is a mark is this many times as large as any other."""

LARGEST_INTEGERS = frozenset((2**15 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1))


@dataclass(frozen=True)
class Mark:
    """A reading that stands for none, how many samples are it, and the first of them."""

    reading: float
    count: int
    first: int

    def __str__(self) -> str:
        samples = "one sample reads" if self.count == 1 else f"{self.count} samples read"
        value = written(self.reading)
        return (
            f"{samples} exactly {value}, far from what stands before and after: a mark for what was not "
            f"measured; give --missing {value} (--missing {NOTHING} where it was)"
        )


def written(reading: float) -> str:
    """A reading as it is typed."""
    return f"{reading:.0f}" if reading == round(reading) and abs(reading) < 1e25 else f"{reading:.15g}"


def checked_readings(missing: Sequence[float | str]) -> tuple[float, ...]:
    """The readings among what `--missing` was given; raises InputError on what is none and no word of it."""
    found = []
    for given in missing:
        if given in (ENDS, NOTHING):
            continue
        try:
            found.append(float(given))
        except ValueError:
            raise InputError(
                f"--missing {given!r}: give a reading such as -999, {ENDS} for the ends of the converter, or "
                f"{NOTHING}"
            ) from None
    return tuple(found)


def is_unmeasured(values: FloatArray, missing: Sequence[float | str]) -> BoolArray:
    """Which samples `missing` says were not measured; shape (samples,). Ends are the largest and the smallest
    reading where the output stays there."""
    found = np.isin(values, checked_readings(missing))
    if ENDS in missing:
        ends = [float(np.nanmax(values)), float(np.nanmin(values))] if np.isfinite(values).any() else []
        found |= np.isin(values, [limit for limit in ends if len(flat_stretches(values, limit)[0])])
    return found


def is_unmeasured_command(u: FloatArray, missing: Sequence[float | str]) -> BoolArray:
    """Of a command, where such a reading lies far beyond every other: a command of 0 is one where the angle
    that reads 0 is none."""
    found = np.isin(u, checked_readings(missing))
    others = float(np.abs(u[~found & np.isfinite(u)]).max(initial=0.0))
    return found & (np.abs(u) >= BEYOND * others)


def mark_of_angle(y: FloatArray) -> Mark | None:
    """The reading to which an angle jumps, and from which it comes back to where it was: twice or more, or
    one that programs write for nothing. Glitches of many sizes have none in common; a wrap is no mark."""
    shown = np.flatnonzero(np.isfinite(y))
    values = y[shown]
    if len(values) < 8:
        return None
    with np.errstate(all="ignore"):
        at = int(np.abs(np.diff(values)).argmax())
        marks = [_mark(values, reading) for reading in (float(values[at]), float(values[at + 1]))]
    for mark in marks:
        if mark is not None:
            return Mark(mark.reading, mark.count, int(shown[mark.first]))
    return None


def _mark(values: FloatArray, reading: float) -> Mark | None:
    is_mark = values == reading
    starts, stops = stretches_of(is_mark)
    plain = ~is_mark[1:] & ~is_mark[:-1]
    if not plain.any():
        return None
    ordinary = float(np.abs(np.diff(values)[plain]).max())
    inner = (starts > 0) & (stops < len(values))
    if ordinary == 0 or not inner.any():
        return None
    before, after = values[starts[inner] - 1], values[stops[inner]]
    jump = np.minimum(np.abs(before - reading), np.abs(after - reading))
    travel = ordinary * (stops[inner] - starts[inner] + 1)
    leaves = (
        (jump > JUMP_FACTOR * ordinary) & (np.abs(after - before) < jump) & (np.abs(after - before) <= travel)
    )
    turns = np.array(list(TURNS))
    wraps = np.abs(jump[:, None] - turns).min(axis=1) <= JUMP_FACTOR / 2 * ordinary
    if np.mean(leaves & ~wraps) < JUMP_SHARE or (len(starts) < 2 and not _is_usual(reading)):
        return None
    return Mark(reading, int(is_mark.sum()), int(starts[inner][0]))


def mark_of_command(u: FloatArray) -> Mark | None:
    """A reading that programs write for nothing, far beyond every other; a command may jump, an angle may
    not."""
    shown = np.flatnonzero(np.isfinite(u))
    if len(shown) < 8:
        return None
    values = u[shown]
    reading = float(values[np.abs(values).argmax()])
    others = np.abs(values[values != reading])
    if not _is_usual(reading) or len(others) == 0 or abs(reading) < BEYOND * float(others.max()):
        return None
    held = shown[values == reading]
    return Mark(reading, len(held), int(held[0]))


def _is_usual(reading: float) -> bool:
    """Whether programs write it for nothing: nines alone, or the largest of an integer."""
    size = abs(reading)
    if not math.isfinite(size) or size != round(size):
        return False
    nines = size >= 999 and size < 1e15 and set(f"{size:.0f}") == {"9"}
    return nines or size in LARGEST_INTEGERS
