"""Objects in MATLAB files, timetables above all: MATLAB alone opens them, and it exports them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bayes_hw.errors import InputError

EXPORTS: Mapping[str, tuple[str, str]] = {
    "timetable": ("writetimetable({name}, '{stem}.csv')", "{stem}.csv"),
    "table": ("writetable({name}, '{stem}.csv')", "{stem}.csv"),
    "timeseries": ("writetimetable(timeseries2timetable({name}), '{stem}.csv')", "{stem}.csv"),
    "datetime": ("t = posixtime({name})", "t"),
    "duration": ("t = seconds({name})", "t"),
}
"""For a class what to type in MATLAB, and what to give then: a file, or a variable saved with the others."""


def refuse_object(path: Path, name: str, class_name: str) -> InputError:
    """The error that says what the variable `name` is and how it leaves MATLAB."""
    what = f"{path}: variable {name!r} is a MATLAB {class_name}, which MATLAB alone can read"
    if class_name not in EXPORTS:
        return InputError(f"{what}; save its numbers as vectors: t, u, y")
    typed, given = EXPORTS[class_name]
    typed, given = (part.format(name=name, stem=path.stem) for part in (typed, given))
    if given.endswith(".csv"):
        return InputError(f"{what}; type {typed} there and give {given}")
    return InputError(f"{what}; type {typed} there and save {given} beside the other signals")
