"""What columns promise at a fit, by score tests under one noise, all present coordinates projected off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import whitened_blocks
from bayes_hw.identify.growth.score_test import outside_of_derivatives
from bayes_hw.identify.holes import mask_of
from bayes_hw.identify.noise import estimate_noise

SINGULAR = 1e-9


@dataclass(frozen=True, eq=False)
class NoiseScreen:
    """Residual and present derivatives of a fit under one noise, of as many `samples` as were measured."""

    whitener: Whitener
    basis: FloatArray
    residual: FloatArray
    masks: Sequence[BoolArray] | None
    samples: int

    @classmethod
    def of(cls, fit: JointFit, whitener: Whitener) -> NoiseScreen:
        blocks = list(whitened_blocks(fit.response, fit.point.coordinates, whitener))
        outside = outside_of_derivatives(np.concatenate(blocks, axis=1))
        return cls(whitener, *outside, fit.response.masks, fit.point.samples)

    def gain(self, tangents: Sequence[FloatArray]) -> float:
        """Nats that the columns (parameters, samples) of all records promise together."""
        return float(self.gains([t[None] for t in tangents])[0])

    def gains(self, tangents: Sequence[FloatArray]) -> FloatArray:
        """Nats (groups,) that groups of columns (groups, parameters, samples) of all records promise, those
        of a group together."""
        groups, width = tangents[0].shape[:2]
        white = [
            self.whitener.apply(t.reshape(groups * width, -1), 0, mask_of(self.masks, i))
            for i, t in enumerate(tangents)
        ]
        columns = np.concatenate(white, axis=1)
        powers = np.einsum("ij,ij->i", columns, columns)
        counted = (powers > 0) & np.isfinite(powers)
        columns[~counted] = 0.0
        scale = np.sqrt(np.where(counted, powers, 1.0)).reshape(groups, width)
        inside = (columns @ self.basis).reshape(groups, width, -1)
        products = (columns @ self.residual).reshape(groups, width) / scale
        columns = columns.reshape(groups, width, -1)
        gram = columns @ columns.transpose(0, 2, 1) - inside @ inside.transpose(0, 2, 1)
        gram = gram / (scale[:, :, None] * scale[:, None, :]) + SINGULAR * np.eye(width)
        gram += (~counted.reshape(groups, width))[:, :, None] * np.eye(width)
        explained = np.einsum("gi,gi->g", products, np.linalg.solve(gram, products[:, :, None])[:, :, 0])
        share = np.clip(explained / float(self.residual @ self.residual), 0.0, 1 - 1e-12)
        price = 0.5 * np.count_nonzero(counted.reshape(groups, width), axis=1) * np.log(self.samples)
        whole = np.isfinite(powers).reshape(groups, width).all(axis=1)
        return np.where(whole, -0.5 * self.samples * np.log1p(-share) - price, 0.0)


def first_order_noise(residuals: Sequence[FloatArray], longest: float = 0.99999) -> Whitener:
    """Autoregression of order one, correlated from sample to sample by no more than `longest`."""
    return Whitener.of_partial(np.clip(estimate_noise(residuals, 1).partial, -longest, longest))


def noise_screens(fit: JointFit) -> list[NoiseScreen]:
    """Under the noise as fitted and, where that is of a higher order, under one of the first."""
    whiteners = [fit.point.whitener]
    if fit.noise_order > 1:
        whiteners.append(first_order_noise(fit.point.residuals))
    return each(lambda whitener: NoiseScreen.of(fit, whitener), whiteners)
