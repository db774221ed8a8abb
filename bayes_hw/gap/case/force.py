"""A force that a simulator is to add to its own, as effects of the catalogue give it."""

from __future__ import annotations

from typing import Protocol

from bayes_hw.arrays import FloatArray


class Force(Protocol):
    """An acceleration that depends on the motion: a force over the inertia that it acts on.

    A compiled simulator may take the law by its numbers, `settings` (batch, COUNT) as
    `bayes_hw.gap.simulate.settings` numbers them, and the known `signal` (samples,) where there is one.
    """

    @property
    def settings(self) -> FloatArray: ...

    @property
    def signal(self) -> FloatArray | None: ...

    def __call__(self, k: int, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Acceleration (batch,), output units per s^2, at sample k for positions and velocities (batch,)."""
        ...
