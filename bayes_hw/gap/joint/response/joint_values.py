"""Natural parameters of a cascade with effects in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.identify.cascade import CascadeValues

DIRECT_POLE = 0.5
"""Of what a port passes beside the poles of G, at first."""


@dataclass(frozen=True, eq=False)
class Ports:
    """How a torque enters and what its law looks at, as the kernel has it; `signal` says whether the signal
    port is free."""

    real: FloatArray
    sections: FloatArray
    direct: FloatArray
    signal_real: FloatArray
    signal_sections: FloatArray
    signal: bool = False

    @classmethod
    def none(cls, n_real: int, n_sections: int) -> Ports:
        """A port that passes nothing."""
        return cls(
            np.zeros(n_real), np.zeros((2, n_sections)), np.array([0.0, DIRECT_POLE]),
            np.zeros(n_real), np.zeros((2, n_sections)),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Effect:
    """A form with its parameters (natural units) and, where it is a torque, its ports."""

    form: Form
    values: FloatArray
    ports: Ports | None = None

    @property
    def is_own_law(self) -> bool:
        """Whether it is a torque by a law of its own: no known input, and no observer."""
        return self.ports is not None and not self.form.column

    @property
    def acts_within_sample(self) -> bool:
        """Whether it matters to it where within a sample the axis turns."""
        return self.is_own_law or self.form.remembers

    @property
    def looks_at_states(self) -> bool:
        """Whether it is a torque whose law looks at the states of G too, and so at a motion of its own."""
        return self.ports is not None and self.ports.signal


@dataclass(frozen=True, eq=False)
class JointValues:
    """Natural parameters: the cascade and the effects in it."""

    cascade: CascadeValues
    effects: tuple[Effect, ...] = ()

    def law_row(self, number: int) -> int:
        """Which of a simulation's laws, by their torques and signals, effect `number` is."""
        return sum(effect.ports is not None for effect in self.effects[:number])
