"""A spring whose stiffness changes at a bend, and which of its two sides is taken for G's own.

A gap passes nothing on until it is closed, a torque limit nothing more beyond: both are a spring with a bend,
and -clip(q / t) on a G with the spring of beyond is the same motion as what exceeds the bend on a G with that
of within. With q = C x, x' = A x + P tau and the law's slope -1 / t, G beyond the bend is A - P C / t, of
other poles. Where the axis is stiffer beyond, the spring is the axis' own and the bend a gap; where it is
softer, the spring within is, and something gives way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.structure_moves import pruned
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import FORMS, Form
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.response.state_kernel import entering, seen
from bayes_hw.identify.cascade import CascadeValues, Structure

BENT: dict[int, Form] = {
    law: next(f for f in FORMS if f.law == law and f.base == K.BASE_TWIST) for law in (K.GAP, K.EXCESS)
}
"""Forms of a bend in the drive's spring, by law: what is lacking within, and what is lacking beyond."""

LIGHT = 0.25
"""Damping ratio of the pairs of G that swing."""

FEWEST_SAMPLES = 4
LARGEST_RADIUS = 0.9995
SLACK_NATS = 5.0
"""That the other side may cost: both are one motion but for what happens within a sample."""


def as_it_bends(fit: JointFit) -> JointFit:
    """The fit with springs that bend under the name of what bends so, and G as the spring is that is the
    axis' own."""
    for number, effect in enumerate(fit.values.effects):
        if effect.form not in BENT.values() or not opposes(fit, number):
            continue
        other = from_other_side(fit, number)
        if other is not None and (other := pruned(other.descended())).score > fit.score - SLACK_NATS:
            fit = other
    return fit


def opposes(fit: JointFit, number: int) -> bool:
    """Whether the torque of effect `number` opposes what it looks at: by the response of that signal to the
    torque, over a quarter of the period of what swings fastest."""
    axis = _States.of(fit, number)
    pairs = np.log(np.linalg.eigvals(axis.transition).astype(np.complex128))
    swings = np.abs(pairs[(pairs.imag > 0) & (-pairs.real < LIGHT * np.abs(pairs))])
    samples = max(round(0.25 * 2 * np.pi / float(swings.max())), FEWEST_SAMPLES) if len(swings) else 0
    state, step, total = axis.entering, 0.0, 0.0
    for _ in range(max(samples, FEWEST_SAMPLES)):
        step += float(axis.seen @ state)
        total += step
        state = axis.transition @ state
    return total > 0


def from_other_side(fit: JointFit, number: int) -> JointFit | None:
    """The same motion with G as it is on the other side of the bend, not descended; None where that G has
    no modes of its own, or no such structure."""
    effect = fit.values.effects[number]
    slots = effect.form.slots(fit.response.scale)
    bend = next(float(v) for slot, v in zip(slots, effect.values, strict=True) if slot.row == 0)
    turned = _Turned.of(fit, number, 1 / bend)
    if turned is None:
        return None
    other = BENT[K.GAP if effect.form.law == K.EXCESS else K.EXCESS]
    effects = []
    for i, one in enumerate(fit.values.effects):
        if one.ports is None:
            effects.append(one)
        elif i == number:
            ports = turned.ports(i, other.base)
            away = replace(
                ports, real=-ports.real, sections=-ports.sections, direct=ports.direct * np.array([-1.0, 1.0])
            )
            (slot,) = other.slots(fit.response.scale)
            effects.append(Effect(other, np.array([np.clip(bend, slot.lower, slot.upper)]), away))
        else:
            effects.append(replace(one, ports=turned.ports(i, one.form.base)))
    return fit.moved(turned.structure, JointValues(turned.cascade(), tuple(effects)))


@dataclass(frozen=True, eq=False)
class _States:
    """States of G and of one torque's direct path: how they go on (n, n), how that torque enters (n,), what
    its law sees of them (n,), and the rows (1 + laws, n) by which command and torques enter and by which
    angle and signals see them."""

    transition: FloatArray
    entering: FloatArray
    seen: FloatArray
    inputs: FloatArray
    outputs: FloatArray

    @classmethod
    def of(cls, fit: JointFit, number: int) -> _States:
        values, s = fit.values, fit.structure
        laws = [e for e in values.effects if e.ports is not None]
        row = values.law_row(number)
        ports = [e.ports for e in laws if e.ports is not None]
        states = s.real_poles + 2 * s.sections
        kept = np.append(np.arange(states), states + row)
        rows = _rows(values, laws)
        inputs, outputs = (one[:, kept] for one in rows)
        poles, pairs = values.cascade.real[0], values.cascade.sections[:2].T
        transition = np.diag(np.concatenate([poles, np.zeros(2 * s.sections), ports[row].direct[1:]]))
        for i, (a1, a2) in enumerate(pairs):
            at = s.real_poles + 2 * i
            transition[at : at + 2, at : at + 2] = [[a1, 1.0], [-a2, 0.0]]
        return cls(transition, inputs[1 + row], outputs[1 + row], inputs, outputs)


def _rows(values: JointValues, laws: list[Effect]) -> tuple[FloatArray, FloatArray]:
    """By which command and torques enter all states, and by which angle and signals see them."""
    ports = [e.ports for e in laws if e.ports is not None]
    cascade = values.cascade
    codes = [np.array([getattr(e.form, name) for e in laws], dtype=np.int64) for name in ("law", "base")]
    direct = np.array([p.direct for p in ports])
    real, sections = np.ascontiguousarray(cascade.real), np.ascontiguousarray(cascade.sections)
    entered = entering(
        cascade.integrator_residue, real, sections, np.array([p.real for p in ports]),
        np.array([p.sections for p in ports]), direct,
    )  # fmt: skip
    sight = seen(
        cascade.integrator_residue, real, sections, *codes, direct,
        np.array([p.signal_real for p in ports]), np.array([p.signal_sections for p in ports]), 1,
    )  # fmt: skip
    return entered, sight


@dataclass(frozen=True, eq=False)
class _Turned:
    """G beyond the bend as a cascade: its `modes` (n, n), eigenvectors whose part of the angle is one."""

    fit: JointFit
    number: int
    structure: Structure
    real: list[int]
    pairs: list[tuple[int, int]]
    poles: ComplexArray
    inputs: ComplexArray
    outputs: ComplexArray

    @classmethod
    def of(cls, fit: JointFit, number: int, slope: float) -> _Turned | None:
        axis, s = _States.of(fit, number), fit.structure
        poles, modes = np.linalg.eig(axis.transition - slope * np.outer(axis.entering, axis.seen))
        shown = axis.outputs[0] @ modes
        if np.abs(shown).min(initial=np.inf) == 0 or np.linalg.cond(modes) > 1 / np.finfo(float).eps:
            return None
        modes = modes / shown
        inputs, outputs = np.linalg.solve(modes, axis.inputs.T).T, axis.outputs @ modes
        poles = poles * np.minimum(1.0, LARGEST_RADIUS / np.maximum(np.abs(poles), LARGEST_RADIUS))
        alone = sorted((i for i in range(len(poles)) if poles[i].imag == 0), key=lambda i: -poles[i].real)
        upper = [i for i in range(len(poles)) if poles[i].imag > 0]
        count = min(s.real_poles, len(alone))
        count += (len(alone) - count) % 2
        pairs = [(i, int(np.argmin(np.abs(poles - poles[i].conj())))) for i in upper]
        rest = alone[count:]
        pairs += list(zip(rest[0::2], rest[1::2], strict=True))
        structure = replace(s, real_poles=count, sections=len(pairs))
        found = cls(fit, number, structure, alone[:count], pairs, poles, inputs, outputs)
        return found if np.isfinite(found.cascade().sections).all() else None

    def cascade(self) -> CascadeValues:
        """With the command's weights."""
        old = self.fit.values.cascade
        real = np.array([self.poles[self.real].real, self.inputs[0, self.real].real])
        sections = np.array(
            [
                [(self.poles[i] + self.poles[k]).real, (self.poles[i] * self.poles[k]).real, *weights]
                for (i, k), weights in zip(self.pairs, self._entering(0), strict=True)
            ]
        ).reshape(-1, 4)
        order = int(self.structure.integrator) + len(self.poles)
        starts = np.zeros((len(old.starts), order))
        return replace(old, real=real, sections=np.ascontiguousarray(sections.T), starts=starts)

    def ports(self, number: int, base: int) -> Ports:
        """Those of effect `number`, whose law looks at its own motion and at what `base` says."""
        effect = self.fit.values.effects[number]
        row, old = self.fit.values.law_row(number), effect.ports
        assert old is not None
        direct = old.direct * np.array([0.0, 1.0]) if number == self.number else old.direct
        ports = Ports(
            self.inputs[1 + row, self.real].real,
            np.array(self._entering(1 + row)).reshape(-1, 2).T,
            direct,
            np.zeros(len(self.real)),
            np.zeros((2, len(self.pairs))),
            old.signal or number == self.number,
        )
        if not ports.signal:
            return ports
        cascade = self.cascade()
        form = replace(effect.form, base=base)
        own = _rows(JointValues(cascade), [replace(effect, form=form, ports=ports)])[1][1]
        n = len(self.real)
        asked = np.array(self._seeing(1 + row)).reshape(-1, 2)
        return replace(
            ports,
            signal_real=self.outputs[1 + row, self.real].real - own[:n],
            signal_sections=(asked - own[n : n + asked.size].reshape(-1, 2)).T,
        )

    def _entering(self, row: int) -> list[tuple[float, float]]:
        """Weights of an input into both states of every section."""
        w, z = self.inputs[row], self.poles
        return [((w[i] + w[k]).real, -(z[k] * w[i] + z[i] * w[k]).real) for i, k in self.pairs]

    def _seeing(self, row: int) -> list[tuple[float, float]]:
        """Weights of both states of every section in an output."""
        e, z = self.outputs[row], self.poles
        found = []
        for i, k in self.pairs:
            second = (e[i] - e[k]) / (z[i] - z[k])
            found.append((float((e[i] + second * z[k]).real), float(second.real)))
        return found
