"""The parts of a MATLAB file of version 5 to 7: tagged elements and the matrices that they make up.

Source: MathWorks, "MAT-File Format", level 5.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError

MOST_VARIABLES = 10_000
"""Most variables of a file, and most fields of a structure."""

LONGEST_TEXT = 2**16
"""Bytes of a text that are decoded."""

MATRIX, COMPRESSED = 14, 15
STRUCTURE = 2
OBJECT = 17
"""Of a class of MATLAB's newer kind: its head has a name, the kind and the class in place of dimensions."""

NEWER_KIND = b"MCOS"

CELL = 1
TEXT = 4

_LONGEST_NAME = 63
_MOST_DIMENSIONS = 32
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX_FLAG = 0x0800
_NUMBER_TYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_TEXT_TYPES = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16"}
"""16-bit code units and UTF-8; 8-bit integers hold Latin-1."""
_CLASS_NAMES = {
    1: "a cell array", 2: "a structure", 3: "an object", 4: "text", 5: "a sparse matrix",
    16: "a function", 17: "an object", 18: "an object",
}  # fmt: skip


class DamagedError(Exception):
    """The bytes do not follow the format."""


@dataclass(frozen=True)
class Elements:
    """Tagged data elements in a row: `content` in byte order `order` ("<" or ">")."""

    content: memoryview
    order: str

    def __iter__(self) -> Iterator[tuple[int, memoryview]]:
        """Type and data of each element; raises DamagedError where one runs past the end."""
        position = 0
        while position + 8 <= len(self.content):
            first, second = struct.unpack_from(f"{self.order}II", self.content, position)
            if first >> 16:
                kind, size, start, stop = first & 0xFFFF, first >> 16, position + 4, position + 8
                if size > 4:
                    raise DamagedError
            else:
                kind, size, start = first, second, position + 8
                stop = start + size + (-size % 8)
            if start + size > len(self.content):
                raise DamagedError
            yield kind, self.content[start : start + size]
            position = stop


@dataclass(frozen=True)
class Matrix:
    """Head of a matrix element, and the elements that follow it."""

    class_code: int
    is_complex: bool
    dimensions: tuple[int, ...]
    name: str
    rest: Iterator[tuple[int, memoryview]]
    order: str
    object_class: str = ""

    @classmethod
    def parse(cls, content: memoryview, order: str) -> Matrix:
        """Raises DamagedError when `content`, which may be cut short after the name, has no head."""
        elements = iter(Elements(content, order))
        (_, flags), (_, dimensions), (_, name) = (next_element(elements) for _ in range(3))
        is_object = len(flags) >= 4 and struct.unpack_from(f"{order}I", flags)[0] & 0xFF == OBJECT
        if is_object and bytes(name[:8]) == NEWER_KIND:
            own_name, object_class = _short(dimensions), _short(next_element(elements)[1])
            if not (own_name + object_class.replace(".", "_")).isidentifier():
                raise DamagedError
            return cls(OBJECT, False, (1, 1), own_name, elements, order, object_class)
        if len(flags) < 4 or len(dimensions) % 4 or not 8 <= len(dimensions) <= 4 * _MOST_DIMENSIONS:
            raise DamagedError
        (word,) = struct.unpack_from(f"{order}I", flags)
        sizes = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions)
        return cls(
            class_code=word & 0xFF,
            is_complex=bool(word & _COMPLEX_FLAG),
            dimensions=sizes,
            name=_short(name),
            rest=elements,
            order=order,
        )

    def vector(self, most_rows: int) -> FloatArray:
        """First values as float64, shape (at most most_rows,); raises InputError if it has none."""
        self._check_real()
        if sum(size != 1 for size in self.dimensions) > 1:
            shape = " x ".join(map(str, self.dimensions[:4]))
            raise InputError(f"is {shape}; name a vector")
        return self._flat(most_rows)

    def numbers(self, most: int) -> FloatArray:
        """All values as float64 in MATLAB's shape; raises InputError when there are more than `most`."""
        self._check_real()
        if math.prod(self.dimensions) > most:
            raise InputError(f"holds more than {most:,} numbers; save fewer")
        return self._flat(most).reshape(self.dimensions, order="F")

    def text(self) -> str:
        """Characters in MATLAB's order; one row of text reads as it should. At most LONGEST_TEXT of them."""
        if math.prod(self.dimensions) == 0:
            return ""
        kind, data = next_element(self.rest)
        if kind not in _TEXT_TYPES:
            raise DamagedError
        encoding = _TEXT_TYPES[kind]
        if encoding == "utf-16":
            encoding += "-le" if self.order == "<" else "-be"
        return bytes(data[:LONGEST_TEXT]).decode(encoding)

    def _check_real(self) -> None:
        if self.class_code not in _NUMERIC_CLASSES:
            held = _CLASS_NAMES.get(self.class_code, "unknown content")
            raise InputError(f"holds {held}; name a vector of numbers")
        if self.is_complex:
            raise InputError("holds complex numbers; name a vector of real numbers")

    def _flat(self, most: int) -> FloatArray:
        kind, data = next_element(self.rest)
        if kind not in _NUMBER_TYPES:
            raise DamagedError
        number_type = np.dtype(self.order + _NUMBER_TYPES[kind])
        if min(self.dimensions) < 0 or len(data) != math.prod(self.dimensions) * number_type.itemsize:
            raise DamagedError
        rows = min(math.prod(self.dimensions), most)
        return np.frombuffer(data, dtype=number_type, count=rows).astype(np.float64)

    def fields(self) -> dict[str, memoryview]:
        """Content of each field of a 1 x 1 structure, undecoded."""
        if self.class_code != STRUCTURE or math.prod(self.dimensions) != 1:
            return {}
        (_, length), (_, names) = next_element(self.rest), next_element(self.rest)
        width = struct.unpack(f"{self.order}i", length)[0] if len(length) == 4 else 0
        if width < 1 or len(names) % width or len(names) > width * MOST_VARIABLES:
            raise DamagedError
        labels = [
            bytes(names[start : start + width]).split(b"\0")[0].decode("latin-1")
            for start in range(0, len(names), width)
        ]
        return {label: next_element(self.rest)[1] for label in labels}


def _short(name: memoryview) -> str:
    return bytes(name[:_LONGEST_NAME]).decode("latin-1")


def next_element(elements: Iterator[tuple[int, memoryview]]) -> tuple[int, memoryview]:
    """The element that comes next; raises DamagedError when there is none."""
    element = next(elements, None)
    if element is None:
        raise DamagedError
    return element


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
