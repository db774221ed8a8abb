"""Records that do not start at rest: their initial states as parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.modal import ModalForm
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Normal

MEMORY_RADIUS = 0.5
"""Poles inside this radius forget their state within a few samples: no initial state is given to them."""


@dataclass(frozen=True)
class InitialStates:
    """Which poles of G have a free response, by their place among the real poles and among the pairs.

    `integrator` holds the position, where there is one. Every record has one parameter a real pole and two a
    pair, named `start<record>.<what>`, in output units.
    """

    integrator: int | None
    real: tuple[int, ...]
    pairs: tuple[int, ...]

    @classmethod
    def of_poles(
        cls, real_poles: FloatArray, pair_poles: ComplexArray, integrator: int | None
    ) -> InitialStates:
        """The integrator and every pole outside MEMORY_RADIUS."""
        slow = [i for i, pole in enumerate(real_poles) if abs(pole) > MEMORY_RADIUS and i != integrator]
        pairs = [i for i, pole in enumerate(pair_poles) if abs(pole) > MEMORY_RADIUS]
        return cls(integrator, tuple(slow), tuple(pairs))

    @property
    def count(self) -> int:
        """Parameters of one record."""
        return len(self.all_real) + 2 * len(self.pairs)

    @property
    def all_real(self) -> tuple[int, ...]:
        """The integrator and the other real poles, in the order of their parameters."""
        return self.real if self.integrator is None else (self.integrator, *self.real)

    def parameters(self, positions: Sequence[float], unit: str, scale: float) -> list[Parameter]:
        """The parameters of every record; `positions` are the measured first outputs.

        A free response may be as large as the output, `scale`: that of a slow pole beside an integrator often
        is. The position parameter is that of y: the dead zone's half width comes on top of it in w, so that a
        record that never comes near the dead zone leaves the two independent.
        """
        found = []
        for record, position in enumerate(positions, start=1):
            parts = [] if self.integrator is None else [("position", position, Normal(position, scale))]
            spread = Normal(0.0, scale)
            parts += [(f"real_pole{i + 1}", 0.0, spread) for i in self.real]
            parts += [(f"pair{i + 1}.{part}", 0.0, spread) for i in self.pairs for part in ("cosine", "sine")]
            found += [
                Parameter(f"start{record}.{name}", unit, value, prior, Identity())
                for name, value, prior in parts
            ]
        return found

    def apply(
        self, form: ModalForm, pair_poles: ComplexArray, start: FloatArray, offset: FloatArray
    ) -> ModalForm:
        """The form started so that its free response is the one that `start` (count, walkers) describes.

        `offset` (walkers,) is what the dead zone takes off w at the first position.
        A real pole p with free response a p^k has x(0) = a / residue; a pair with Re((A - iB) p^k) has
        s(k) = Re(C p^k) with C = (A - iB) p^2 / (b1 p + b2). One of no weight has no free response.
        """
        real_state, pair_state = form.real_state.copy(), form.pair_state.copy()
        for row, index in enumerate(self.all_real):
            response = start[row] + offset if index == self.integrator else start[row]
            real_state[index] = _over(response, form.real[1, index])
        for number, index in enumerate(self.pairs):
            row = len(self.all_real) + 2 * number
            pole = pair_poles[index]
            b1, b2 = form.pairs[2, index], form.pairs[3, index]
            amplitude = _over((start[row] - 1j * start[row + 1]) * pole**2, b1 * pole + b2)
            pair_state[0, index] = (amplitude / pole).real
            pair_state[1, index] = (amplitude / pole**2).real
        return replace(form, real_state=real_state, pair_state=pair_state)


def _over(response: Any, weight: Any) -> Any:
    """The states (walkers,), real or complex, that answer `response` through `weight`; zero where that is."""
    return np.divide(response, weight, out=np.zeros_like(response), where=weight != 0)
