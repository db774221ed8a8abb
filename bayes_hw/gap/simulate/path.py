"""Paths of the linear block: first-order states from an input to w and to what turns inside the drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray, IntArray
from bayes_hw.compiled import compiled

OUTPUTS = 4


class Path(NamedTuple):
    """States in continuous time: poles (n,) in 1/s, `real_count` real ones and then the upper ones of pairs.

    `inputs` (doors, n) are the gains by which they are driven, `outputs` (4, n) those of w, motor angle,
    motor speed and load speed. A pair counts twice the real part of its upper pole.
    """

    real_count: int
    poles: ComplexArray
    inputs: ComplexArray
    outputs: ComplexArray

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of real poles and of pairs."""
        return self.real_count, len(self.poles) - self.real_count


class States(NamedTuple):
    """States stepped by h: real and imaginary parts of pairs as two rows, the lane last.

    `factors` (n, lanes) holds exp(s h), `inputs` (doors, n, lanes) what a unit input adds in a step,
    `outputs` (4, n, lanes) the gains.
    """

    real_count: int
    factors: FloatArray
    inputs: FloatArray
    outputs: FloatArray


def states(paths: Sequence[Path], h: float, lanes: IntArray | None = None) -> States:
    """`paths` of one shape in steps of h seconds, lane i that of path `lanes[i]`, or of path i.

    `lanes` begin with 0, 1, 2 and so on up to the last path.
    """
    real_count = paths[0].real_count
    own = np.arange(len(paths)) if lanes is None else lanes
    parts = (np.array([path[part] for path in paths]) for part in (1, 2, 3))
    return States(real_count, *_stepped(real_count, *parts, h, own))


@compiled
def _stepped(real_count, poles, inputs, outputs, h, lanes):  # type: ignore[no-untyped-def]
    """The arrays of `States` of paths (paths, n), (paths, doors, n) and (paths, 4, n)."""
    paths, n = poles.shape
    doors, rows = inputs.shape[1], 2 * n - real_count
    factors, gains = np.empty((rows, len(lanes))), np.empty((doors, rows, len(lanes)))
    shown = np.empty((OUTPUTS, rows, len(lanes)))
    for i in range(paths):
        for k in range(n):
            s = poles[i, k]
            turn = np.exp(s * h)
            hold = (turn - 1) / s if s != 0 else h + 0j
            row = k if k < real_count else 2 * k - real_count
            factors[row, i] = turn.real
            for door in range(doors):
                gains[door, row, i] = (inputs[i, door, k] * hold).real
            for kind in range(OUTPUTS):
                shown[kind, row, i] = outputs[i, kind, k].real
            if k >= real_count:
                factors[row + 1, i] = turn.imag
                for door in range(doors):
                    gains[door, row + 1, i] = (inputs[i, door, k] * hold).imag
                for kind in range(OUTPUTS):
                    shown[kind, row, i] *= 2
                    shown[kind, row + 1, i] = -2 * outputs[i, kind, k].imag
    for lane in range(paths, len(lanes)):
        for row in range(rows):
            factors[row, lane] = factors[row, lanes[lane]]
            for door in range(doors):
                gains[door, row, lane] = gains[door, row, lanes[lane]]
            for kind in range(OUTPUTS):
                shown[kind, row, lane] = shown[kind, row, lanes[lane]]
    return factors, gains, shown


@compiled
def ordered(poles, inputs, outputs):  # type: ignore[no-untyped-def]
    """What `Path` holds of states in any order; what is real of a real pole's gains is kept."""
    n, doors = len(poles), len(inputs)
    order, real_count = np.empty(n, np.int64), 0
    for i in range(n):
        if poles[i].imag == 0:
            order[real_count] = i
            real_count += 1
    at = real_count
    for i in range(n):
        if poles[i].imag != 0:
            order[at] = i
            at += 1
    s, driven = np.empty(n, np.complex128), np.empty((doors, n), np.complex128)
    shown = np.empty((OUTPUTS, n), np.complex128)
    for k in range(n):
        i = order[k]
        s[k] = poles[i]
        for door in range(doors):
            driven[door, k] = inputs[door, i] if k >= real_count else inputs[door, i].real + 0j
        for kind in range(OUTPUTS):
            shown[kind, k] = outputs[kind, i] if k >= real_count else outputs[kind, i].real + 0j
    return real_count, s, driven, shown
