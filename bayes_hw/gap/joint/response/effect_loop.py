"""A corrected axis inside a position loop: every draw with its effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.response.loop_kernel import loop_jointly
from bayes_hw.gap.joint.response.within_sample import Paths, Stepped
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
        late = loop.delay + self.response.structure.delay_samples
        loop_jointly(
            loop.numbers, loop.sections, loop.ratio, late, loop.reference, loop.noise, loop.start,
            *self._packed(), self.response.steps, *found,
        )  # fmt: skip
        return found

    def _packed(self) -> list[FloatArray]:
        scale, structure, steps = self.response.scale, self.response.structure, self.response.steps
        laws = [e.form for e in self.response.template if e.is_own_law]
        d, j, n, m = len(self.draws), len(laws), structure.real_poles, structure.sections
        static, inputs, outputs = np.zeros((d, 3)), K.idle_inputs(d), np.zeros((d, K.OUTPUTS))
        outputs[:, K.SETTLING_TIME] = 1.0
        thetas = np.zeros((d, j, K.THETAS))
        thetas[:, :, 0] = 1.0
        ports = [
            np.zeros((d, j, n)), np.zeros((d, j, 2, m)), np.zeros((d, j, 2)), np.zeros((d, j, n)),
            np.zeros((d, j, 2, m)),
        ]  # fmt: skip
        for i, values in enumerate(self.draws):
            static[i] = values.cascade.lower, values.cascade.upper, values.cascade.half_width
            law = 0
            for effect in values.effects:
                if effect.form.column:
                    continue
                rows = {"input": inputs[i], "output": outputs[i]}.get(effect.form.place)
                target = thetas[i, law] if rows is None else rows
                if effect.ports is not None:
                    target[0] = effect.form.unit_of_signal(scale)
                for slot, value in zip(effect.form.slots(scale), effect.values, strict=True):
                    target[slot.row] = value
                if (p := effect.ports) is None:
                    continue
                given = (p.real, p.sections, p.direct, p.signal_real, p.signal_sections)
                for array, part in zip(ports, given, strict=True):
                    array[i, law] = part
                law += 1
        of_steps = [
            Stepped(
                Paths(v.cascade.integrator_residue, v.cascade.real, v.cascade.sections, *parts), steps
            ).fast
            for v, parts in zip(self.draws, zip(*ports, strict=True), strict=True)
        ]
        return [
            static, inputs, outputs, np.array([p.residue for p in of_steps]),
            _stacked([p.real for p in of_steps], (2, n)), _stacked([p.sections for p in of_steps], (4, m)),
            np.array([form.law for form in laws], dtype=np.int64),
            np.array([form.base for form in laws], dtype=np.int64), thetas,
            _stacked([p.port_real for p in of_steps], (j, n)),
            _stacked([p.port_sections for p in of_steps], (j, 2, m)),
            _stacked([p.direct for p in of_steps], (j, 2)),
            _stacked([p.signal_real for p in of_steps], (j, n)),
            _stacked([p.signal_sections for p in of_steps], (j, 2, m)),
        ]  # fmt: skip


def _stacked(parts: Sequence[FloatArray], shape: tuple[int, ...]) -> FloatArray:
    return np.ascontiguousarray(np.array(parts, dtype=np.float64).reshape(len(parts), *shape))
