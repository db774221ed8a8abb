"""Glitches of the encoder beside slow noise: they stand out of their neighbours whatever is slow beneath.

The slow noise is fitted to the other samples; glitches add the likelihood of their places and heights, as
beside noise of the encoder alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.glitches import Glitches
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import GLITCHES
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.whitener import bridged_records


@dataclass(frozen=True)
class SecondGlitches:
    """Glitches that were found, and the misfit with them bridged; see `SecondCause`."""

    label: ClassVar[str] = GLITCHES.label
    form: ClassVar[str] = "with glitches"
    rounds: ClassVar[int] = 0

    misfit: Misfit
    glitches: Glitches

    @classmethod
    def of(cls, fit: Misfit) -> SecondGlitches | None:
        """Those of the residuals; None without glitches."""
        glitches = Glitches.of(fit.residuals)
        if glitches is None:
            return None
        return cls(fit.with_residuals(bridged_records(fit.residuals, glitches.masks)), glitches)

    @property
    def variances(self) -> list[FloatArray]:
        return [np.where(mask, np.inf, 0.0) for mask in self.glitches.masks]

    @property
    def log_likelihood(self) -> float:
        return self.glitches.log_likelihood

    @property
    def parameters(self) -> dict[str, tuple[float, float, str]]:
        return self.glitches.parameters(self.misfit.scale.units.output)

    def beside(self, noise: StateNoise) -> SecondGlitches:  # noqa: ARG002
        """Glitches stay where they are."""
        return self
