"""A corrected axis inside a position loop: every draw with its effects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.response.loop_kernel import loop_jointly
from bayes_hw.model.controller_kernel import LoopSignals, PositionLoop


@dataclass(frozen=True, eq=False)
class EffectLoop:
    """Draws of a cascade with effects, as `loop_kernel.loop_jointly` takes them; known inputs are at rest."""

    response: JointResponse
    draws: tuple[JointValues, ...]

    @classmethod
    def of(cls, response: JointResponse, coordinates: FloatArray) -> EffectLoop:
        """Of coordinates (draws, size)."""
        return cls(response, tuple(response.values(x) for x in coordinates))

    def take(self, index: IntArray) -> EffectLoop:
        """The draws of the given indices."""
        return EffectLoop(self.response, tuple(self.draws[i] for i in index))

    def simulate(self, loop: PositionLoop) -> LoopSignals:
        """Command, w and output without noise."""
        found = LoopSignals(*(np.empty((len(self.draws), len(loop.reference))) for _ in range(3)))
        late, steps = loop.delay + self.response.structure.delay_samples, self.response.steps
        for i, draw in enumerate(self.draws):
            own = tuple(effect for effect in draw.effects if not effect.form.column)
            packed = self.response.packed(JointValues(draw.cascade, own))
            loop_jointly(
                loop.numbers, loop.sections, loop.ratio, late, loop.reference, loop.noise[i : i + 1].ravel(),
                loop.start[i], packed.axis(), steps, packed.no_columns, *(signal[i] for signal in found),
            )  # fmt: skip
        return found
