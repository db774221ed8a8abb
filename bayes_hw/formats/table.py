"""Named columns of numbers, as a file has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from bayes_hw.arrays import FloatArray


@dataclass(frozen=True)
class Table:
    """What a reader found of the columns that it was asked for.

    `values` holds those asked for, each finite and of shape (samples,), unless some are `missing`.
    `names` lists every column of the file. `place` says where in the file the sample of an index
    stands, in the words of its format: "row 3" or "sample 2". `units` are those that the file itself
    states of columns asked for.
    """

    values: Mapping[str, FloatArray]
    missing: tuple[str, ...]
    names: tuple[str, ...]
    kind: Literal["column", "variable", "data set"]
    place: Callable[[int], str]
    units: Mapping[str, str] = field(default_factory=dict)


LONGEST_UNIT = 32


def stated_unit(value: object) -> str | None:
    """The unit that an attribute of a file holds as text, if it does."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    short = text.strip() if isinstance(text, str) else ""
    return short if 0 < len(short) <= LONGEST_UNIT and short.isprintable() else None
