"""Real poles whose place the records hardly tell.

A slow pole may stand in a model for want of evidence against it, its weight hardly told from none. Where the
weight is nothing its time constant is anything: the posterior is a funnel that no ensemble crosses in
reasonable time, while in the linearised response the time constant plays no part. Such a pole stays where the
estimate has it, as a fixed function of the command whose weight is free, so that what it could take from the
dead zone or the gain still widens their intervals. Of two poles that all but coincide one stays likewise: its
weight is to first order the other's move. And of several poles that have decayed within a few samples the one
that does so within a sample stays: together their weights are the first samples of the response.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.holes import with_holes
from bayes_hw.identify.noise import estimate_noise
from bayes_hw.identify.output_error import DIFFERENCE_STEP, prior_scale, simulated_outputs, whitened
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

LEAST_SHARE = 0.8
"""Of the prior's precision and the records' together, all else free: a pole with less of it from the records
stays where it is."""


AT_ONCE, SOON = float(np.exp(-1.0)), float(np.exp(-1 / 3))
"""Modulus of a pole that has decayed within one sample, and within three."""


def without_unseen_poles(
    axis: AxisParameters, records: Sequence[Record], times: float = 1.0
) -> AxisParameters:
    """`axis` with the real poles held whose place `records` hardly tell, one after the other; there are
    `times` as many samples as in `records`."""
    places = {
        name.removesuffix(".value"): abs(value)
        for name, value in zip(axis.names, axis.nominal, strict=True)
        if name.startswith("real_pole") and name.endswith(".value")
    }
    if sum(place < SOON for place in places.values()) > 1:
        fast = [name for name, place in places.items() if place < AT_ONCE]
        axis = _holding(axis, fast)
    while True:
        shares = {
            name: share
            for name, share in zip(axis.names, shares_of_records(axis, records, times), strict=True)
            if name.startswith("real_pole") and name.endswith(".value")
        }
        least = min(shares, key=lambda name: shares[name], default=None)
        if least is None or shares[least] >= LEAST_SHARE:
            return axis
        axis = _holding(axis, [least.removesuffix(".value")])


def _holding(axis: AxisParameters, names: Sequence[str]) -> AxisParameters:
    """`axis` with these real poles held too."""
    return AxisParameters(
        axis.model,
        axis.free,
        output_scale=axis.output_scale,
        start_positions=axis.start_positions,
        held_poles=(*axis.held_poles, *names),
    )


def shares_of_records(axis: AxisParameters, records: Sequence[Record], times: float = 1.0) -> FloatArray:
    """1 - (posterior sd / prior sd)^2 of every parameter (parameters,) in coordinates, linearised at the
    nominal values, with the noise of the residuals there; of `times` as many samples."""
    centre = as_coordinates(axis.parameters, axis.nominal)[:, None]
    steps = DIFFERENCE_STEP * np.eye(len(centre))
    trials = np.concatenate([centre, centre + steps, centre - steps], axis=1)
    outputs = simulated_outputs(axis, as_values(axis.parameters, trials), records)
    noise = estimate_noise(
        [with_holes(r.y - output[0], r.measured) for r, output in zip(records, outputs, strict=True)]
    )
    _, prior_sd = prior_scale(axis)
    information = np.eye(len(centre))
    for record, output in zip(records, outputs, strict=True):
        slopes = (output[1 : len(centre) + 1] - output[len(centre) + 1 :]) / (2 * DIFFERENCE_STEP)
        rows = whitened(slopes, noise.autoregression, record.measured)
        rows *= prior_sd[:, None] / noise.innovation_sigma
        information += times * (rows @ rows.T)
    return np.asarray(1 - np.diag(np.linalg.inv(information)))
