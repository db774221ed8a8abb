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
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS
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
            ports = turned.ports(i)
            away = replace(
                ports, real=-ports.real, sections=-ports.sections, direct=ports.direct * np.array([-1.0, 1.0])
            )
            (slot,) = other.slots(fit.response.scale)
            effects.append(Effect(other, np.array([np.clip(bend, slot.lower, slot.upper)]), away))
        else:
            effects.append(replace(one, ports=turned.ports(i)))
    return fit.moved(turned.structure, JointValues(turned.cascade(), tuple(effects)))


@dataclass(frozen=True, eq=False)
class _States:
    """States of G and of one torque's direct path, a step of a sample at a time: how they go on (n, n), how
    that torque enters (n,), what its law sees of them (n,), and the rows (1 + laws, n) by which command and
    torques enter, and by which the angle and the signals see them; those of `own` motions without the base's.
    """

    transition: FloatArray
    entering: FloatArray
    seen: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    own: FloatArray

    @classmethod
    def of(cls, fit: JointFit, number: int) -> _States:
        values, s, steps = fit.values, fit.structure, fit.response.steps
        row = values.law_row(number)
        axis = fit.response.packed(values).axis()
        p = axis.paths
        states = s.real_poles + 2 * s.sections
        kept = np.append(np.arange(states), states + row)
        inputs = entering(p)[:, kept]
        alone = p._replace(
            signal_real=np.zeros_like(p.signal_real), signal_sections=np.zeros_like(p.signal_sections)
        )
        whole, based = (seen(one, axis.laws, steps)[:, kept] for one in (p, alone))
        transition = np.diag(np.concatenate([p.real[0], np.zeros(2 * s.sections), p.direct[row, 1:]]))
        for i, (a1, a2) in enumerate(p.sections[:2].T):
            at = s.real_poles + 2 * i
            transition[at : at + 2, at : at + 2] = [[a1, 1.0], [-a2, 0.0]]
        return cls(transition, inputs[1 + row], whole[1 + row], inputs, whole, whole - based)


@dataclass(frozen=True, eq=False)
class _Turned:
    """G beyond the bend by its modes, each with the angle that it adds for its state: `poles` of a sample,
    weights of command and torques (1 + laws, modes), and what every law sees of them by a motion of its own
    (1 + laws, modes)."""

    fit: JointFit
    number: int
    structure: Structure
    real: list[int]
    pairs: list[tuple[int, int]]
    poles: ComplexArray
    inputs: ComplexArray
    signals: ComplexArray

    @classmethod
    def of(cls, fit: JointFit, number: int, slope: float) -> _Turned | None:
        axis, s, steps = _States.of(fit, number), fit.structure, fit.response.steps
        poles, modes = np.linalg.eig(axis.transition - slope * np.outer(axis.entering, axis.seen))
        poles, modes = poles.astype(np.complex128), modes.astype(np.complex128)
        shown = axis.outputs[0] @ modes
        if np.abs(shown).min(initial=np.inf) == 0 or np.linalg.cond(modes) > 1 / np.finfo(float).eps:
            return None
        modes = modes / shown
        signals = axis.own @ modes
        signals[1 + fit.values.law_row(number)] = axis.seen @ modes - (steps * (poles - 1)) ** 2
        poles *= np.minimum(1.0, LARGEST_RADIUS / np.maximum(np.abs(poles), LARGEST_RADIUS))
        of_sample = poles**steps
        inputs = np.linalg.solve(modes, axis.inputs.T).T * (1 - of_sample) / (1 - poles)
        alone = sorted(
            (i for i in range(len(poles)) if of_sample[i].imag == 0), key=lambda i: -of_sample[i].real
        )
        upper = [i for i in range(len(poles)) if of_sample[i].imag > 0]
        count = min(s.real_poles, len(alone))
        count += (len(alone) - count) % 2
        pairs = [(i, int(np.argmin(np.abs(poles - poles[i].conj())))) for i in upper]
        rest = alone[count:]
        pairs += list(zip(rest[0::2], rest[1::2], strict=True))
        structure = replace(s, real_poles=count, sections=len(pairs))
        found = cls(fit, number, structure, alone[:count], pairs, of_sample, inputs, signals)
        return found if np.isfinite(found.cascade().sections).all() else None

    def cascade(self) -> CascadeValues:
        """With the command's weights."""
        old, z = self.fit.values.cascade, self.poles
        real = np.array([z[self.real].real, self.inputs[0, self.real].real])
        denominators = [((z[i] + z[k]).real, (z[i] * z[k]).real) for i, k in self.pairs]
        sections = np.concatenate([np.array(denominators).reshape(-1, 2), self._entering(0)], axis=1).T
        starts = np.zeros((len(old.starts), int(self.structure.integrator) + len(z)))
        return replace(old, real=real, sections=np.ascontiguousarray(sections), starts=starts)

    def ports(self, number: int) -> Ports:
        """Those of effect `number`; the direct path of the bend is part of G."""
        row, old = 1 + self.fit.values.law_row(number), self.fit.values.effects[number].ports
        assert old is not None
        bends = number == self.number
        return Ports(
            self.inputs[row, self.real].real,
            self._entering(row).T,
            old.direct * np.array([0.0, 1.0]) if bends else old.direct,
            self.signals[row, self.real].real,
            self._seeing(row).T,
            old.signal or bends,
        )

    def _entering(self, row: int) -> FloatArray:
        """Weights (sections, 2) of an input into both states of every section."""
        w, z = self.inputs[row], self.poles
        found = [((w[i] + w[k]).real, -(z[k] * w[i] + z[i] * w[k]).real) for i, k in self.pairs]
        return np.array(found, dtype=np.float64).reshape(-1, 2)

    def _seeing(self, row: int) -> FloatArray:
        """Weights (sections, 2) of both states of every section in a signal."""
        e, z = self.signals[row], self.poles
        second = [(e[i] - e[k]) / (z[i] - z[k]) for i, k in self.pairs]
        found = [((e[i] + x * z[k]).real, x.real) for (i, k), x in zip(self.pairs, second, strict=True)]
        return np.array(found, dtype=np.float64).reshape(-1, 2)
