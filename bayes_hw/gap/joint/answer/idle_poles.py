"""Real poles of G that only a known input needs, taken out of G.

A torque reaches the angle by poles that it shares with G while both are sought. An integrator that it passes
stands there as a real pole beside G's own, of which no record tells the command's share: a ridge that no
sampler crosses. In the model each has poles of its own, so that G keeps those that the command asks for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.identify.output_error import OutputErrorFit, fit_output_error
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import INTEGRATOR_RADIUS
from bayes_hw.model.modal import ResidueBatch, linear_batch
from bayes_hw.record import Record

NUMBERS = 2
"""That a real pole has: where it stands, and its weight."""


def without_idle_poles(
    model: HammersteinWiener, records: Sequence[Record], noise: NoiseEstimate
) -> HammersteinWiener:
    """`model` without the real poles that are not worth their numbers by Schwarz's criterion, the rest
    estimated again; as it is where all are."""
    scale = max(float(np.max(np.abs(record.y - record.y[0]))) for record in records)

    def fitted(axis: AxisParameters) -> OutputErrorFit:
        return fit_output_error(
            axis,
            records,
            axis.nominal,
            autoregression=noise.autoregression,
            sigma=noise.innovation_sigma,
            prior=True,
        )

    axis = AxisParameters(model, "all", output_scale=scale)
    fit = fitted(axis)
    price = NUMBERS * np.log(fit.samples)
    while True:
        trials = [
            (other, fitted(other))
            for other in (
                AxisParameters(one, "all", output_scale=scale) for one in _smaller(axis.to_model(fit.values))
            )
        ]
        best = min(trials, key=lambda trial: trial[1].sum_of_squares, default=None)
        if best is None or best[1].sum_of_squares > fit.sum_of_squares + price:
            return model if axis.model is model else axis.to_model(fit.values)
        axis, fit = best


def _smaller(model: HammersteinWiener) -> Iterator[HammersteinWiener]:
    """The model without one real pole; the integrator takes over what that does of it."""
    linear = model.linear
    batch = linear_batch(linear, 1)
    real, pairs, direct = batch.residues()
    poles: FloatArray = batch.real_poles
    integrator = int(np.argmin(np.abs(poles[:, 0] - 1))) if len(poles) else -1
    if integrator < 0 or abs(poles[integrator, 0] - 1) > INTEGRATOR_RADIUS:
        return
    for i in range(len(poles)):
        if i == integrator:
            continue
        residues = real.copy()
        residues[integrator] += real[i]
        kept = ResidueBatch(
            np.delete(poles, i, axis=0), batch.pair_poles, np.delete(residues, i, axis=0), pairs, direct
        )
        upper = batch.pair_poles[:, 0]
        everywhere = np.concatenate([kept.real_poles[:, 0], upper, upper.conj()])
        yield replace(model, linear=kept.block(everywhere, linear.delay_samples))
