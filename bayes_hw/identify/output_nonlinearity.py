"""Step 3: the output nonlinearity, from w simulated with the saturation of step 2 and the measured y.

For every trial half width delta the inverse of the dead zone turns y into w where y has left zero; G's
residues are solved for on it, and the whole cascade is simulated. The delta with the smallest output error
is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure, intermediate_signal
from bayes_hw.identify.cascade_fit import CascadeFit, evaluated, solve_linear_part
from bayes_hw.identify.experiment import OUTSIDE_NOISE, Experiment

TRIALS = 16
LARGEST_SHARE = 1.5
"""Largest half width tried, in units of the largest |y|."""


@dataclass(frozen=True, eq=False)
class OutputNonlinearity:
    """`intermediate` and `output` (measured samples,) are w simulated and y measured; `fit` is the cascade at
    the best of the half widths tried."""

    intermediate: FloatArray
    output: FloatArray
    fit: CascadeFit


def estimate_output_nonlinearity(
    experiment: Experiment, structure: Structure, values: CascadeValues
) -> OutputNonlinearity:
    """Fit delta with the limits of `values` and the denominators of G held.

    `structure` has its saturation but no dead zone.
    """
    largest = max(float(np.abs(y).max()) for y in experiment.outputs)
    smallest = min(experiment.noise_level, 0.1 * largest)
    trials = np.concatenate([[0.0], np.geomspace(smallest, LARGEST_SHARE * largest, TRIALS)])
    fits = [at_half_width(experiment, structure, values, float(trial)) for trial in trials]
    best = min(fits, key=lambda fit: fit.rms)
    signals = intermediate_signal(best.structure, best.values, experiment.records)
    known = np.concatenate([record.measured_samples for record in experiment.records])
    outputs = np.concatenate(experiment.outputs)
    return OutputNonlinearity(np.concatenate(signals)[known], outputs[known], best)


def at_half_width(
    experiment: Experiment, structure: Structure, values: CascadeValues, half_width: float
) -> CascadeFit:
    """The cascade with residues (and initial states) solved for at a given half width, not descended
    further."""
    structure = replace(structure, dead_zone=half_width > 0)
    values = replace(values, half_width=half_width)
    commands = [np.clip(u, values.lower, values.upper) for u in experiment.commands]
    solved, _ = solve_linear_part(
        structure,
        values,
        commands,
        inverse_dead_zone(experiment.outputs, half_width),
        _outside(experiment, half_width),
        differenced=False,
    )
    candidates = [solved] if structure.free_start else [solved, values]
    return min(
        (evaluated(structure, item, experiment.records) for item in candidates),
        key=lambda fit: fit.sum_of_squares,
    )


def inverse_dead_zone(outputs: Sequence[FloatArray], half_width: float) -> list[FloatArray]:
    """y + half_width sign(y): w wherever y is not zero."""
    return [y + half_width * np.sign(y) for y in outputs]


def _outside(experiment: Experiment, half_width: float) -> list[FloatArray]:
    """Samples at which the sign of y tells the side of the dead zone; all of them where there is none."""
    everywhere = [record.measured_samples.astype(float) for record in experiment.records]
    if half_width == 0:
        return everywhere
    threshold = OUTSIDE_NOISE * experiment.noise_level
    masks = [m * (np.abs(y) > threshold) for m, y in zip(everywhere, experiment.outputs, strict=True)]
    return masks if sum(m.sum() for m in masks) > 0 else everywhere
