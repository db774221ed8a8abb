"""The batch simulator block by block: many walkers on a record too long to hold what they all give."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.kernel import AT_REST, BLOCK, KnownSignals, _delayed, _filled_up, _simulate
from bayes_hw.model.modal import ModalForm

SAMPLES = 128 * BLOCK
"""Samples simulated at a time."""


def simulated_blocks(
    form: ModalForm, u: FloatArray, delay_samples: int, before: float, signals: KnownSignals = AT_REST
) -> Iterator[tuple[int, FloatArray]]:
    """The first sample and y (walkers, at most SAMPLES) of every block of the response to u (samples,).

    Every block is written over the one before it: copy what is to be kept. `before` is the command before the
    first sample.
    """
    filled = _filled_up(form)
    delayed = _delayed(u, delay_samples, before)
    w, y = np.empty((2, filled[0].shape[-1], SAMPLES))
    for begin in range(0, len(u), SAMPLES):
        part = delayed[begin : begin + SAMPLES]
        shown = np.ascontiguousarray(signals.rows[:, begin : begin + SAMPLES])
        _simulate(*filled, part, shown, signals.through, w, y)
        yield begin, y[: form.walkers, : len(part)]
