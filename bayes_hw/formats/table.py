"""Named columns of numbers, as a file has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from bayes_hw.arrays import FloatArray


@dataclass(frozen=True)
class Table:
    """What a reader found of the columns that it was asked for.

    `values` holds those asked for, each finite and of shape (samples,), unless some are `missing`.
    `names` lists every column of the file. `place` says where in the file the sample of an index
    stands, in the words of its format: "row 3" or "sample 2".
    """

    values: Mapping[str, FloatArray]
    missing: tuple[str, ...]
    names: tuple[str, ...]
    kind: Literal["column", "variable", "data set"]
    place: Callable[[int], str]
