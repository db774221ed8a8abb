"""Objects in MATLAB files, timetables above all: which they are, and how they leave MATLAB."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bayes_hw.errors import InputError

READABLE = ("timetable", "table")
"""Classes whose rows mat-io gives as a data frame."""

EXPORTS: Mapping[str, tuple[str, str]] = {
    "timetable": ("writetimetable({name}, '{stem}.csv')", "{stem}.csv"),
    "table": ("writetable({name}, '{stem}.csv')", "{stem}.csv"),
    "timeseries": ("writetimetable(timeseries2timetable({name}), '{stem}.csv')", "{stem}.csv"),
    "datetime": ("t = posixtime({name})", "t"),
    "duration": ("t = seconds({name})", "t"),
}
"""For a class what to type in MATLAB, and what to give then: a file, or a variable saved with the others."""


class ObjectError(InputError):
    """The variable `name` of a file is an object of MATLAB's class `class_name`, and no vector."""

    def __init__(self, said: str, name: str, class_name: str) -> None:
        super().__init__(said)
        self.name, self.class_name = name, class_name


def refuse_object(path: Path, name: str, class_name: str) -> ObjectError:
    """The error that says what the variable `name` is and how it leaves MATLAB."""
    what = f"{path}: variable {name!r} is a MATLAB {class_name}, which MATLAB alone can read"
    if class_name in READABLE:
        what = (
            f"{path}: variable {name!r} is a MATLAB {class_name}; pip install 'bayes-hw[matlab]' to read it"
        )
    if class_name not in EXPORTS:
        return ObjectError(f"{what}; save its numbers as vectors: t, u, y", name, class_name)
    typed, given = EXPORTS[class_name]
    typed, given = (part.format(name=name, stem=path.stem) for part in (typed, given))
    if class_name in READABLE:
        return ObjectError(f"{what}, or type {typed} in MATLAB and give {given}", name, class_name)
    if given.endswith(".csv"):
        return ObjectError(f"{what}; type {typed} there and give {given}", name, class_name)
    return ObjectError(
        f"{what}; type {typed} there and save {given} beside the other signals", name, class_name
    )
