"""A motion that one law looks at, as nearly as other laws can see it through the states of a fit's G."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.response.joint_values import Effect, Ports

SIZES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Standard deviations of what a law looks at, in units of where it bends."""

RIDGE = 1e-12


@dataclass(frozen=True, eq=False)
class Motion:
    """What a law looks at, `signal`, to be looked at in `fit`, and the `torque` that it gives there, (samples
    of all records,) each."""

    fit: JointFit
    signal: FloatArray
    torque: FloatArray

    @classmethod
    def of(cls, fit: JointFit, number: int) -> Motion:
        """That of the law of effect `number`, in its own fit."""
        row = fit.values.law_row(number)
        runs = [fit.response.along(fit.values, record) for record in range(len(fit.response.records))]
        signal = np.concatenate([run.signals[row] for run in runs])
        return cls(fit, signal, np.concatenate([run.torques[row] for run in runs]))

    def laws(self, form: Form, starts: Sequence[Sequence[float]] = ()) -> list[Effect]:
        """The form from all of its starts or those given, looking at the motion in each of SIZES, entering
        nowhere."""
        scale = self.fit.response.scale
        starts = starts or form.starts(scale)
        seen, _ = self.beside([Effect(form, np.array(starts[0]), ports) for ports in self._units])
        joined = np.concatenate(seen, axis=1)
        states = joined[1:] - joined[0]
        gram = states @ states.T
        gram += RIDGE * np.trace(gram) * np.eye(len(gram))
        bends_first = any(slot.row == 0 for slot in form.slots(scale))
        found = []
        for start in starts:
            unit = start[0] if bends_first else form.unit_of_signal(scale)
            for size in SIZES:
                wanted = self.signal / np.std(self.signal) * size * unit
                weights = np.linalg.solve(gram, states @ (wanted - joined[0]))
                found.append(Effect(form, np.array(start, dtype=np.float64), self._looking(weights)))
        return found

    def beside(self, laws: Sequence[Effect]) -> tuple[list[FloatArray], list[FloatArray]]:
        """What laws look at through which nothing enters the fit, and their torques, (laws, samples) of every
        record."""
        runs = self.fit.response.beside(self.fit.values, laws)
        return [run.signals[-len(laws) :] for run in runs], [run.torques[-len(laws) :] for run in runs]

    @cached_property
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
