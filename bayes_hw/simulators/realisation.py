"""A linear system from responses to pulses: the eigensystem realisation, with bases that stay.

From the responses P(k) (outputs, inputs) to a pulse a step long, H0 holds P(i + j + 1) and H1 P(i + j + 2) at
chosen times i and j. With U and V of the singular value decomposition of H0 at one system, any system near it
of the same order has, in coordinates of its own,

    A = (U' H0 V)^-1 U' H1 V,   B = (U' H0 V)^-1 U' H0 e,   C = e' H0 V,

e the first block of columns or rows (eigensystem realisation: Juang and Pappa, doi 10.2514/3.20031).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray

SMALLEST_SHARE = 1e-9
"""Of the largest singular value: what is below it is taken for the arithmetic of the simulator."""

LARGEST_ORDER = 16
BLOCKS = 40
"""Times of rows, and of columns, of the Hankel matrices."""


@dataclass(frozen=True)
class Realisation:
    """Bases of the Hankel matrices of responses (steps, outputs, inputs), scaled to one size."""

    left: FloatArray
    right: FloatArray
    output_scales: FloatArray
    input_scales: FloatArray

    @classmethod
    def of(cls, responses: FloatArray) -> Realisation:
        """From one system's responses."""
        outputs = 1 / np.maximum(np.max(np.abs(responses), axis=(0, 2)), 1e-300)
        scaled = responses * outputs[:, None]
        inputs = 1 / np.maximum(np.max(np.abs(scaled), axis=(0, 1)), 1e-300)
        hankel, _ = _hankel(scaled * inputs)
        left, sizes, right = np.linalg.svd(hankel, full_matrices=False)
        order = min(int(np.sum(sizes > SMALLEST_SHARE * sizes[0])), LARGEST_ORDER)
        bases = np.asarray(left[:, :order], np.float64), np.asarray(right[:order].T, np.float64)
        return cls(*bases, np.asarray(outputs), np.asarray(inputs))

    def system(self, responses: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (order, order), B (order, inputs) and C (outputs, order) of a system near that of the bases."""
        _, outputs, inputs = responses.shape
        scaled = responses * self.output_scales[:, None] * self.input_scales
        first, second = _hankel(scaled)
        middle = self.left.T @ first @ self.right
        transition = np.linalg.solve(middle, self.left.T @ second @ self.right)
        entering = np.linalg.solve(middle, self.left.T @ first[:, :inputs]) / self.input_scales
        shown = (first[:outputs] @ self.right) / self.output_scales[:, None]
        return np.asarray(transition, np.float64), np.asarray(entering, np.float64), np.asarray(shown)


def _hankel(responses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """H0 and H1 at BLOCKS times of rows and of columns, from the responses at steps 1 and later."""
    stride = max(1, (len(responses) - 3) // (2 * (BLOCKS - 1)))
    blocks = min(BLOCKS, (len(responses) - 3) // (2 * stride) + 1)
    times = stride * (np.arange(blocks)[:, None] + np.arange(blocks)[None, :])
    return tuple(  # type: ignore[return-value]
        np.ascontiguousarray(
            responses[times + shift]
            .transpose(0, 2, 1, 3)
            .reshape(blocks * responses.shape[1], blocks * responses.shape[2])
        )
        for shift in (1, 2)
    )
