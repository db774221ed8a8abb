"""Writing tables of numbers."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import write_text_atomically


def write_csv(path: Path, columns: Mapping[str, FloatArray]) -> None:
    """Write columns of equal length under their names, with all 17 digits of every number."""
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.17g", delimiter=",")
    write_text_atomically(path, text.getvalue())
