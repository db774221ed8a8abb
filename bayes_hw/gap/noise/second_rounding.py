"""Rounding of an encoder beside slow noise.

A rounding error of a moving axis is white and uniform over a step (Widrow and Kollar, Quantization Noise,
2008), of variance step^2 / 12, which is what the likelihood of slow noise takes it for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.stochastic import lattice_step, rounding_step
from bayes_hw.gap.noise.whitener import only_read


@dataclass(frozen=True)
class SecondRounding:
    """Rounding to a lattice of `step`, output units; see `SecondCause`."""

    label: ClassVar[str] = ROUNDING
    form: ClassVar[str] = "with rounding"
    rounds: ClassVar[int] = 0
    log_likelihood: ClassVar[float] = 0.0

    misfit: Misfit
    step: float

    @classmethod
    def of(cls, fit: Misfit) -> SecondRounding | None:
        """That of the measured values; None where they lie on no lattice."""
        step = lattice_step(only_read(fit.measured, fit.unread))
        return cls(fit, step) if step else None

    @property
    def variances(self) -> list[FloatArray]:
        return [np.full(len(e), self.step**2 / 12) for e in self.misfit.residuals]

    @property
    def parameters(self) -> dict[str, tuple[float, float, str]]:
        return rounding_step(self.step, self.misfit.scale.units.output)

    def beside(self, noise: StateNoise) -> SecondRounding:  # noqa: ARG002
        """The lattice is a fact."""
        return self
