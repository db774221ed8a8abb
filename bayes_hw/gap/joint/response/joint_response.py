"""Residuals of a cascade with effects and their derivatives, in the coordinates of a descent.

Coordinates: those of `CascadeResponse` (limits, half width, integrator, real poles, sections), then for every
effect its parameters and, where it is a torque, its ports: weights into real poles and sections, weight and
pole of the direct path, and with a signal port the weights of the states in the law's signal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.joint.forms.effect_form import JointScale
from bayes_hw.gap.joint.noise.slow_noise import SlowNoise
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.response.kernel_numbers import Simulated
from bayes_hw.gap.joint.response.packed_axis import PackedAxis
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.levels import level_shapes
from bayes_hw.identify.holes import mask_of, masks_of, with_holes
from bayes_hw.model.known_input import NO_COLUMNS, typical_cycles
from bayes_hw.record import Record


@dataclass(frozen=True, eq=False)
class JointResponse:
    """The weighted residuals of `records` as a function of the coordinates of `structure` with `template`'s
    effects. `weights` (one array a record) divide residuals where given; where they are infinite a sample
    tells nothing and counts as not measured. G and the laws inside it take
    `steps` steps a sample; coordinates are those of samples, however many. The noise is that of the `cause`
    where there is one, which is normal, else a free autoregression whose innovations are Student t with
    `degrees_of_freedom`, normal where they are infinite."""

    structure: Structure
    template: tuple[Effect, ...]
    records: Sequence[Record]
    scale: JointScale
    weights: tuple[FloatArray, ...] | None = None
    steps: int = 1
    cause: SlowNoise | None = None
    degrees_of_freedom: float = np.inf

    @cached_property
    def _cascade(self) -> CascadeResponse:
        return CascadeResponse(self.structure, self.records)

    @cached_property
    def masks(self) -> tuple[BoolArray, ...] | None:
        """Which samples of every record were measured and tell something; None where all do."""
        of_records = masks_of(self.records)
        if self.weights is None or all(np.isfinite(w).all() for w in self.weights):
            return of_records
        told = tuple(np.isfinite(w) for w in self.weights)
        return told if of_records is None else tuple(a & b for a, b in zip(of_records, told, strict=True))

    @property
    def told(self) -> tuple[BoolArray, ...]:
        """`masks` as arrays (samples,) in every case."""
        return self.masks or tuple(np.ones(len(record), dtype=np.bool_) for record in self.records)

    def measured(self, number: int) -> BoolArray | None:
        """That of one record; None where all its samples count."""
        return mask_of(self.masks, number)

    @cached_property
    def level_shapes(self) -> tuple[FloatArray, ...]:
        """What a level of one adds to the weighted residuals of every record; zeros where it is known."""
        return level_shapes(self.records, self.weights)

    @cached_property
    def column_cycles(self) -> dict[str, float]:
        """Typical frequency, in cycles per sample, of every known input."""
        return {
            effect.form.column: typical_cycles([record.known[effect.form.column] for record in self.records])
            for effect in self.template
            if effect.form.is_known_input
        }

    @cached_property
    def _shown(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """What the encoder shows of every record, and how far an observer trusts it: in proportion to the
        inverse of its noise's variance, not at all in a hole."""
        found = []
        for number, record in enumerate(self.records):
            trust = np.ones(len(record)) if self.weights is None else self.weights[number] ** -2.0
            seen = ~np.isnan(record.y_or_nan)
            found.append((np.where(seen, record.y, 0.0), np.where(seen, trust, 0.0)))
        return tuple(found)

    @cached_property
    def _n_base(self) -> int:
        return self.structure.n_static + self.structure.n_linear

    @cached_property
    def _sizes(self) -> list[int]:
        s, found = self.structure, []
        for effect in self.template:
            size = len(effect.values)
            if effect.ports is not None:
                size += s.real_poles + 2 * s.sections + 2
                if effect.ports.signal:
                    size += s.real_poles + 2 * s.sections
            found.append(size)
        return found

    @property
    def _n_natural(self) -> int:
        return self._n_base

    @property
    def effect_sizes(self) -> tuple[int, ...]:
        """How many coordinates every effect has."""
        return tuple(self._sizes)

    def first_coordinate(self, number: int) -> int:
        """Of effect `number`; that of the first is the count of G's own."""
        return self._n_base + sum(self._sizes[:number])

    @property
    def held_numbers(self) -> int:
        """Of a port that is held to the way of what the loop misreads: G that is free bends with it."""
        return 1

    @property
    def size(self) -> int:
        return self._n_base + sum(self._sizes)

    def coordinates(self, values: JointValues) -> FloatArray:
        """Coordinates (size,) of natural parameters."""
        return np.concatenate([self._cascade.coordinates(values.cascade), self._effect_coordinates(values)])

    def _effect_coordinates(self, values: JointValues) -> FloatArray:
        parts = [np.empty(0)]
        for effect in values.effects:
            slots = effect.form.slots(self.scale)
            parts.append(
                np.array(
                    [np.log(x) if t.logarithmic else x for t, x in zip(slots, effect.values, strict=True)]
                )
            )
            if (p := effect.ports) is not None:
                direct = np.array([p.direct[0], np.arctanh(p.direct[1])])
                parts += [p.real, p.sections.ravel(), direct]
                if p.signal:
                    parts += [p.signal_real, p.signal_sections.ravel()]
        return np.concatenate(parts)

    def values(self, coordinates: FloatArray) -> JointValues:
        """Natural parameters at `coordinates` (size,)."""
        cascade = self._cascade.values(coordinates[: self._n_base])
        return JointValues(cascade, self._effect_values(coordinates[self._n_base :]))

    def _effect_values(self, coordinates: FloatArray) -> tuple[Effect, ...]:
        s, at = self.structure, 0
        effects = []
        for old, size in zip(self.template, self._sizes, strict=True):
            part = coordinates[at : at + size]
            at += size
            slots = old.form.slots(self.scale)
            own = np.array([np.exp(x) if t.logarithmic else x for t, x in zip(slots, part, strict=False)])
            ports = None
            if old.ports is not None:
                rest = part[len(slots) :]
                n, m = s.real_poles, 2 * s.sections
                direct = np.array([rest[n + m], np.tanh(rest[n + m + 1])])
                ports = replace(
                    old.ports, real=rest[:n], sections=rest[n : n + m].reshape(2, -1), direct=direct
                )
                if old.ports.signal:
                    more = rest[n + m + 2 :]
                    ports = replace(ports, signal_real=more[:n], signal_sections=more[n:].reshape(2, -1))
            effects.append(Effect(old.form, own, ports))
        return tuple(effects)

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray:
        """The nearest coordinates that mean something (see `CascadeResponse`), effects within bounds."""
        found = coordinates.copy()
        n = self._n_base
        found[:n] = self._admissible_base(found[:n], previous[:n])
        at = self._n_base
        for effect, size in zip(self.template, self._sizes, strict=True):
            for i, slot in enumerate(effect.form.slots(self.scale)):
                low, high = slot.lower, slot.upper
                if slot.logarithmic:
                    low, high = np.log(low), np.log(high)
                    step = found[at + i] - previous[at + i]
                    found[at + i] = previous[at + i] + np.clip(step, -1.0, 1.0)
                found[at + i] = np.clip(found[at + i], low, high)
            if effect.ports is not None:
                pole = at + len(effect.values) + self.structure.real_poles + 2 * self.structure.sections + 1
                found[pole] = np.clip(found[pole], -1.5, 1.5)
            at += size
        return found

    def _admissible_base(self, base: FloatArray, previous: FloatArray) -> FloatArray:
        return self._cascade.admissible(base, previous)

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        """Measured less simulated output of every record, over its weights, NaN where nothing was
        measured or a reading tells nothing."""
        return self.weighed(self.errors(coordinates))

    def weighed(self, errors: Sequence[FloatArray]) -> list[FloatArray]:
        """Errors (samples,) of every record over its weights, NaN where these are infinite."""
        if self.weights is not None:
            errors = [e / w for e, w in zip(errors, self.weights, strict=True)]
        return [with_holes(e, self.measured(number)) for number, e in enumerate(errors)]

    def errors(self, coordinates: FloatArray) -> list[FloatArray]:
        """Measured less simulated output of every record, NaN where nothing was measured."""
        packed = self.packed(self.values(coordinates))
        return [r.y_or_nan - self._along(packed, number)[0].y for number, r in enumerate(self.records)]

    def noise_of(self, residuals: Sequence[FloatArray], most: int, previous: Whitener | None) -> Whitener:
        """Of the cause, or an autoregression of order up to `most`."""
        if self.cause is None:
            free = Whitener.of_residuals(residuals, most)
            return replace(free, degrees_of_freedom=self.degrees_of_freedom)
        return self.cause.of(residuals, previous)

    def along(self, values: JointValues, number: int) -> Simulated:
        """The response to a record's command that residuals are of: corrected by its readings where an
        observer is part of the effects, else the same as `simulate` gives."""
        return self._along(self.packed(values), number)[0]

    def corrected_where(self, values: JointValues, number: int, where: BoolArray) -> Simulated:
        """As `along`, corrected by no other readings than those `where` (samples,) is true."""
        record, (shown, trust) = self.records[number], self._shown[number]
        return self.packed(values).run(record.u, record.known, (shown, np.where(where, trust, 0.0)))[0]

    def beside(self, values: JointValues, laws: Sequence[Effect]) -> list[Simulated]:
        """The response to the command of every record, with laws beside the effects whose torques enter
        nowhere: their signals and torques are the last ones."""
        larger = JointValues(values.cascade, (*values.effects, *laws))
        response = replace(self, template=larger.effects)
        return [response.along(larger, number) for number in range(len(self.records))]

    def packed(self, values: JointValues, tangents: bool = False, first: int = 0) -> PackedAxis:
        """The axis at `values`, to be simulated under any command."""
        return PackedAxis(self.structure, values, self.scale, self.steps, tangents, first)

    def _along(self, packed: PackedAxis, number: int) -> tuple[Simulated, FloatArray]:
        """What `PackedAxis.run` gives of a record."""
        record = self.records[number]
        return packed.run(record.u, record.known, self._shown[number])

    def simulate(
        self, values: JointValues, u: FloatArray, known: Mapping[str, FloatArray] = NO_COLUMNS
    ) -> Simulated:
        """The response to a command (samples,) and known inputs (samples,) by name from rest, which no
        reading corrects."""
        return self.packed(values).run(u, known)[0]

    def gated(self, coordinates: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """For every record the drive's command and dy/dw over the weight."""
        packed, found = self.packed(self.values(coordinates)), []
        for number in range(len(self.records)):
            run = self._along(packed, number)[0]
            slope = run.slope if self.weights is None else run.slope / self.weights[number]
            found.append((run.v, slope))
        return found

    def linearise(
        self,
        coordinates: FloatArray,
        overlap: int,  # noqa: ARG002
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        """Derivatives of y and, as the last row, the residual: rows (size + 1, samples) of every record, with
        the samples that were measured, None where all were."""
        values = self.values(coordinates)
        packed = self.packed(values, True)
        for number, record in enumerate(self.records):
            run, tangents = self._along(packed, number)
            rows = np.empty((self.size + 1, len(record)))
            self._chain(values, tangents, rows)
            rows[-1] = record.y - run.y
            if self.weights is not None:
                rows /= self.weights[number]
            yield rows, 0, self.measured(number)

    def effect_tangents(self, values: JointValues) -> list[FloatArray]:
        """For every record the derivatives (parameters, samples) of y by the coordinates of the last effect,
        over the weights; exact where that effect changes nothing yet."""
        found = []
        effect = values.effects[-1]
        packed = self.packed(values, True, self._n_natural + sum(self._sizes[:-1]))
        for number in range(len(self.records)):
            _, rows = self._along(packed, number)
            for i, slot in enumerate(effect.form.slots(self.scale)):
                if slot.logarithmic:
                    rows[i] *= effect.values[i]
            found.append(rows if self.weights is None else rows / self.weights[number])
        return found

    def _chain(self, values: JointValues, tangents: FloatArray, rows: FloatArray) -> None:
        """From tangents by natural parameters to derivatives by coordinates, in place."""
        s = self.structure
        rows[:-1] = tangents
        at = s.n_static + int(s.integrator)
        for i in range(s.real_poles):
            rows[at] *= 1 - values.cascade.real[0, i] ** 2
            at += 2
        for i in range(s.sections):
            a1, a2 = values.cascade.sections[:2, i]
            k1 = a1 / (1 + a2)
            first, second = tangents[at], tangents[at + 1]
            rows[at] = (1 - k1**2) * (1 + a2) * first
            rows[at + 1] = (1 - a2**2) * (k1 * first + second)
            at += 4
        self._chain_effects(values, rows, at)

    def _chain_effects(self, values: JointValues, rows: FloatArray, at: int) -> None:
        s = self.structure
        for effect, size in zip(values.effects, self._sizes, strict=True):
            for i, slot in enumerate(effect.form.slots(self.scale)):
                if slot.logarithmic:
                    rows[at + i] *= effect.values[i]
            if effect.ports is not None:
                pole = at + len(effect.values) + s.real_poles + 2 * s.sections + 1
                rows[pole] *= 1 - effect.ports.direct[1] ** 2
            at += size
