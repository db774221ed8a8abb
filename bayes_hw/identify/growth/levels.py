"""Levels of records whose angles count from one that was estimated: what of residuals they explain.

The mean of n readings at rest is off by their deviation over the root of n, which thousands of samples tell.
A level is a nuisance of the likelihood, linear in it: profiled by generalised least squares, which with a
flat prior is its integral up to a constant.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.holes import mask_of
from bayes_hw.record import Record

WHITE = Whitener(np.zeros((1, 0)), np.ones(1))
"""Noise whose innovations are itself."""

Block: TypeAlias = tuple[FloatArray, int, BoolArray | None]
"""Rows (n, samples) of a part of a record, how many samples at their start belong to the part before, and
which samples were measured, None where all were."""


def level_shapes(
    records: Sequence[Record], weights: Sequence[FloatArray] | None = None
) -> tuple[FloatArray, ...]:
    """What a level of one adds to the residuals (samples,) of each record, divided by its weights where
    given; zeros where the level is known."""
    ones = [np.full(len(record), float(record.has_free_level)) for record in records]
    return tuple(ones if weights is None else [one / w for one, w in zip(ones, weights, strict=True)])


def levels_of(
    residuals: Sequence[FloatArray],
    shapes: Sequence[FloatArray],
    whitener: Whitener,
    masks: Sequence[BoolArray] | None,
) -> FloatArray:
    """Level (records,) of every record by generalised least squares; zero where it is known, and where
    residuals are beyond numbers."""
    found = np.zeros(len(residuals))
    for number, (e, shape) in enumerate(zip(residuals, shapes, strict=True)):
        if shape.any():
            level, error = whitener.apply(np.stack([shape, e]), 0, mask_of(masks, number))
            with np.errstate(all="ignore"):
                found[number] = (level @ error) / (level @ level)
    return np.where(np.isfinite(found), found, 0.0)


def levelled(
    residuals: Sequence[FloatArray],
    shapes: Sequence[FloatArray],
    whitener: Whitener,
    masks: Sequence[BoolArray] | None,
) -> tuple[FloatArray, ...]:
    """The residuals less their levels."""
    levels = levels_of(residuals, shapes, whitener, masks)
    return tuple(
        e - level * shape if level else e for e, shape, level in zip(residuals, shapes, levels, strict=True)
    )


def with_level_rows(blocks: Iterable[Block], shapes: Sequence[FloatArray]) -> Iterator[Block]:
    """Blocks of all records in turn with one row more in front for every free level: what it adds."""
    free = free_levels(shapes)
    if not free:
        yield from blocks
        return
    record, at = 0, 0
    for rows, first, measured in blocks:
        level = np.zeros((len(free), rows.shape[1]))
        if record in free:
            level[free.index(record)] = shapes[record][at - first : at - first + rows.shape[1]]
        yield np.concatenate([level, rows]), first, measured
        at += rows.shape[1] - first
        if at == len(shapes[record]):
            record, at = record + 1, 0


def free_levels(shapes: Sequence[FloatArray]) -> list[int]:
    """Numbers of the records whose level is free."""
    return [number for number, shape in enumerate(shapes) if shape.any()]
