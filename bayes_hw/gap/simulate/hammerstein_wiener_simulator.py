"""A Hammerstein-Wiener model as a simulator among others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.force import Force
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.chain import ChainBuilder
from bayes_hw.gap.simulate.chain_batch import simulate_chains
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import Parameter
from bayes_hw.record import Units


@dataclass(frozen=True)
class HammersteinWienerSimulator:
    """`model` behind the interface of any simulator, its parameters those of FORMATS.md.

    A diagnosis of a model.json does not go this way: it reads a drive train back from G, which gives more
    effects a place than the doors of a simulator do.
    """

    model: HammersteinWiener
    force_door: bool = False

    @property
    def name(self) -> str:
        return self.model.name

    @property
    def sample_rate_hz(self) -> float:
        return self.model.sample_rate_hz

    @property
    def units(self) -> Units:
        return self.model.units

    @property
    def noise_sigma(self) -> float:
        return self.model.noise_sigma

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._builder.base_parameters

    @cached_property
    def _builder(self) -> ChainBuilder:
        return ChainBuilder(self.model)

    def simulate(
        self,
        values: FloatArray,
        inputs: FloatArray,
        force: Force | None = None,  # noqa: ARG002
    ) -> FloatArray:
        """Outputs (batch, samples) from rest, for values (batch, parameters) and commands (samples,)."""
        settings = np.tile(S.NEUTRAL, (len(values), 1))
        for row, own in zip(values, settings, strict=True):
            self._builder.write_base(row, own)
        chains = self._builder.chains(values, [None] * len(values), False)
        ((_, y),) = simulate_chains(chains, settings, [inputs])
        return np.ascontiguousarray(y.T)
