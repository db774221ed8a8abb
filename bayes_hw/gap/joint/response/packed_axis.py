"""A cascade with effects as the compiled kernel has it: arrays of numbers, and the column of each.

Columns are in the order of the coordinates of `joint_response`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import INNOVATION_COLUMN, JointScale
from bayes_hw.gap.joint.response.joint_kernel import respond_jointly
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.response.kernel_numbers import Axis, Columns, Laws, PathColumns, Paths, Simulated
from bayes_hw.gap.joint.response.within_sample import Stepped
from bayes_hw.identify.cascade import Structure
from bayes_hw.model.known_input import delayed_column


def _columns(*shape: int) -> IntArray:
    return np.full(shape, -1)


class _Numbers:
    """Numbers of effects and laws with their columns, read from `values` effect by effect."""

    def __init__(self, s: Structure, values: JointValues, scale: JointScale) -> None:
        self.laws = [effect for effect in values.effects if effect.ports is not None]
        n, m, count = s.real_poles, s.sections, len(self.laws)
        self.inputs, self.outputs = K.idle_inputs(), np.zeros(K.OUTPUTS)
        self.outputs[K.SETTLING_TIME] = 1.0
        self.c_static, self.c_inputs, self.c_outputs = _columns(3), _columns(K.INPUTS), _columns(K.OUTPUTS)
        self.c_residue, self.c_real, self.c_sections = -1, _columns(2, n), _columns(4, m)
        self.thetas, self.c_thetas = np.ones((count, K.THETAS)), _columns(count, K.THETAS)
        self.thetas[:, 1:] = 0.0
        self.port_real, self.c_port_real = np.zeros((count, n)), _columns(count, n)
        self.port_sections, self.c_port_sections = np.zeros((count, 2, m)), _columns(count, 2, m)
        self.direct, self.c_direct = np.zeros((count, 2)), _columns(count, 2)
        self.signal_real, self.c_signal_real = np.zeros((count, n)), _columns(count, n)
        self.signal_sections, self.c_signal_sections = np.zeros((count, 2, m)), _columns(count, 2, m)
        self.readings: list[tuple[int, Effect]] = []
        """Known inputs that are added to the readings, and the column of the first number of each."""
        self.forcing: list[tuple[int, Effect]] = []
        """Known inputs that are torques, and an observer: the number of the law of each."""
        at = 0
        for i, present in enumerate((s.lower, s.upper, s.dead_zone)):
            if present:
                self.c_static[i] = at
                at += 1
        if s.integrator:
            self.c_residue = at
            at += 1
        self.c_real[:] = np.arange(at, at + 2 * n).reshape(n, 2).T
        at += 2 * n
        self.c_sections[:] = np.arange(at, at + 4 * m).reshape(m, 4).T
        at += 4 * m
        law = 0
        for effect in values.effects:
            at = self._read(effect, law, at, s, scale)
            law += effect.ports is not None
        self.count = at

    def _read(self, effect: Effect, law: int, at: int, s: Structure, scale: JointScale) -> int:
        """The column after those of the effect, the first of which is `at`."""
        if effect.form.column:
            if effect.ports is None:
                self.readings.append((at, effect))
                return at + 2
            self.forcing.append((law, effect))
        if effect.ports is not None:
            self.thetas[law, 0] = effect.form.unit_of_signal(scale)
        for slot, value in zip(effect.form.slots(scale), effect.values, strict=True):
            if effect.form.place == "input":
                self.inputs[slot.row], self.c_inputs[slot.row] = value, at
            elif effect.form.place == "output":
                self.outputs[slot.row], self.c_outputs[slot.row] = value, at
            else:
                self.thetas[law, slot.row], self.c_thetas[law, slot.row] = value, at
            at += 1
        if (own := effect.ports) is None:
            return at
        n, m = s.real_poles, s.sections
        self.port_real[law], self.port_sections[law], self.direct[law] = own.real, own.sections, own.direct
        self.c_port_real[law] = np.arange(at, at + n)
        at += n
        self.c_port_sections[law] = np.arange(at, at + 2 * m).reshape(2, m)
        at += 2 * m
        self.c_direct[law] = at, at + 1
        at += 2
        self.signal_real[law], self.signal_sections[law] = own.signal_real, own.signal_sections
        if own.signal:
            self.c_signal_real[law] = np.arange(at, at + n)
            at += n
            self.c_signal_sections[law] = np.arange(at, at + 2 * m).reshape(2, m)
            at += 2 * m
        return at

    def leave_out(self, first: int) -> None:
        """No columns before `first`, which becomes the first."""
        for c in (
            self.c_static, self.c_inputs, self.c_outputs, self.c_real, self.c_sections, self.c_thetas,
            self.c_port_real, self.c_port_sections, self.c_direct, self.c_signal_real,
            self.c_signal_sections,
        ):  # fmt: skip
            c[...] = np.maximum(c - first, -1)
        self.c_residue = max(self.c_residue - first, -1)

    def columns(self, count: int, read: Sequence[int]) -> Columns:
        """Of so many columns, of which `read` begin with what known inputs add to the readings."""
        paths = PathColumns(
            self.c_residue, self.c_real, self.c_sections, self.c_port_real, self.c_port_sections,
            self.c_direct, self.c_signal_real, self.c_signal_sections,
        )  # fmt: skip
        of_readings = np.array(read, dtype=np.int64)
        return Columns(count, self.c_static, self.c_inputs, self.c_outputs, self.c_thetas, of_readings, paths)


@dataclass(frozen=True, eq=False)
class PackedAxis:
    """An axis at `values`, with `tangents` by the coordinates from `first` on or without any."""

    structure: Structure
    values: JointValues
    scale: JointScale
    steps: int
    tangents: bool = False
    first: int = 0

    @cached_property
    def _numbers(self) -> _Numbers:
        found = _Numbers(self.structure, self.values, self.scale)
        found.leave_out(self.first if self.tangents else found.count)
        return found

    @cached_property
    def _stepped(self) -> Stepped:
        n, cascade = self._numbers, self.values.cascade
        paths = Paths(
            cascade.integrator_residue, np.ascontiguousarray(cascade.real),
            np.ascontiguousarray(cascade.sections), n.port_real, n.port_sections, n.direct, n.signal_real,
            n.signal_sections,
        )  # fmt: skip
        return Stepped(paths, self.steps)

    def axis(self, length: int = 0) -> Axis:
        """Its numbers for a record of so many samples; known torques are at rest."""
        n, cascade = self._numbers, self.values.cascade
        law, base = (np.array([getattr(e.form, name) for e in n.laws], np.int64) for name in ("law", "base"))
        forced, by_lag = np.zeros((2, len(n.laws), length))
        static = np.array([cascade.lower, cascade.upper, cascade.half_width, self.scale.sigma])
        laws = Laws(law, base, n.thetas, forced, by_lag)
        return Axis(static, n.inputs, n.outputs, self._stepped.fast, laws)

    @property
    def no_columns(self) -> Columns:
        """Those of an axis without tangents."""
        return self._numbers.columns(0, ())

    def run(
        self,
        u: FloatArray,
        known: Mapping[str, FloatArray],
        shown: tuple[FloatArray, FloatArray] | None = None,
    ) -> tuple[Simulated, FloatArray]:
        """Simulate from rest, with tangents (columns, samples) of y by numbers; an observer corrects by what
        is `shown` with the trust in it, and without that does nothing. The readings of a motion that
        overflows are infinite from the first on, so that no hole in a record hides where it left the axis."""
        n, length = self._numbers, len(u)
        axis = self.axis(length)
        count = len(n.laws)
        columns = n.count - self.first if self.tangents else 0
        rows = np.empty((columns, length) if self.tangents else (0, 0))
        run = Simulated(*(np.empty(length) for _ in range(4)), *(np.empty((count, length)) for _ in range(2)))
        run.y[:] = 0.0
        read = []
        for at, effect in n.readings:
            gain, lag = (float(x) for x in effect.values)
            added, by_lag = delayed_column(known, effect.form.column, lag, length)
            run.y[:] += gain * added
            for column, slope in ((at - self.first, added), (at + 1 - self.first, gain * by_lag)):
                if self.tangents and column >= 0:
                    rows[column] = slope
                    read.append(column)
        for law, effect in n.forcing:
            name, torque = effect.form.column, (axis.laws.forced, axis.laws.by_lag)
            if name == INNOVATION_COLUMN:
                if shown is not None:
                    torque[0][law], torque[1][law] = shown
            elif effect.values.size:
                torque[0][law], torque[1][law] = delayed_column(known, name, float(effect.values[-1]), length)
            else:
                torque[0][law] = known[name][:length]
        delayed, delay = np.zeros(length), self.structure.delay_samples
        delayed[delay:] = u[: length - delay]
        where = n.columns(columns, read)
        respond_jointly(delayed, axis, self.steps, where, run, rows)
        if not np.isfinite(run.w[-1:]).all():
            run.y[:] = np.inf
        if self.tangents:
            self._stepped.chain(rows, where.paths)
        return run, rows
