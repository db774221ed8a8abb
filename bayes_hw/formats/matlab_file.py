"""Reading vectors from MATLAB files of version 5 to 7.

Source: MathWorks, "MAT-File Format", level 5. Only real numeric vectors, at the
top or in fields of 1 x 1 structures, are read. The reader is our own because
`scipy.io.loadmat` allocates what a file declares before it is known to hold it, and inflates
compressed variables without a limit. Here only the variables asked for are inflated, each to at most
`MOST_BYTES`, and cells, objects and functions are never decoded.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.matlab_elements import (
    COMPRESSED,
    MATRIX,
    MOST_VARIABLES,
    STRUCTURE,
    DamagedError,
    Matrix,
    refuse_object,
)
from bayes_hw.formats.table import Table, refuse_infinite

MOST_BYTES = 256 * 2**20
"""Largest size of one variable, inflated, in bytes."""

_HEADER_BYTES = 128
_PIECE_BYTES = 2**16
_HEAD_BYTES = 1024
"""Enough of a variable to hold its class, dimensions and name."""


@dataclass(frozen=True)
class Variable:
    """One top-level variable: `size` bytes at `start` of the file, not yet read."""

    path: Path
    stream: BinaryIO
    start: int
    size: int
    is_compressed: bool
    order: str

    def head(self) -> Matrix:
        data = self._read(min(self.size, 4 * _HEAD_BYTES))
        if self.is_compressed:
            data = zlib.decompressobj().decompress(data, _HEAD_BYTES)[8:]
        return Matrix.parse(memoryview(data), self.order)

    def content(self, most_bytes: int = MOST_BYTES) -> memoryview:
        """The whole matrix element; raises InputError when it is larger than `most_bytes`."""
        self._check_size(self.size, most_bytes)
        if not self.is_compressed:
            return memoryview(self._read(self.size))
        tag = b"".join(self._inflated(8))
        kind, size = struct.unpack(f"{self.order}II", tag)
        if kind != MATRIX:
            raise DamagedError
        self._check_size(size, most_bytes)
        content = bytearray()
        for piece in self._inflated(8 + size):
            content += piece
        return memoryview(content)[8:]

    def _inflated(self, size: int) -> Iterator[bytes]:
        """The first `size` bytes inflated, in pieces; raises DamagedError when there are fewer."""
        inflater = zlib.decompressobj()
        self.stream.seek(self.start)
        unread = self.size
        while size:
            data = inflater.unconsumed_tail or self.stream.read(min(unread, _PIECE_BYTES))
            if not inflater.unconsumed_tail:
                unread -= len(data)
            if not data or inflater.eof:
                raise DamagedError
            piece = inflater.decompress(data, min(size, _PIECE_BYTES))
            size -= len(piece)
            yield piece

    def _check_size(self, size: int, most_bytes: int) -> None:
        if size > most_bytes:
            rest = "" if most_bytes == MOST_BYTES else " with the structures before it"
            raise InputError(
                f"{self.path}: variable {self.head().name!r} takes {size / 2**20:.0f} MB,{rest} more than "
                f"the {MOST_BYTES // 2**20} MB that are read; save a shorter record, or what is needed alone"
            )

    def _read(self, size: int) -> bytes:
        self.stream.seek(self.start)
        return self.stream.read(size)


def read_matlab(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the vectors named in `wanted`, at most `most_rows` of each; `name.field` is a
    structure's.

    Raises InputError on a file that is no undamaged MATLAB file of version 5 to 7, on a timetable or another
    object where a vector is missing, with what to type in MATLAB, and on a variable that is not a real vector
    of numbers, NaN is unmeasured, or larger than `MOST_BYTES`. Raises OSError when the file cannot be read.
    """
    values: dict[str, FloatArray] = {}
    names: list[str] = []
    objects: dict[str, str] = {}
    seen: set[str] = set()
    try:
        with path.open("rb") as stream:
            for variable in variables(path, stream):
                head = variable.head()
                is_structure = head.class_code == STRUCTURE
                asked = [label for label in wanted if label.split(".")[0] == head.name]
                if asked and head.name in seen:
                    raise InputError(f"{path}: has variable {head.name!r} twice; save it again")
                seen.add(head.name)
                names.append(f"{head.name}.FIELD" if is_structure else head.name)
                if head.object_class:
                    names[-1] = f"{head.name} ({head.object_class})"
                    objects[head.name] = head.object_class
                if not asked:
                    continue
                if head.object_class:
                    raise refuse_object(path, head.name, head.object_class)
                content = variable.content()
                if is_structure:
                    fields = Matrix.parse(content, variable.order).fields()
                    names[-1:] = [f"{head.name}.{field}" for field in fields] or [names[-1]]
                for label in asked:
                    vector = _vector_at(path, content, variable.order, label, most_rows)
                    if vector is not None:
                        values[label] = vector
    except (DamagedError, zlib.error):
        raise InputError(f"{path}: is a damaged MATLAB file; save it again") from None
    missing = tuple(label for label in wanted if label not in values)
    for name, class_name in objects.items():
        if missing or not values:
            raise refuse_object(path, name, class_name)
    for label, vector in values.items():
        refuse_infinite(path, label, "variable", vector, lambda index: f"sample {index + 1}")
    return Table(
        values=values,
        missing=missing,
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


def variables(path: Path, stream: BinaryIO) -> Iterator[Variable]:
    order = _byte_order(path, stream.read(_HEADER_BYTES))
    end = path.stat().st_size
    position, count = _HEADER_BYTES, 0
    while position + 8 <= end:
        stream.seek(position)
        kind, size = struct.unpack(f"{order}II", stream.read(8))
        position += 8
        count += 1
        if kind not in (MATRIX, COMPRESSED) or position + size > end:
            raise DamagedError
        if count > MOST_VARIABLES:
            raise InputError(
                f"{path}: holds more than {MOST_VARIABLES} variables; save those of the record alone"
            )
        yield Variable(path, stream, position, size, kind == COMPRESSED, order)
        position += size


def _vector_at(path: Path, content: memoryview, order: str, label: str, most_rows: int) -> FloatArray | None:
    """The vector that `label` names below the variable of its first part, or None if there is none."""
    for field in label.split(".")[1:]:
        fields = Matrix.parse(content, order).fields()
        if field not in fields:
            return None
        content = fields[field]
    try:
        return Matrix.parse(content, order).vector(most_rows)
    except InputError as error:
        raise InputError(f"{path}: variable {label!r} {error}") from None
