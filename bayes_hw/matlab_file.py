"""Reading vectors from MATLAB files of version 5 to 7.

Source: MathWorks, "MAT-File Format", level 5. Only real numeric vectors, at the
top or in fields of 1 x 1 structures, are read. The reader is our own because
`scipy.io.loadmat` allocates what a file declares before it is known to hold it, and inflates
compressed variables without a limit. Here only the variables asked for are inflated, each to at most
`MOST_BYTES`, and cells, objects and functions are never decoded.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.table import Table

MOST_BYTES = 256 * 2**20
"""Largest size of one variable, inflated, in bytes."""

MOST_VARIABLES = 10_000

_HEADER_BYTES = 128
_MATRIX, _COMPRESSED = 14, 15
_PIECE_BYTES = 2**16
_HEAD_BYTES = 1024
"""Enough of a variable to hold its class, dimensions and name."""

_LONGEST_NAME = 63

_NUMBER_TYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_CLASS_NAMES = {
    1: "a cell array", 2: "a structure", 3: "an object", 4: "text", 5: "a sparse matrix",
    16: "a function", 17: "an object", 18: "an object",
}  # fmt: skip
_MOST_DIMENSIONS = 32
_STRUCTURE = 2
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX_FLAG = 0x0800


class _DamagedError(Exception):
    """The bytes do not follow the format."""


@dataclass(frozen=True)
class _Elements:
    """Tagged data elements in a row: `content` in byte order `order` ("<" or ">")."""

    content: memoryview
    order: str

    def __iter__(self) -> Iterator[tuple[int, memoryview]]:
        """Type and data of each element; raises _DamagedError where one runs past the end."""
        position = 0
        while position + 8 <= len(self.content):
            first, second = struct.unpack_from(f"{self.order}II", self.content, position)
            if first >> 16:
                kind, size, start, stop = first & 0xFFFF, first >> 16, position + 4, position + 8
                if size > 4:
                    raise _DamagedError
            else:
                kind, size, start = first, second, position + 8
                stop = start + size + (-size % 8)
            if start + size > len(self.content):
                raise _DamagedError
            yield kind, self.content[start : start + size]
            position = stop


@dataclass(frozen=True)
class _Matrix:
    """Head of a matrix element, and the elements that follow it."""

    class_code: int
    is_complex: bool
    dimensions: tuple[int, ...]
    name: str
    rest: Iterator[tuple[int, memoryview]]
    order: str

    @classmethod
    def parse(cls, content: memoryview, order: str) -> _Matrix:
        """Raises _DamagedError when `content`, which may be cut short after the name, has no head."""
        elements = iter(_Elements(content, order))
        (_, flags), (_, dimensions), (_, name) = (_next(elements) for _ in range(3))
        if len(flags) < 4 or len(dimensions) % 4 or not 8 <= len(dimensions) <= 4 * _MOST_DIMENSIONS:
            raise _DamagedError
        (word,) = struct.unpack_from(f"{order}I", flags)
        sizes = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions)
        return cls(
            class_code=word & 0xFF,
            is_complex=bool(word & _COMPLEX_FLAG),
            dimensions=sizes,
            name=bytes(name[:_LONGEST_NAME]).decode("latin-1"),
            rest=elements,
            order=order,
        )

    def vector(self, most_rows: int) -> FloatArray:
        """First values as float64, shape (at most most_rows,); raises InputError if it has none."""
        if self.class_code not in _NUMERIC_CLASSES:
            held = _CLASS_NAMES.get(self.class_code, "unknown content")
            raise InputError(f"holds {held}; name a vector of numbers")
        if self.is_complex:
            raise InputError("holds complex numbers; name a vector of real numbers")
        if sum(size != 1 for size in self.dimensions) > 1:
            shape = " x ".join(map(str, self.dimensions[:4]))
            raise InputError(f"is {shape}; name a vector")
        kind, data = _next(self.rest)
        if kind not in _NUMBER_TYPES:
            raise _DamagedError
        number_type = np.dtype(self.order + _NUMBER_TYPES[kind])
        if len(data) != math.prod(self.dimensions) * number_type.itemsize:
            raise _DamagedError
        rows = min(math.prod(self.dimensions), most_rows)
        return np.frombuffer(data, dtype=number_type, count=rows).astype(np.float64)

    def fields(self) -> dict[str, memoryview]:
        """Content of each field of a 1 x 1 structure, undecoded."""
        if self.class_code != _STRUCTURE or math.prod(self.dimensions) != 1:
            return {}
        (_, length), (_, names) = _next(self.rest), _next(self.rest)
        width = struct.unpack(f"{self.order}i", length)[0] if len(length) == 4 else 0
        if width < 1 or len(names) % width or len(names) > width * MOST_VARIABLES:
            raise _DamagedError
        labels = [
            bytes(names[start : start + width]).split(b"\0")[0].decode("latin-1")
            for start in range(0, len(names), width)
        ]
        return {label: _next(self.rest)[1] for label in labels}


@dataclass(frozen=True)
class _Variable:
    """One top-level variable: `size` bytes at `start` of the file, not yet read."""

    path: Path
    stream: BinaryIO
    start: int
    size: int
    is_compressed: bool
    order: str

    def head(self) -> _Matrix:
        data = self._read(min(self.size, 4 * _HEAD_BYTES))
        if self.is_compressed:
            data = zlib.decompressobj().decompress(data, _HEAD_BYTES)[8:]
        return _Matrix.parse(memoryview(data), self.order)

    def content(self) -> memoryview:
        """The whole matrix element; raises InputError when it is larger than `MOST_BYTES`."""
        self._check_size(self.size)
        if not self.is_compressed:
            return memoryview(self._read(self.size))
        tag = b"".join(self._inflated(8))
        kind, size = struct.unpack(f"{self.order}II", tag)
        if kind != _MATRIX:
            raise _DamagedError
        self._check_size(size)
        content = bytearray()
        for piece in self._inflated(8 + size):
            content += piece
        return memoryview(content)[8:]

    def _inflated(self, size: int) -> Iterator[bytes]:
        """The first `size` bytes inflated, in pieces; raises _DamagedError when there are fewer."""
        inflater = zlib.decompressobj()
        self.stream.seek(self.start)
        unread = self.size
        while size:
            data = inflater.unconsumed_tail or self.stream.read(min(unread, _PIECE_BYTES))
            if not inflater.unconsumed_tail:
                unread -= len(data)
            if not data or inflater.eof:
                raise _DamagedError
            piece = inflater.decompress(data, min(size, _PIECE_BYTES))
            size -= len(piece)
            yield piece

    def _check_size(self, size: int) -> None:
        if size > MOST_BYTES:
            raise InputError(
                f"{self.path}: variable {self.head().name!r} takes {size / 2**20:.0f} MB, more than the "
                f"{MOST_BYTES // 2**20} MB that are read; save a shorter record"
            )

    def _read(self, size: int) -> bytes:
        self.stream.seek(self.start)
        return self.stream.read(size)


def read_matlab(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the vectors named in `wanted`, at most `most_rows` of each; `name.field` is a
    structure's.

    Raises InputError on a file that is no undamaged MATLAB file of version 5 to 7, and on a
    variable that is not a real vector of finite numbers or larger than `MOST_BYTES`. Raises
    OSError when the file cannot be read.
    """
    values: dict[str, FloatArray] = {}
    names: list[str] = []
    seen: set[str] = set()
    try:
        with path.open("rb") as stream:
            for variable in _variables(path, stream):
                head = variable.head()
                is_structure = head.class_code == _STRUCTURE
                asked = [label for label in wanted if label.split(".")[0] == head.name]
                if asked and head.name in seen:
                    raise InputError(f"{path}: has variable {head.name!r} twice; save it again")
                seen.add(head.name)
                names.append(f"{head.name}.FIELD" if is_structure else head.name)
                if not asked:
                    continue
                content = variable.content()
                if is_structure:
                    fields = _Matrix.parse(content, variable.order).fields()
                    names[-1:] = [f"{head.name}.{field}" for field in fields] or [names[-1]]
                for label in asked:
                    vector = _vector_at(path, content, variable.order, label, most_rows)
                    if vector is not None:
                        values[label] = vector
    except (_DamagedError, zlib.error):
        raise InputError(f"{path}: is a damaged MATLAB file; save it again") from None
    for label, vector in values.items():
        faults = np.flatnonzero(~np.isfinite(vector))
        if len(faults):
            raise InputError(
                f"{path}: variable {label!r}, sample {faults[0] + 1}: {vector[faults[0]]} is not a "
                "finite number; correct or remove the sample"
            )
    return Table(
        values=values,
        missing=tuple(label for label in wanted if label not in values),
        names=tuple(names),
        kind="variable",
        place=lambda index: f"sample {index + 1}",
    )


def _byte_order(path: Path, header: bytes) -> str:
    if header.startswith(b"\x89HDF") or header.startswith(b"MATLAB 7.3"):
        raise InputError(f"{path}: is a MATLAB file of version 7.3; save it with save(..., '-v7')")
    order = {b"IM": "<", b"MI": ">"}.get(header[126:128])
    if order is None or struct.unpack_from(f"{order}H", header, 124)[0] != 0x0100:
        raise InputError(f"{path}: is not a MATLAB file of version 5 to 7; save it with save(..., '-v7')")
    return order


def _variables(path: Path, stream: BinaryIO) -> Iterator[_Variable]:
    order = _byte_order(path, stream.read(_HEADER_BYTES))
    end = path.stat().st_size
    position, count = _HEADER_BYTES, 0
    while position + 8 <= end:
        stream.seek(position)
        kind, size = struct.unpack(f"{order}II", stream.read(8))
        position += 8
        count += 1
        if kind not in (_MATRIX, _COMPRESSED) or position + size > end:
            raise _DamagedError
        if count > MOST_VARIABLES:
            raise InputError(
                f"{path}: holds more than {MOST_VARIABLES} variables; save those of the record alone"
            )
        yield _Variable(path, stream, position, size, kind == _COMPRESSED, order)
        position += size


def _vector_at(path: Path, content: memoryview, order: str, label: str, most_rows: int) -> FloatArray | None:
    """The vector that `label` names below the variable of its first part, or None if there is none."""
    for field in label.split(".")[1:]:
        fields = _Matrix.parse(content, order).fields()
        if field not in fields:
            return None
        content = fields[field]
    try:
        return _Matrix.parse(content, order).vector(most_rows)
    except InputError as error:
        raise InputError(f"{path}: variable {label!r} {error}") from None


def _next(elements: Iterator[tuple[int, memoryview]]) -> tuple[int, memoryview]:
    element = next(elements, None)
    if element is None:
        raise _DamagedError
    return element
