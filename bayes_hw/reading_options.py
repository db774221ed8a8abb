"""How a record is to be read: which columns, which clock, which units, and what is done to them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from bayes_hw.errors import InputError

GAPS = ("refuse", "split", "bridge")


@dataclass(frozen=True)
class Columns:
    """Names of a file's columns or variables, without their units; numbers from 1 where it has no header.

    `time` is None when the file holds no time stamps, `output` None when a command alone is wanted.
    """

    time: str | None = "t"
    input: str = "u"
    output: str | None = "y"


@dataclass(frozen=True)
class ReadingOptions:
    """Everything that can be said about reading one record; see FORMATS for the options of the same names.

    `units` by role ("input", "output"): what to convert to where the file states a unit, else what it is in;
    `time_unit` stands for the unit of the stamps. `input_position` names a column whose forward difference is
    the command. `output_time` is the clock of the output where that has one of its own. `join` are files with
    clocks of their own; `clock_offset` names a signal that they log as well, from which the offset of their
    clocks is estimated and taken out. `gaps` says what becomes of missing samples, `unwrap` the turn at
    which the angle wraps, `known` further columns; `part_s` the stretch to read, in s after the first sample;
    `reverse` turns the output's sign; with `ignore_units` what the file states as units is wrong and `units`
    say it. `missing` holds readings, as the file has them, that mean that nothing was measured; "ends" in it
    those at the ends of the converter, "none" that no reading means so.

    Without `needs_output`, a file that lacks the output's column is a command alone.

    Raises InputError on a value that none of them can have.
    """

    columns: Columns = field(default_factory=Columns)
    sample_rate_hz: float | None = None
    resample_hz: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    time_unit: str | None = None
    input_position: str | None = None
    output_time: str | None = None
    join: tuple[Path, ...] = ()
    clock_offset: str | None = None
    gaps: Literal["refuse", "split", "bridge"] = "refuse"
    unwrap: float | None = None
    known: tuple[str, ...] = ()
    part_s: tuple[float, float] | None = None
    reverse: bool = False
    ignore_units: bool = False
    missing: tuple[float | str, ...] = ()
    needs_output: bool = True

    def __post_init__(self) -> None:
        for option, rate in (("--sample-rate", self.sample_rate_hz), ("--resample", self.resample_hz)):
            if rate is not None and not (math.isfinite(rate) and rate > 0):
                raise InputError(f"{option} {rate!r}: give a positive rate in Hz")
        if self.gaps not in GAPS:
            raise InputError(f"--gaps {self.gaps!r}: use one of {', '.join(GAPS)}")
        if self.unwrap is not None and not (math.isfinite(self.unwrap) and self.unwrap > 0):
            raise InputError(f"--unwrap {self.unwrap!r}: give the turn at which the angle wraps, such as 360")
        if self.part_s is not None and not self.part_s[0] < self.part_s[1]:
            raise InputError(
                f"--part {self.part_s[0]:g} {self.part_s[1]:g}: give a start before a stop, in s"
            )

    @property
    def command(self) -> str:
        """The column that the command comes from."""
        return self.input_position or self.columns.input

    @property
    def wanted(self) -> dict[str, str]:
        """The columns by role, in the order in which they are asked for."""
        named = {"time": self.columns.time, "input": self.command, "output": self.columns.output}
        return {role: name for role, name in named.items() if name is not None}
