"""How the simulated outputs answer small changes of the parameters, and how much that tells of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.output_error import DIFFERENCE_STEP, prior_scale, simulated_outputs, whitened
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of all outputs at one point.

    `matrix` (samples, parameters) is d y / d coordinate by central differences, output units. `kink` is the
    largest disagreement of the differences to either side as a share of the largest derivative: above about
    1e-3 a sample lies within a step of a limit or threshold.
    """

    matrix: FloatArray
    kink: float


def sensitivity(axis: AxisParameters, values: FloatArray, records: Sequence[Record]) -> Sensitivity:
    """Derivatives of the outputs of all records at `values` (parameters,) in coordinates."""
    centre = as_coordinates(axis.parameters, values)[:, None]
    count = len(centre)
    steps = DIFFERENCE_STEP * np.eye(count)
    trials = np.concatenate([centre, centre + steps, centre - steps], axis=1)
    outputs = np.concatenate(simulated_outputs(axis, as_values(axis.parameters, trials), records), axis=1)
    middle, above, below = outputs[0], outputs[1 : count + 1], outputs[count + 1 :]
    slopes = (above - below) / (2 * DIFFERENCE_STEP)
    bend = float(np.max(np.abs(above + below - 2 * middle), initial=0.0)) / DIFFERENCE_STEP
    largest = float(np.max(np.abs(slopes), initial=0.0))
    return Sensitivity(np.ascontiguousarray(slopes.T), bend / largest if largest > 0 else 0.0)


def fisher_information(
    axis: AxisParameters,
    values: FloatArray,
    records: Sequence[Record],
    autoregression: FloatArray,
    innovation_sigma: FloatArray,
) -> FloatArray:
    """Information about the axis in coordinates at every column of `values` (parameters, points), given the
    noise there; shape (points, parameters, parameters).

    J^T J of the sensitivities, whitened record by record with `autoregression` (order, points) and divided by
    `innovation_sigma` (points,). That about the noise's own parameters is independent of it.
    """
    centre = as_coordinates(axis.parameters, values)
    count, points = centre.shape
    steps = DIFFERENCE_STEP * np.eye(count)[:, :, None]
    both = np.concatenate([centre[:, None] + steps, centre[:, None] - steps], axis=1)
    trials = as_values(axis.parameters, both.reshape(count, -1))
    information = np.zeros((points, count, count))
    for record, output in zip(records, simulated_outputs(axis, trials, records), strict=True):
        shaped = output.reshape(2, count, points, -1)
        slopes = (shaped[0] - shaped[1]) / (2 * DIFFERENCE_STEP)
        for point in range(points):
            rows = whitened(slopes[:, point], autoregression[:, point], record.measured)
            rows /= innovation_sigma[point]
            information[point] += rows @ rows.T
    return information


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
