"""A position loop around an axis, and one sample of its controller (`bayes_hw.control.controller`).

`numbers` (8,) are Kp, Ki T, Kd / (Tf + T), Tf / (Tf + T), the limits of the command, the most that it changes
a sample and the share of back-calculation; `sections` (n, 5) the filters' b0, b1, b2, a1, a2, with a state of
two numbers each in `filters` (n, 2); `state` (4,) is the filtered error, the derivative, the memory and the
command of the sample before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.compiled import compiled

BEFORE, DERIVATIVE, MEMORY, COMMAND = range(4)
STATES = 4


@dataclass(frozen=True, eq=False)
class PositionLoop:
    """A controller around draws of an axis: it acts on every `ratio`-th sample, its command `delay` samples
    late beside G's own delay.

    `numbers` and `sections` are the controller's, as above, `reference` (samples,) in output units, `noise`
    (draws, samples) or empty is added to what it measures, `start` (draws,) is where the axis rests.
    """

    numbers: FloatArray
    sections: FloatArray
    ratio: int
    delay: int
    reference: FloatArray
    noise: FloatArray
    start: FloatArray

    def take(self, index: IntArray) -> PositionLoop:
        """Around the draws of the given indices."""
        noise = self.noise[index] if self.noise.size else self.noise
        return replace(self, noise=noise, start=self.start[index])


class LoopSignals(NamedTuple):
    """Command u, w and true output y = n(w) of every draw, each of shape (draws, samples)."""

    u: FloatArray
    w: FloatArray
    y: FloatArray


@compiled(nogil=True)
def start_at_rest(sections, error, filters, state):  # type: ignore[no-untyped-def]
    """Filters and states as `error` has left them that was ever the same, the command zero."""
    for i in range(len(sections)):
        b0, b1, b2, a1, a2 = sections[i]
        gain = (b0 + b1 + b2) / (1 + a1 + a2)
        filters[i, 1] = b2 * error - a2 * gain * error
        filters[i, 0] = (gain - b0) * error
        error = gain * error
    state[:] = 0.0
    state[BEFORE] = error


@compiled(nogil=True)
def next_command(numbers, sections, error, filters, state):  # type: ignore[no-untyped-def]
    """The command at `error`; `filters` and `state` go on by one sample."""
    proportional, integral, derivative, pole, lowest, highest, most_change, share = numbers
    for i in range(len(sections)):
        b0, b1, b2, a1, a2 = sections[i]
        filtered = b0 * error + filters[i, 0]
        filters[i, 0] = b1 * error - a1 * filtered + filters[i, 1]
        filters[i, 1] = b2 * error - a2 * filtered
        error = filtered
    change, command = error - state[BEFORE], state[COMMAND]
    rate = pole * state[DERIVATIVE] + derivative * change
    memory = state[MEMORY] + (proportional * change + integral * error + rate - state[DERIVATIVE])
    limited = min(max(memory, command - most_change), command + most_change)
    command = min(max(limited, lowest), highest)
    state[BEFORE], state[DERIVATIVE], state[COMMAND] = error, rate, command
    state[MEMORY] = memory + share * (command - memory)
    return command
