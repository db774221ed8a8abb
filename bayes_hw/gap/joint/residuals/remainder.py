"""What the final fit of the joint search leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.command_trace import command_nats
from bayes_hw.gap.joint.residuals.noise_screen import first_order_noise
from bayes_hw.gap.joint.residuals.own_disturbances import refuting_nats

COLOURED_NATS = 40.0
"""By which an autoregression of higher order must beat one of the first for the noise to count as a cause."""

LONGEST_MEMORY, LONGEST_MEMORY_S = 0.95, 1.0
"""Of the readings' own noise of the first order, the longer of: its correlation from sample to sample, and
the seconds after which it has fallen by e. What lasts longer moved the axis, or the reading."""

LONGEST_LAG = 200


@dataclass(frozen=True)
class Remainder:
    """What the final fit leaves: order of its noise, by how many nats that explains it better than noise of
    the first order; where its noise has a cause, nats of what it knows of the command, which no such cause
    does, and those by which the disturbances that it says there were refute it."""

    order: int
    coloured: float
    commanded: float = 0.0
    refuted: float = 0.0

    @property
    def share_of_a_cause(self) -> float:
        """How nearly noise of order above one counts as a cause, from 0 to 1: an order that few nats speak
        for may be chance."""
        return float(np.clip(self.coloured / COLOURED_NATS, 0.0, 1.0)) if self.order > 1 else 0.0


def remainder_of(fit: JointFit) -> Remainder:
    """Of a fit's weighted residuals."""
    commanded = 0.0 if fit.response.cause is None else command_nats(fit)
    return Remainder(fit.noise_order, coloured_nats(fit), commanded, refuting_nats(fit))


def coloured_nats(fit: JointFit) -> float:
    """By which noise of the fit's order is likelier than noise of the first that readings may have of their
    own, less half a logarithm of the samples for every number more; zero for noise of a cause."""
    point = fit.point
    if fit.response.cause is not None or fit.noise_order == 0:
        return 0.0
    longest = max(LONGEST_MEMORY, float(np.exp(-1 / (LONGEST_MEMORY_S * fit.response.scale.rate_hz))))
    own = replace(
        first_order_noise(point.residuals, longest), degrees_of_freedom=point.whitener.degrees_of_freedom
    )
    gained = point.whitener.log_likelihood(point.residuals, point.masks)
    gained -= own.log_likelihood(point.residuals, point.masks)
    return gained - 0.5 * (fit.noise_order - 1) * float(np.log(point.samples))


def leaves_a_cause(fit: JointFit) -> bool:
    """Whether its noise counts as a cause without a name."""
    return coloured_nats(fit) > COLOURED_NATS


def samples_of_variance(residuals: Sequence[FloatArray]) -> float:
    """Independent samples that would tell the residuals' variance as well: n / (1 + 2 sum of the squared
    autocorrelations) (Bartlett 1946), of those that are not NaN."""
    samples = sum(int(np.count_nonzero(~np.isnan(e))) for e in residuals)
    residuals = [np.nan_to_num(e) for e in residuals]
    power = sum(float(e @ e) for e in residuals)
    lags = min(LONGEST_LAG, min(len(e) for e in residuals) - 1)
    products = [sum(float(e[k:] @ e[:-k]) for e in residuals) for k in range(1, lags + 1)]
    squared = np.sum((np.array(products) / power) ** 2) - lags / samples if power > 0 else 0.0
    return float(samples / (1 + 2 * max(float(squared), 0.0)))
