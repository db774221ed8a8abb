"""Reading channels of TDMS files, with npTDMS (the extra `tdms`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, matches, unit_of
from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite, stated_unit

MOST_CHANNELS = 10_000
MOST_BYTES = 256 * 2**20


def nptdms(path: Path) -> ModuleType:
    """The module nptdms; raises InputError that names the extra where it is not installed."""
    try:
        import nptdms as module
    except ImportError:
        raise InputError(
            f"{path}: TDMS files need npTDMS; pip install 'bayes-hw[tdms]', or export CSV, .mat or .h5"
        ) from None
    return module


def read_tdms(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the channels that `wanted` names, as `channel` or `group/channel`; a channel that states its
    increment
    (wf_increment) has that as its clock.

    Raises InputError on a file that is no sound TDMS file, or a channel that is no vector of numbers.
    """
    module = nptdms(path)
    with path.open("rb") as stream:
        if stream.read(4) != b"TDSm":
            raise InputError(f"{path}: is not a sound TDMS file; write it again")
    try:
        with module.TdmsFile.open(path) as file:
            return _table(path, file, wanted, most_rows)
    except InputError:
        raise
    except Exception:
        # npTDMS raises ValueError, KeyError, struct.error and more on damaged files.
        raise InputError(f"{path}: is not a sound TDMS file; write it again") from None


def _table(path: Path, file: Any, wanted: Sequence[str], most_rows: int) -> Table:
    channels = {
        f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()
    }
    if len(channels) > MOST_CHANNELS:
        raise InputError(f"{path}: has more than {MOST_CHANNELS} channels; save those of the record")
    full, short = list(channels), [name.split("/", 1)[1] for name in channels]
    place = lambda index: f"sample {index + 1}"  # noqa: E731
    values: dict[str, Column] = {}
    clocks: dict[str, Column] = {}
    units: dict[str, str] = {}
    for name in wanted:
        found = matches(full, name) or matches(short, name)
        if len(found) > 1:
            listed = ", ".join(repr(full[at]) for at in found[:4])
            raise InputError(f"{path}: several channels are named {name!r}; give one of {listed}")
        if not found:
            continue
        channel = channels[full[found[0]]]
        values[name] = _column(path, name, channel, most_rows)
        refuse_infinite(path, name, "channel", values[name], place)
        unit = stated_unit(channel.properties.get("unit_string", "")) or unit_of(channel.name)
        if unit is not None:
            units[name] = unit
        step = channel.properties.get("wf_increment")
        if isinstance(step, (int, float)) and step > 0 and not is_time_name(name):
            start = channel.properties.get("wf_start_offset", 0.0)
            clocks[name] = float(start) + float(step) * np.arange(len(values[name]))
    missing = tuple(name for name in wanted if name not in values)
    return Table(values, missing, tuple(full), "channel", place, units, clocks, dict.fromkeys(clocks, "s"))


def _column(path: Path, name: str, channel: Any, most_rows: int) -> Column:
    if len(channel) * 8 > MOST_BYTES:
        raise InputError(
            f"{path}: channel {name!r} is larger than {MOST_BYTES // 2**20} MB; cut the record into parts"
        )
    values = np.asarray(channel[:most_rows])
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64)
    if values.dtype.kind not in "iuf" or values.ndim != 1:
        raise InputError(f"{path}: channel {name!r} does not hold real numbers; name one that does")
    return numbers(values)
