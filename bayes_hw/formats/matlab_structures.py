"""Structures of a MATLAB file, their fields decoded when asked for: numbers, text, cells, structures."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.matlab_elements import CELL, STRUCTURE, TEXT, DamagedError, Matrix, next_element
from bayes_hw.formats.matlab_file import MOST_BYTES, variables

Value: TypeAlias = FloatArray | str | list["Value"] | dict[str, "Value"]
"""An array of real numbers in MATLAB's shape, text, the items of a cell array, the fields of a structure."""

DEEPEST = 16
MOST_ITEMS = 10_000
MOST_STRUCTURES = 64


@dataclass(frozen=True)
class Structure:
    """One 1 x 1 structure of a file; `fields` holds each field's content, not decoded."""

    path: Path
    name: str
    fields: Mapping[str, memoryview]
    order: str

    def __contains__(self, field: str) -> bool:
        return field in self.fields

    def value(self, field: str, most_numbers: int) -> Value:
        """The field decoded. Raises InputError where it holds more than `most_numbers` in one array, what is
        not decoded (objects, functions, sparse or complex numbers), or damage."""
        try:
            return _decoded(self.fields[field], self.order, most_numbers, DEEPEST, [MOST_ITEMS])
        except InputError as error:
            raise InputError(f"{self.path}: {self.name}.{field} {error}") from None
        except (DamagedError, UnicodeDecodeError):
            raise InputError(f"{self.path}: {self.name}.{field} is damaged; save the file again") from None


def read_structures(path: Path) -> list[Structure]:
    """Every 1 x 1 structure at the top of the file. Raises InputError on a file that is not sound or whose
    structures take more than MOST_BYTES together, OSError on one that cannot be read."""
    found: list[Structure] = []
    bytes_left = MOST_BYTES
    try:
        with path.open("rb") as stream:
            for variable in variables(path, stream):
                if variable.head().class_code != STRUCTURE:
                    continue
                if len(found) == MOST_STRUCTURES:
                    raise InputError(f"{path}: holds more than {MOST_STRUCTURES} structures; save one alone")
                content = variable.content(bytes_left)
                bytes_left -= len(content)
                matrix = Matrix.parse(content, variable.order)
                found.append(Structure(path, matrix.name, matrix.fields(), variable.order))
    except (DamagedError, zlib.error):
        raise InputError(f"{path}: is a damaged MATLAB file; save it again") from None
    return [structure for structure in found if structure.fields]


def _decoded(content: memoryview, order: str, most_numbers: int, depth: int, items_left: list[int]) -> Value:
    """`items_left` counts down over the whole value."""
    items_left[0] -= 1
    if depth == 0 or items_left[0] < 0:
        raise InputError("is nested too deeply or holds too many items; save only what is needed")
    if len(content) == 0:
        return np.zeros((0, 0))
    matrix = Matrix.parse(content, order)
    if matrix.class_code == TEXT:
        return matrix.text()
    if matrix.class_code == STRUCTURE:
        return {
            name: _decoded(field, order, most_numbers, depth - 1, items_left)
            for name, field in matrix.fields().items()
        }
    if matrix.class_code == CELL:
        count = math.prod(matrix.dimensions)
        if not 0 <= count <= items_left[0]:
            raise InputError(f"is a cell array of {count} items; save only what is needed")
        return [
            _decoded(next_element(matrix.rest)[1], order, most_numbers, depth - 1, items_left)
            for _ in range(count)
        ]
    return matrix.numbers(most_numbers)
