"""One measured record of one axis."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.column_output import write_columns
from bayes_hw.formats.dataframe_table import table_of_dataframe, table_of_xarray
from bayes_hw.formats.table import Table
from bayes_hw.log.resample import between_measured, describe, resample_columns
from bayes_hw.python_words import in_python
from bayes_hw.quantities import conversion, is_speed, speed_of, spelt
from bayes_hw.reading_options import Columns, ReadingOptions
from bayes_hw.record_checks import Finding, check_signals
from bayes_hw.record_columns import table_of_arrays, uniform_columns
from bayes_hw.record_files import FileContent, asked_options, parts_of_table, read_parts
from bayes_hw.scale_checks import NO_CLOCK
from bayes_hw.units import Units

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Columns", "ReadingOptions", "Record", "Units"]


@dataclass(frozen=True, eq=False)
class Record:
    """Commands and measured angles at a uniform rate.

    `t`, `u`, `y` have shape (samples,), in `units`. `treatment` lists in words what was done to
    the data since the file was read; `sha256` is the digest of the file. `t` keeps the stamps of
    the source, so it may start at any value and carry their rounding; the step to compute with is
    1 / `sample_rate_hz`. The angle that was measured is `y` + `origin`, which is known to `level_sd`, zero
    where the angles count from a zero of their own; see `bayes_hw.posing`.

    `measured`, shape (samples,), is False where y was not measured; y then lies between its measured
    neighbours, whatever was given there, zero where there are none. It is None where every sample was
    measured. A command without any output is a record of which no sample was measured. `known` are further
    measured columns (samples,) by name, in `known_units`. `stated_units` are the roles whose unit the file
    or the reader stated; the others are taken for granted. `clock` is the unit that the stamps were taken
    to count, empty of stamps that say it themselves, and "none" where the rate was stated and not recorded.
    `options` are those that it was read with, with the columns that were found.

    Raises InputError unless all columns have one length, are finite, and the rate is positive.
    """

    name: str
    t: FloatArray
    u: FloatArray
    y: FloatArray
    sample_rate_hz: float
    units: Units
    source: str = ""
    sha256: str = ""
    treatment: tuple[str, ...] = ()
    measured: BoolArray | None = None
    known: Mapping[str, FloatArray] = field(default_factory=dict)
    known_units: Mapping[str, str] = field(default_factory=dict)
    stated_units: frozenset[str] = frozenset()
    origin: float = 0.0
    level_sd: float = 0.0
    clock: str = "s"
    options: ReadingOptions = field(default_factory=ReadingOptions)

    def __post_init__(self) -> None:
        for column in ("t", "u"):
            object.__setattr__(self, column, self._column(column, getattr(self, column)))
        self._set_measured()
        object.__setattr__(self, "y", self._column("y", self.y))
        known = {name: self._column(f"known {name!r}", values) for name, values in self.known.items()}
        object.__setattr__(self, "known", known)
        if not (math.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise InputError(
                f"record {self.name}: sample rate {self.sample_rate_hz!r}; give a positive one in Hz"
            )

    def _set_measured(self) -> None:
        """No mask where every sample was measured; y between its neighbours where one was not."""
        if self.measured is None:
            return
        mask, y = np.asarray(self.measured), np.asarray(self.y, dtype=np.float64)
        if mask.shape != (len(self.t),) or mask.dtype != np.bool_:
            said = (
                f"measured has shape {mask.shape} and type {mask.dtype}; give True or False for every sample"
            )
            raise InputError(f"record {self.name}: {said}")
        object.__setattr__(self, "measured", None if mask.all() else mask)
        if not mask.all() and y.shape == mask.shape:
            at = np.arange(len(y))
            between = np.interp(at, at[mask], y[mask]) if mask.any() else np.zeros(len(y))
            object.__setattr__(self, "y", np.where(mask, y, between))

    def _column(self, name: str, given: Any) -> FloatArray:
        values = np.asarray(given, dtype=np.float64)
        if values.ndim != 1 or len(values) != len(self.t):
            said = f"{name} has shape {values.shape}; give t, u and y as columns of one length"
            raise InputError(f"record {self.name}: {said}")
        if not np.isfinite(values).all():
            raise InputError(
                f"record {self.name}: {name} holds NaN or inf; remove them, or say with `measured` which "
                "samples of y were not measured"
            )
        return values

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        units, angle = self.units, self.y + self.origin
        moves = f", angle {angle.min():.6g} to {angle.max():.6g} {units.output}" if self.has_output else ""
        return (
            f"<Record {self.name!r}: {len(self)} samples at {self.sample_rate_hz:.6g} Hz "
            f"({self.duration_s:.4g} s), command {self.u.min():.4g} to {self.u.max():.4g} "
            f"{units.input}{moves}>"
        )

    def _repr_html_(self) -> str:
        done = "".join(f"<br>{html.escape(sentence)}" for sentence in self.treatment)
        return f"<code>{html.escape(repr(self)[1:-1])}</code>{done}"

    @classmethod
    def from_arrays(
        cls,
        t: ArrayLike | None = None,
        u: ArrayLike | None = None,
        y: ArrayLike | None = None,
        *,
        sample_rate_hz: float | None = None,
        units: Units | Mapping[str, str] | None = None,
        options: ReadingOptions | None = None,
        name: str = "record",
    ) -> Record:
        """A record of columns (samples,): time in s, command, measured angle.

        Without `t` the samples are `sample_rate_hz` apart; where `y` is NaN it was not measured, and without
        it the record is a command alone. With `options` they are read as the columns t, u, y of a file are.
        Raises InputError where neither time nor rate is given, the two disagree, or the time is not uniform.
        """
        if options is not None:
            asked = asked_options(options, None, sample_rate_hz, None, units)
            return cls._of_table(table_of_arrays(name, t, u, y), asked, name)
        stamps, rate, command, angle = uniform_columns(name, t, u, y, sample_rate_hz)
        angle = np.full(len(command), np.nan) if angle is None else angle
        measured = None if not np.isnan(angle).any() else ~np.isnan(angle)
        held = units if isinstance(units, Units) else Units.from_dict(units or {})
        clock = NO_CLOCK if t is None else "s"
        return cls(name, stamps, command, angle, rate, held, measured=measured, clock=clock)

    @classmethod
    def from_dataframe(
        cls,
        table: pd.DataFrame,
        *,
        columns: Columns | None = None,
        sample_rate_hz: float | None = None,
        units: Units | Mapping[str, str] | None = None,
        options: ReadingOptions | None = None,
        name: str = "record",
    ) -> Record:
        """One record of a table's columns t, u, y, or those that `columns` names, as if read from a file.

        Times may be numbers or dates, and an index of dates stands for a column of time that is missing; a
        rate stands for both. What is NaN was not measured; without an angle the record is a command alone.
        `options` and `units` as for `read`. Raises InputError as that does.
        """
        asked = asked_options(options, columns, sample_rate_hz, None, units)
        found = table_of_dataframe(table, asked.columns.time)
        return cls._of_table(found, replace(asked, needs_output=False), name)

    def to_dataframe(self) -> pd.DataFrame:
        """One row a sample: t, u, the measured angle y and known signals, as `columns` gives them."""
        import pandas as pd

        return pd.DataFrame(self.columns())

    @property
    def has_output(self) -> bool:
        """Whether any sample of y was measured; a command alone has none."""
        return self.measured is None or bool(self.measured.any())

    @property
    def measured_samples(self) -> BoolArray:
        """`measured` as an array (samples,) in every case."""
        return np.ones(len(self), dtype=np.bool_) if self.measured is None else self.measured

    @property
    def y_or_nan(self) -> FloatArray:
        """y, NaN where it was not measured."""
        return self.y if self.measured is None else np.where(self.measured, self.y, np.nan)

    def columns(self) -> dict[str, FloatArray]:
        """t, u, the measured angle y (NaN where unmeasured, left out where there is none), known signals."""
        output = {"y": self.y_or_nan + self.origin} if self.has_output else {}
        return {"t": self.t, "u": self.u, **output, **self.known}

    @classmethod
    def read(
        cls,
        path: Path | str,
        *,
        columns: Columns | None = None,
        sample_rate_hz: float | None = None,
        resample_hz: float | None = None,
        units: Units | Mapping[str, str] | None = None,
        options: ReadingOptions | None = None,
    ) -> Record:
        """Read one record from a file of any format; see `bayes_hw.record_files.read_parts`.

        `options` says everything that can be said about reading; the other arguments are its most used parts.
        Units, all or those of "input" or "output" alone, are what to convert to where the file states a unit,
        else what its numbers are in; what nobody states is deg/s and deg. Raises InputError where the file
        holds no record, or gaps make several of it: `read_all` gives those.
        """
        with in_python():
            records = cls.read_all(path, asked_options(options, columns, sample_rate_hz, resample_hz, units))
        if len(records) > 1:
            raise InputError(
                f"{path}: its gaps make {len(records)} records of it; read them with Record.read_all"
            )
        return records[0]

    @classmethod
    def read_all(cls, path: Path | str, options: ReadingOptions | None = None) -> list[Record]:
        """Every record of a file: one, or those that `options.gaps` makes of it."""
        path = Path(path)
        contents = read_parts(path, options or ReadingOptions())
        several = len(contents) > 1
        return [
            cls._of_content(path, content, f"_{number}" if several else "")
            for number, content in enumerate(contents, start=1)
        ]

    @classmethod
    def _of_content(cls, path: Path, content: FileContent, number: str) -> Record:
        return cls(
            name=f"{path.stem}{number}",
            t=content.t,
            u=content.u,
            y=content.y,
            sample_rate_hz=content.sample_rate_hz,
            units=Units.from_dict(dict(content.units)),
            source=str(path),
            sha256=content.sha256,
            treatment=content.treatment,
            measured=content.measured,
            known=content.known,
            known_units=content.known_units,
            stated_units=frozenset(content.units),
            level_sd=content.level_sd,
            clock=content.clock,
            options=content.options,
        )

    @classmethod
    def from_xarray(
        cls, dataset: Any, *, options: ReadingOptions | None = None, name: str = "record"
    ) -> Record:
        """One record of an `xarray.Dataset`, as if read from a file.

        Variables and coordinates are columns, times may be numbers or dates, and attributes `units` are the
        units that it states. Raises InputError where it holds no record.
        """
        return cls._of_table(table_of_xarray(dataset), options or ReadingOptions(), name)

    @classmethod
    def _of_table(cls, table: Table, options: ReadingOptions, name: str) -> Record:
        if options.columns.time not in table.values and options.sample_rate_hz is not None:
            options = replace(options, columns=replace(options.columns, time=None))
        with in_python():
            contents = parts_of_table(Path(name), table, options)
        if len(contents) > 1:
            raise InputError(
                f"{name}: its gaps make {len(contents)} records of it; take one with "
                "options=ReadingOptions(part_s=(START, STOP)), in s after the first sample"
            )
        return replace(cls._of_content(Path(name), contents[0], ""), name=name, source="")

    def converted(self, units: Units) -> Record:
        """The record in other units; raises InputError where they measure something else."""
        said = []
        factors = {"input": 1.0, "output": 1.0}
        for role in factors:
            held, wanted = getattr(self.units, role), getattr(units, role)
            if spelt(held) == spelt(wanted):
                continue
            try:
                factors[role] = conversion(held, wanted)
            except InputError as error:
                raise InputError(
                    f"{self.source or self.name}: its {role} is in {held}, {wanted} is asked for; {error}: "
                    f"convert the record, or correct the unit in the file, the model or --{role}-unit"
                ) from None
            said.append(f"{role} converted from {held} to {wanted}")
        return replace(
            self,
            units=units,
            treatment=(*self.treatment, *said),
            u=self.u * factors["input"],
            y=self.y * factors["output"],
            origin=self.origin * factors["output"],
            level_sd=self.level_sd * abs(factors["output"]),
        )

    @property
    def measures_speed(self) -> bool:
        """Whether the output is a speed, and not that of an angle which stands for the command."""
        return is_speed(self.units.output) and speed_of(self.units.input, self.units.output) is None

    def findings(self) -> tuple[Finding, ...]:
        """What looks wrong, the gravest first, as `bayes_hw.record_checks` has it; of a speed nothing."""
        if not self.has_output or self.measures_speed:
            return ()
        return check_signals(
            self.u, self.y, self.sample_rate_hz, speed_of(self.units.output, self.units.input), self.measured
        )

    def write(self, path: Path | str) -> None:
        """Write `columns` in the format of the path's ending; see `bayes_hw.formats.column_output`."""
        units = {"t": self.units.time, "u": self.units.input, "y": self.units.output, **self.known_units}
        write_columns(Path(path), self.columns(), self.units.to_dict(), units)

    def resampled(self, rate_hz: float) -> Record:
        """The record at `rate_hz`, its `treatment` saying how; see `bayes_hw.log.resample.resample_columns`.

        Raises InputError when the rate is not positive or gives fewer than 2 or more than 10,000,000 samples.
        """
        t, u, y = resample_columns(self.t, self.u, self.y, rate_hz)
        sentence = describe(self.t, rate_hz, lambda index: f"sample {index + 1}")
        measured = None if self.measured is None else between_measured(self.t, self.measured, t)
        return replace(
            self,
            t=t,
            u=u,
            y=y,
            sample_rate_hz=float(rate_hz),
            treatment=(*self.treatment, sentence),
            measured=measured,
            known={name: np.interp(t, self.t, values) for name, values in self.known.items()},
        )

    @property
    def has_free_level(self) -> bool:
        """Whether the angles count from a level that was estimated, by the record's own beginning."""
        return self.has_output and self.level_sd > 0

    def counted_from(self, level: float) -> Self:
        """The same angles, counted from a `level` of them."""
        return replace(self, y=self.y - level, origin=self.origin + level) if level else self

    @property
    def duration_s(self) -> float:
        """Time that the samples cover, each lasting one period, in s."""
        return len(self) / self.sample_rate_hz

    def window(self, start_s: float, stop_s: float) -> Record:
        """The samples from `start_s` up to, not including, `stop_s`, both in s after the first sample.

        `stop_s` may lie past the end. The part need not start at rest. Raises InputError if nothing is left.
        """
        first, stop = (
            min(max(math.ceil(limit * self.sample_rate_hz - 1e-6), 0), len(self))
            if math.isfinite(limit)
            else (len(self) if limit > 0 else 0)
            for limit in (start_s, stop_s)
        )
        return self._part(first, stop)

    def split(self, fraction: float) -> tuple[Record, Record]:
        """The first `fraction` of the samples, and the rest; raises InputError when either is empty."""
        if not 0 < fraction < 1:
            raise InputError(f"record {self.name}: split at {fraction!r}; give a fraction between 0 and 1")
        cut = round(fraction * len(self))
        return self._part(0, cut), self._part(cut, len(self))

    def _part(self, first: int, stop: int) -> Record:
        if first >= stop:
            raise InputError(
                f"record {self.name}: no sample in the part asked for; the record lasts {self.duration_s:g} s"
            )
        start_s, stop_s = first / self.sample_rate_hz, stop / self.sample_rate_hz
        chosen = slice(first, stop)
        return replace(
            self,
            name=f"{self.name}_{start_s:g}-{stop_s:g}s",
            t=self.t[chosen],
            u=self.u[chosen],
            y=self.y[chosen],
            measured=None if self.measured is None else self.measured[chosen],
            known={name: values[chosen] for name, values in self.known.items()},
            treatment=(*self.treatment, f"cut to {start_s:g} s to {stop_s:g} s after the first sample"),
        )
