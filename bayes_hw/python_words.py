"""Errors in the words of who called: options of the command line as arguments of Python."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from bayes_hw.errors import InputError, solvable

COLUMNS = ("time", "input", "output")
UNITS = {"input-unit": "input", "output-unit": "output"}
ARGUMENTS = {"sample-rate": "sample_rate_hz", "resample": "resample_hz"}
READING = {
    name: name.replace("-", "_")
    for name in (
        "time-unit",
        "input-position",
        "output-time",
        "clock-offset",
        "join",
        "gaps",
        "unwrap",
        "known",
        "missing",
        "reverse",
        "ignore-units",
    )
} | {"part": "part_s"}
"""Options that are parts of `ReadingOptions`."""

FLAGS = ("reverse", "ignore-units")

FAULTS = "swapped|position|scale|stuck|unrelated"
WORDS = f"none|ends|rest|free|auto|start|absolute|refuse|split|bridge|ms|us|ns|min|h|{FAULTS}"
NUMBER = r"[-+]?\d[-+.\de]*(?<![-+.e])"
VALUE = rf"'[^']*'|\"[^\"]*\"|[A-Z]+\b(?: [A-Z]+\b)*|{NUMBER}(?: {NUMBER}(?![\w.]))?|\w+\.\w+|(?:{WORDS})\b"
"""What follows an option as its value: quoted, place holders in capitals, a number, or one of the words."""

OPTION = re.compile(rf"--(?P<name>[a-z][a-z-]*)(?: (?P<value>{VALUE}))?")


def python_words(message: str) -> str:
    """A message that names options of the command line, with the arguments of Python in their place."""
    return re.sub(r"(columns=Columns\([^)]*\)) (?=sample_rate_hz)", r"\1, ", OPTION.sub(_argument, message))


def _argument(found: re.Match[str]) -> str:
    name, value = found["name"], found["value"]
    literal = "..." if value is None else "None" if value == "none" else value
    is_name = value is not None and name in COLUMNS and value[0].isalpha() and value != "none"
    if value in WORDS.split("|")[1:] or is_name:
        literal = f'"{value}"'
    if name in COLUMNS:
        return f"columns=Columns({name}={literal})"
    if name in UNITS:
        return f'units={{"{UNITS[name]}": {literal}}}'
    if name in READING:
        inside = "True" if name in FLAGS else f"({literal.replace(' ', ', ')})" if name == "part" else literal
        if name == "missing":
            inside = f"({value if value not in WORDS.split('|') else repr(value)},)".replace("'", '"')
        return f"options=ReadingOptions({READING[name]}={inside})"
    if name == "accept":
        return f"accept=[{literal}]"
    argument = ARGUMENTS.get(name, name.replace("-", "_"))
    return f"`{argument}`" if value is None else f"{argument}={literal}"


@contextmanager
def in_python() -> Iterator[None]:
    """Errors of what runs inside speak of arguments, not of options."""
    try:
        with solvable("records"):
            yield
    except InputError as error:
        raise InputError(python_words(str(error))) from error.__cause__
