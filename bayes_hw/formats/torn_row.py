"""Whether the last row of a text file was cut off in its midst, as where a log ran out of space."""

from __future__ import annotations

import csv
from pathlib import Path

from bayes_hw.formats.text_layout import NUMBER, Layout, cells_of

TAIL_BYTES = 2**13
FEWEST_ROWS = 10


def ends_torn(path: Path, layout: Layout) -> bool:
    """Whether the file ends without the end of a line, in a row that has fewer cells than those before, or
    whose last number has fewer decimals than any of them."""
    if layout.encoding == "utf-16":
        return False
    with path.open("rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(max(0, size - TAIL_BYTES))
        tail = stream.read()
    if tail.endswith((b"\n", b"\r")):
        return False
    try:
        *before, last = [
            cells_of(line, layout.separator)
            for line in tail.decode("utf-8", "replace").splitlines()[1:]
            if line
        ]
    except (csv.Error, ValueError):
        return False
    whole = [row[: layout.columns] for row in before if len(row) >= layout.columns]
    if len(whole) < FEWEST_ROWS or len(whole) < len(before) or not last:
        return False
    if len(last) < layout.columns:
        return True
    decimals = [_decimals(row[-1], layout.decimal) for row in whole]
    cell = last[layout.columns - 1]
    return (not cell or NUMBER.fullmatch(cell) is not None) and _decimals(cell, layout.decimal) < min(
        decimals
    )


def _decimals(cell: str, sign: str) -> int:
    return len(cell.partition(sign)[2])
