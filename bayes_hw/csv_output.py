"""Writing tables of numbers."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import temporary_sibling

ROWS = 2**16
"""Turned into text at once: the text of a long record takes ten times the memory of its numbers."""


def write_csv(path: Path, columns: Mapping[str, FloatArray]) -> None:
    """Write columns of equal length under their names, with all 17 digits of every number; NaN is empty."""
    table = list(columns.values())
    with temporary_sibling(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        for start in range(0, len(table[0]), ROWS):
            rows = np.column_stack([column[start : start + ROWS] for column in table])
            text = io.StringIO()
            np.savetxt(text, rows, fmt="%.17g", delimiter=",")
            file.write(text.getvalue().replace("nan", "") if np.isnan(rows).any() else text.getvalue())
