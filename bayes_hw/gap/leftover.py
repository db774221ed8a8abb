"""What an explanation leaves unexplained: the ground of the verdict "none of these".

Encoder noise is taken to be first-order and Gaussian. Beside the best explanation, four descriptions that
name no cause are tried on its residuals: a line (a sine of constant frequency in time), a step (a change
point), a spectrum that first-order noise does not have, and a free function of command, position and
velocity. Each gives the share of the residual's variance that it takes and the gain in log-likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.explanation import Explanation
from bayes_hw.gap.glitches import find_glitches
from bayes_hw.gap.whitener import bridge, fit_autoregression, no_glitches

FLEXIBLE_ORDER = 16
STEP_MARGIN = 10
LARGEST_USUAL_CHANGE = 14.0
"""Half the square of the largest change, in robust standard deviations, that wandering noise reaches."""

FUNCTION_CENTRES = 7


@dataclass(frozen=True)
class Leftover:
    """One description: what it is, gain in log-likelihood beyond its parameters' cost, its size in sigma."""

    kind: str
    gain: float
    size: float


def leftovers(explanation: Explanation, inputs: Sequence[FloatArray]) -> list[Leftover]:
    """Descriptions of what is left, largest gain first."""
    residuals = _bridged(explanation)
    white = [explanation.fit.whitener.whiten(e[:, None], r)[:, 0] for r, e in enumerate(residuals)]
    sigma = float(np.sqrt(np.mean(np.concatenate(residuals) ** 2)))
    found = [_line(residuals, white), _step(residuals)]
    if "encoder_quantization" not in explanation.labels:
        found += [_spectrum(residuals, white), _function(explanation, white, inputs)]
    return sorted(
        (Leftover(kind, gain, np.sqrt(max(size, 0.0)) / max(sigma, 1e-300)) for kind, gain, size in found),
        key=lambda left: -left.gain,
    )


def _bridged(explanation: Explanation) -> list[FloatArray]:
    """Residuals with the glitches that the explanation knows of bridged, and the display applied."""
    fit, stochastic = explanation.fit, explanation.stochastic
    residuals = fit.residuals
    if stochastic is not None and stochastic.display is not None:
        residuals = [
            y - stochastic.display.show(s, r)
            for r, (y, s) in enumerate(zip(fit.measured, fit.simulated, strict=True))
        ]
    if stochastic is not None and stochastic.label == "outliers":
        masks = find_glitches(residuals)
        residuals = [bridge(e[:, None], m)[:, 0] for e, m in zip(residuals, masks, strict=True)]
    return list(residuals)


def _line(residuals: Sequence[FloatArray], white: Sequence[FloatArray]) -> tuple[str, float, float]:
    """The strongest sine in every record, each with its own phase, the frequency common."""
    length = 4 * max(len(w) for w in white)
    power = np.sum([np.abs(np.fft.rfft(w, length)) ** 2 / len(w) for w in white], axis=0)
    lowest = 12
    peak = lowest + int(np.argmax(power[lowest:]))
    gain = float(power[peak]) - np.log(len(power))
    omega = 2 * np.pi * peak / length
    taken = 0.0
    for e in residuals:
        columns = np.stack([np.cos(omega * np.arange(len(e))), np.sin(omega * np.arange(len(e)))], axis=1)
        taken += float(np.sum((columns @ np.linalg.lstsq(columns, e, rcond=None)[0]) ** 2))
    penalty = (2 * len(white) + 1) * 0.5 * np.log(sum(len(w) for w in white))
    return "line in time", gain - penalty, taken / sum(len(e) for e in residuals)


def _spectrum(residuals: Sequence[FloatArray], white: Sequence[FloatArray]) -> tuple[str, float, float]:
    """A spectrum of many poles against that of the explanation."""
    none = no_glitches(residuals)
    again = fit_autoregression(white, none, FLEXIBLE_ORDER)
    ratio = again.innovation_sigma / max(again.sigma, 1e-300)
    samples = sum(len(e) for e in residuals)
    gain = -samples * np.log(max(ratio, 1e-12)) - 0.5 * FLEXIBLE_ORDER * np.log(samples)
    mean_square = float(np.mean(np.concatenate(residuals) ** 2))
    return "spectrum", float(gain), mean_square * (1 - ratio**2)


def _step(residuals: Sequence[FloatArray]) -> tuple[str, float, float]:
    """One sudden, lasting step a record: the largest change of the local mean against its usual changes.

    Noise that wanders has many changes of like size; a step is one far larger than all the rest.
    """
    gain, taken, samples = 0.0, 0.0, sum(len(e) for e in residuals)
    for e in residuals:
        sums = np.concatenate([[0.0], np.cumsum(e)])
        middle = np.arange(STEP_MARGIN, len(e) - STEP_MARGIN)
        change = (sums[middle + STEP_MARGIN] - 2 * sums[middle] + sums[middle - STEP_MARGIN]) / STEP_MARGIN
        usual = 1.4826 * float(np.median(np.abs(change - np.median(change))))
        at = int(np.argmax(np.abs(change)))
        gain += max(0.0, 0.5 * (change[at] / max(usual, 1e-300)) ** 2 - LARGEST_USUAL_CHANGE)
        share = (at + STEP_MARGIN) / len(e)
        taken += len(e) * share * (1 - share) * float(change[at]) ** 2
    return "step", gain, taken / samples


def _function(
    explanation: Explanation, white: Sequence[FloatArray], inputs: Sequence[FloatArray]
) -> tuple[str, float, float]:
    """A sum of bumps over command, position and speed, and the signs of speed and command."""
    fit = explanation.fit
    scale = fit.hypothesis.scale
    columns = []
    for u, y in zip(inputs, fit.simulated, strict=True):
        speed = np.gradient(y) * scale.rate
        bumps = []
        for signal in (u, y, speed):
            low, high = np.quantile(signal, [0.02, 0.98])
            width = max((high - low) / (FUNCTION_CENTRES - 1), 1e-300)
            centres = np.linspace(low, high, FUNCTION_CENTRES)
            bumps.append(np.exp(-0.5 * ((signal[:, None] - centres) / width) ** 2))
        bumps.append(np.stack([np.sign(speed), np.sign(u), np.abs(speed), speed * np.abs(speed)], axis=1))
        columns.append(np.concatenate(bumps, axis=1))
    whitened = np.concatenate([fit.whitener.whiten(c, r) for r, c in enumerate(columns)])
    tangents, _ = np.linalg.qr(
        np.concatenate([fit.whitener.whiten(j, r) for r, j in enumerate(fit.jacobians)])
    )
    stacked = np.concatenate(list(white))
    basis = whitened - tangents @ (tangents.T @ whitened)
    scales = np.linalg.norm(basis, axis=0)
    left, values, _ = np.linalg.svd(basis / np.maximum(scales, 1e-300), full_matrices=False)
    left = left[:, values > 1e-6 * values[0]]
    gain = 0.5 * float(np.sum((left.T @ stacked) ** 2))
    penalty = 0.5 * left.shape[1] * np.log(len(stacked))
    mean_square = float(np.mean(np.concatenate(fit.residuals) ** 2))
    return "function of command and motion", gain - penalty, mean_square * 2 * gain / len(stacked)
