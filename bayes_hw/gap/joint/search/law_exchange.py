"""The law of a torque exchanged for another one, in an explanation that is finished.

Laws that act through free ports come close to one another (a gap that opens and a friction that breaks loose
are the same curve over different signals), and a descent that began with one of them ends where its own start
led. What one has found, the others begin with: the new law looks at what the old one looked at, as nearly as
the states of G give it, enters where that entered, and is as strong as least squares makes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit, raced
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.time_budget import time_is_up

PERIODIC = (K.RIPPLE, K.MODULATED)
EXCHANGED: tuple[Form, ...] = tuple(
    form for form in FORMS if form.is_law and not form.further and form.law not in PERIODIC
)
"""Laws that are not periodic in position."""

SIZES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Standard deviations of what a law looks at, in units of where it bends."""

ALIKE = 0.9
"""Correlation of the torques from which an exchange is tried, and how many are."""

MOST_TRIED = 4
FIRST_STEPS = 10


@dataclass(frozen=True, eq=False)
class _Begun:
    """An exchange that is not descended, and the correlation of its torque with the old one."""

    alike: float
    fit: JointFit


def exchanged(fit: JointFit) -> list[JointFit]:
    """The fit with one of its laws exchanged for those that give nearly the same torque and look at a motion,
    each descended; none where it has no law of its own that is not periodic, or where time is up."""
    order = min(fit.noise_order, 1)
    found: list[JointFit] = []
    for number in laws_of(fit):
        if not time_is_up():
            begun = [one for one in exchanges(fit, number, EXCHANGED) if not looks_beside_position(one)]
            found += raced([one.descended_under(order, FIRST_STEPS) for one in begun[:MOST_TRIED]])
    return found


def laws_of(fit: JointFit) -> list[int]:
    """Numbers of its effects that are laws of their own and not periodic in position."""
    effects = enumerate(fit.values.effects)
    return [number for number, e in effects if e.is_own_law and e.form.law not in PERIODIC]


def looks_beside_position(fit: JointFit) -> bool:
    """Whether a law of the position looks at a motion of its own: what stops an axis is where it stands."""
    laws = [e for e in fit.values.effects if e.is_own_law and e.form.base == K.BASE_POSITION]
    return any(e.looks_at_states for e in laws)


def exchanges(fit: AnyFit, number: int, forms: Sequence[Form]) -> list[AnyFit]:
    """The fit with the law of effect `number` exchanged for those of `forms` that give nearly the same
    torque, the most alike first, not descended."""
    old = _Old.of(fit, number)
    begun = [one for form in forms if form is not old.effect.form for one in old.exchanged_for(form)]
    begun = sorted((one for one in begun if one.alike > ALIKE), key=lambda one: -one.alike)
    return cast(list[AnyFit], [one.fit for one in begun])


@dataclass(frozen=True, eq=False)
class _Old:
    """The effect in its place of a fit, with what it looked at and its torque (samples of all records,)."""

    fit: JointFit
    number: int
    effect: Effect
    signal: FloatArray
    torque: FloatArray

    @classmethod
    def of(cls, fit: JointFit, number: int) -> _Old:
        runs = [fit.response.along(fit.values, i) for i in range(len(fit.response.records))]
        row = fit.values.law_row(number)
        signal = np.concatenate([run.signals[row] for run in runs])
        torque = np.concatenate([run.torques[row] for run in runs])
        return cls(fit, number, fit.values.effects[number], signal, torque)

    def exchanged_for(self, form: Form) -> list[_Begun]:
        """The most alike of the form's starts; none where every one of them rests."""
        seen, _ = self._beside([Effect(form, np.array(form.starts(self._scale)[0]), p) for p in self._units])
        states = seen[1:] - seen[0]
        gram = states @ states.T
        gram += 1e-12 * np.trace(gram) * np.eye(len(gram))
        found = []
        for start in form.starts(self._scale):
            bends = start[0] if any(slot.row == 0 for slot in form.slots(self._scale)) else None
            unit = form.unit_of_signal(self._scale) if bends is None else bends
            for size in SIZES:
                wanted = self.signal / np.std(self.signal) * size * unit
                weights = np.linalg.solve(gram, states @ (wanted - seen[0]))
                found.append(Effect(form, np.array(start, dtype=np.float64), self._looking(weights)))
        _, torques = self._beside(found)
        products, powers = torques @ self.torque, np.sum(torques**2, axis=1)
        alike = np.abs(products) / np.sqrt(np.maximum(powers, 1e-300) * float(self.torque @ self.torque))
        best = int(np.argmax(np.where(np.isfinite(alike), alike, 0.0)))
        if not powers[best] > 0:
            return []
        return [_Begun(float(alike[best]), self._with(found[best], float(products[best] / powers[best])))]

    @property
    def _scale(self) -> JointScale:
        return self.fit.response.scale

    @property
    def _units(self) -> list[Ports]:
        """Of ports that look at nothing, and at one state of G each."""
        size = self.fit.structure.real_poles + 2 * self.fit.structure.sections
        return [self._looking(weights) for weights in np.concatenate([np.zeros((1, size)), np.eye(size)])]

    def _looking(self, weights: FloatArray) -> Ports:
        """A port through which nothing enters, looking at the states of G with `weights` (states,)."""
        s = self.fit.structure
        seen = weights[s.real_poles :].reshape(2, s.sections)
        nothing = Ports.none(s.real_poles, s.sections)
        return replace(nothing, signal_real=weights[: s.real_poles], signal_sections=seen, signal=True)

    def _beside(self, laws: Sequence[Effect]) -> tuple[FloatArray, FloatArray]:
        """What laws look at through which nothing enters the fit, and their torques, (laws, samples) each."""
        runs = self.fit.response.beside(self.fit.values, laws)
        signals = np.concatenate([run.signals[-len(laws) :] for run in runs], axis=1)
        return signals, np.concatenate([run.torques[-len(laws) :] for run in runs], axis=1)

    def _with(self, law: Effect, strength: float) -> JointFit:
        """The fit with `law` in the old one's place, of this strength through the old one's port."""
        entered, looking = self.effect.ports, law.ports
        assert entered is not None and looking is not None
        ports = replace(
            looking,
            real=strength * entered.real,
            sections=strength * entered.sections,
            direct=entered.direct * np.array([strength, 1.0]),
        )
        effects = list(self.fit.values.effects)
        effects[self.number] = replace(law, ports=ports)
        values = JointValues(self.fit.values.cascade, tuple(effects))
        return self.fit.moved(self.fit.structure, values, self.fit.point.whitener)
