"""The way into the functions of the interface: records checked and posed, errors in Python's words."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

from bayes_hw.entrance import SimulatedAxis, enter
from bayes_hw.errors import BayesHWWarning, InputError
from bayes_hw.posing import Origin, Posed, Start
from bayes_hw.record import Record

COLUMNS = {"time": "time", "input": "input", "output": "output"}
UNITS = {"input-unit": "input", "output-unit": "output"}
RENAMED = {"sample-rate": "sample_rate_hz", "resample": "resample_hz"}

WORDS = "none|rest|free|auto|start|absolute|refuse|split|bridge"
VALUE = rf"(?P<value>'[^']*'|\"[^\"]*\"|[A-Z]+\b|[-+]?\d[-+.\de]*(?<![-+.e])|(?:{WORDS})\b)"
"""What follows an option as its value: quoted, a place holder in capitals, a number, or one of the words."""


def python_words(message: str) -> str:
    """A message that names options of the command line, with the arguments of Python in their place."""
    message = re.sub(r"--(?P<name>[a-z][a-z-]*) " + VALUE, _with_value, message)
    return re.sub(r"--(?P<name>[a-z][a-z-]*)", _alone, message)


def _with_value(found: re.Match[str]) -> str:
    name, value = found["name"], found["value"]
    if name not in {*COLUMNS, *UNITS, *RENAMED, "start", "origin", "unwrap", "gaps", "input-position"}:
        return f"{_alone(found)} {value}"
    literal = "None" if value == "none" else value
    if literal in WORDS.split("|") or (literal.isupper() and name in COLUMNS):
        literal = f'"{literal}"'
    if name in COLUMNS:
        return f"columns=Columns({name}={literal})"
    if name in UNITS:
        return f'units={{"{UNITS[name]}": {literal}}}'
    return f"{RENAMED.get(name, name.replace('-', '_'))}={literal}"


def _alone(found: re.Match[str]) -> str:
    name = found["name"]
    if name in COLUMNS:
        return f"columns=Columns({name}=...)"
    if name in UNITS:
        return f'units={{"{UNITS[name]}": ...}}'
    return f"`{RENAMED.get(name, name.replace('-', '_'))}`"


@contextmanager
def in_python() -> Iterator[None]:
    """Errors of what runs inside speak of arguments, not of options."""
    try:
        yield
    except InputError as error:
        raise InputError(python_words(str(error))) from error.__cause__


def warn_of(sentences: Iterable[str]) -> None:
    """Every sentence as a BayesHWWarning that points at the caller's line."""
    for sentence in sentences:
        warnings.warn(python_words(sentence), BayesHWWarning, stacklevel=3)


def entered(
    records: Sequence[Record],
    *,
    model: SimulatedAxis | None = None,
    start: Start = "auto",
    origin: Origin = "start",
) -> Posed:
    """`bayes_hw.entrance.enter`, its notes as warnings."""
    found = enter(records, model=model, start=start, origin=origin)
    for sentence in found.notes:
        warnings.warn(python_words(sentence), BayesHWWarning, stacklevel=3)
    return found
