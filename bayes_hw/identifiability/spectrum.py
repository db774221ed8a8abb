"""The spectrum of what the records know, in units of what the prior knew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.sensitivity import fisher_information
from bayes_hw.identify.output_error import prior_scale
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.record import Record

NAMED_SHARE = 0.3
"""Parameters with at least this component in an eigenvector are named with it."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of the Fisher information, each coordinate scaled by its prior's standard deviation.

    `eigenvalues` (parameters,), largest first: an eigenvalue is the precision that the records add along its
    direction over that of the prior, below one the prior knows more. `directions` (parameters, parameters),
    one column each.
    """

    label: str
    names: tuple[str, ...]
    eigenvalues: FloatArray
    directions: FloatArray

    def components(self, index: int) -> list[tuple[str, float]]:
        """The parameters that make up one direction, largest component first."""
        column = self.directions[:, index]
        order = np.argsort(-np.abs(column))
        return [(self.names[i], float(column[i])) for i in order if abs(column[i]) >= NAMED_SHARE]

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return {
            "label": self.label,
            "eigenvalues": [float(value) for value in self.eigenvalues],
            "directions": [dict(self.components(i)) for i in range(len(self.eigenvalues))],
        }


def information_spectrum(
    label: str,
    axis: AxisParameters,
    values: FloatArray,
    records: Sequence[Record],
    autoregression: FloatArray,
    innovation_sigma: float,
) -> Spectrum:
    """The spectrum at `values` (parameters,) for noise of the given autoregression (order,)."""
    information = fisher_information(
        axis, values[:, None], records, autoregression[:, None], np.array([innovation_sigma])
    )[0]
    _, prior_sd = prior_scale(axis)
    eigenvalues, directions = np.linalg.eigh(information * np.outer(prior_sd, prior_sd))
    return Spectrum(label, axis.names, np.maximum(eigenvalues[::-1], 0.0), directions[:, ::-1])
