"""Limits, or the gain of the command, that change at some instant of every record and stay so.

A drive that gets hot lowers its limits, a supply sags. What that leaves is slow and follows no angle, and
noise that moves the axis is close to it; but wind knows nothing of what is commanded.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.noise_screen import NoiseScreen
from bayes_hw.gap.joint.response.effect_paths import limited_and_gain, through_drive

INSTANTS = tuple(np.arange(0.05, 0.951, 0.05))
"""Shares of a record at which something may change."""


def change_nats(fit: JointFit) -> float:
    """Nats that a change of the limits, or one of the gain, whichever promises more, at its own instant of
    every record promises under the fit's noise, less the price of the instants that were tried."""
    screen = NoiseScreen.of(fit, fit.point.whitener)
    found = [0.0, 0.0]
    for number, record in enumerate(fit.response.records):
        begun = [int(share * len(record)) for share in INSTANTS]
        for kind, response in enumerate(_responses(fit, number, begun)):
            promised = []
            for row in response:
                tangents = [np.zeros((1, len(r))) for r in fit.response.records]
                tangents[number] = row[None]
                promised.append(screen.gain(tangents))
            found[kind] += max(max(promised) - float(np.log(len(INSTANTS))), 0.0)
    return max(found)


def _responses(fit: JointFit, number: int, begun: list[int]) -> list[FloatArray]:
    """Of one record the weighted output's derivatives (instants, samples) by the logarithm of both limits and
    by that of the command's gain, from every instant on."""
    values, scale, record = fit.values, fit.response.scale, fit.response.records[number]
    run = fit.response.along(values, number)
    late = fit.structure.delay_samples
    asked = np.concatenate([np.zeros(late), record.u[: len(record) - late]])
    limited, gain = limited_and_gain(values, scale, asked, run.w)
    later = np.arange(len(record)) >= np.array(begun)[:, None]
    weights = fit.response.weights
    slope = run.slope if weights is None else run.slope / weights[number]
    return [
        through_drive(fit.structure, values, later * row) * slope
        for row in (np.where(limited != asked, limited, 0.0) * gain, run.v)
    ]
