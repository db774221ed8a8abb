"""Small linear systems of one input and one output as matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x(k+1) = a x(k) + b e(k), u(k) = c x(k) + d e(k); a (n, n), b and c (n,)."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: float

    @classmethod
    def gain(cls, value: float) -> StateSpace:
        """A system without state."""
        return cls(np.zeros((0, 0)), np.zeros(0), np.zeros(0), value)

    @classmethod
    def first_order(cls, a: float, b: float, c: float, d: float) -> StateSpace:
        """A system of one state."""
        return cls(np.array([[a]]), np.array([b]), np.array([c]), d)

    @classmethod
    def biquad(cls, b0: float, b1: float, b2: float, a1: float, a2: float) -> StateSpace:
        """(b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2), transposed direct form II."""
        return cls(
            np.array([[-a1, 1.0], [-a2, 0.0]]),
            np.array([b1 - a1 * b0, b2 - a2 * b0]),
            np.array([1.0, 0.0]),
            b0,
        )

    @property
    def order(self) -> int:
        return len(self.b)

    def parallel(self, other: StateSpace) -> StateSpace:
        """The sum of the outputs of two systems with one input."""
        n = self.order
        a = np.zeros((n + other.order, n + other.order))
        a[:n, :n], a[n:, n:] = self.a, other.a
        return StateSpace(
            a,
            np.concatenate([self.b, other.b]),
            np.concatenate([self.c, other.c]),
            self.d + other.d,
        )


def series(first: StateSpace, second: StateSpace) -> StateSpace:
    """`second` fed by the output of `first`."""
    n, m = first.order, second.order
    a = np.zeros((n + m, n + m))
    a[:n, :n], a[n:, n:] = first.a, second.a
    a[n:, :n] = np.outer(second.b, first.c)
    return StateSpace(
        a,
        np.concatenate([first.b, second.b * first.d]),
        np.concatenate([second.d * first.c, second.c]),
        first.d * second.d,
    )
