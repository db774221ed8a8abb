"""Residual diagnostics: what an explanation leaves unexplained, the ground of the verdict "none of these".

Encoder noise is taken to be first-order and Gaussian. Under a right explanation the whitened residuals are
then white, of unit variance, and independent of command, motion and time. Descriptions that name no cause
are held against that: a free function at every block, a spread that changes with the motion, heavy tails, a
sine of constant frequency in time, a lasting step, a spectrum that first-order noise does not have, more
noise than is stated, and where slow noise is part of the explanation, what follows limits and reversals,
and noise that is stronger when the axis does certain things.
Each says how surprising the residuals are where the explanation holds (the negative natural logarithm of the
p-value) and how large what it describes is, in units of the encoder's noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import gamma, norm

from bayes_hw.arrays import BoolArray, FloatArray, robust_sigma
from bayes_hw.gap.criticism.block_functions import shapes_of_memories
from bayes_hw.gap.criticism.free_functions import (
    GAIN,
    Motion,
    directions,
    free_functions,
    free_functions_with_free_variance,
    linear_splines,
    motions,
    responses_of_blocks,
    shapes_that_only_tell,
)
from bayes_hw.gap.criticism.heteroscedasticity import regimes_of, steadiness, unevenness
from bayes_hw.gap.criticism.negative_log_p import chi_squared_negative_log_p
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.noise.glitches import find_glitches
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.noise.whitener import bridged_records, fit_autoregression, no_glitches

FLEXIBLE_ORDER = 16
STEP_MARGIN = 10
FEWEST_MEANS = 50
LARGEST_USUAL_CHANGE = 14.0
"""Half the square of the largest change, in robust standard deviations, that wandering noise reaches."""

FARTHEST_WHITE = 4.0
"""Standard deviations to which whitened residuals are clipped where their spread is compared."""

KURTOSIS_OF_BURSTS = 10.0
"""Excess kurtosis of a rare disturbance, by which the size of heavy tails is judged."""

LOWEST_LINE = 12
"""Of the padded periodogram: slower sines are drift."""

LARGEST_NEGATIVE_LOG_P = 1e4

STATED_LOG_SD = 0.13
"""How far a stated noise is off, in its logarithm."""

UNSTATED_NOISE = "noise above the stated"

LINE = "line in time"
GUSTS = "gusts"
"""The kind that says when slow noise is strongest begins with it."""

STEADY = "constant command"

STRUCTURE_NEGATIVE_LOG_P = 9.0
SMALLEST_STRUCTURE = 0.12
"""Minus log of a tail probability, and size in sigma, beyond which a search for causes goes on."""


@dataclass(frozen=True)
class ResidualDiagnostic:
    """One description: what it is, its `negative_log_p` value, its size in sigma."""

    kind: str
    negative_log_p: float
    size: float


def residual_diagnostics(
    explanation: Explanation, inputs: Sequence[FloatArray], stated_sigma: float = 0.0
) -> list[ResidualDiagnostic]:
    """Descriptions of what is left, most surprising first; where a noise is stated (`stated_sigma`, output
    units), what is above it too."""
    residuals = _bridged(explanation)
    white = [explanation.fit.whitener.whiten(e[:, None], r)[:, 0] for r, e in enumerate(residuals)]
    sigma = max(explanation.encoder_sigma, 1e-300)
    stochastic = explanation.stochastic
    rounded = stochastic is not None and ROUNDING in stochastic.labels
    fit = explanation.fit
    found = [_line(residuals, white)]
    if not rounded:
        found.append(_step(fit.whitener.evened(residuals), fit.whitener.hidden(residuals)))
    chain = fit.hypothesis.chain(fit.values)
    moved, rate = motions(fit, inputs), fit.hypothesis.scale.rate
    drifts = explanation.drifts
    more = shapes_that_only_tell(moved) | (shapes_of_memories(moved, rate) if drifts else {})
    shown = responses_of_blocks(moved, chain, more)
    slow = fit.whitener.with_states
    if drifts and slow is not None:
        functions = free_functions_with_free_variance(shown, residuals, fit, slow)
    else:
        functions = free_functions(shown, residuals, fit.jacobians, fit.whitener)
    found += [
        (_named(f.block), chi_squared_negative_log_p(2 * f.gain, f.shapes), f.size**2) for f in functions
    ]
    if explanation.display is None and not rounded:
        found += [_spectrum(residuals, white), _spread(moved, white, sigma)]
        if stochastic is None or not stochastic.isolates:
            found.append(_tails(white, sigma))
    if stated_sigma > 0 and explanation.display is None and not explanation.cannot_be_predicted:
        found.append(_unstated_noise(sigma, stated_sigma))
    if stochastic is not None and stochastic.size is not None and slow is not None:
        uneven = unevenness(slow, residuals, regimes_of(moved, rate))
        found.append(
            (f"{GUSTS} {uneven.regime}".strip(), uneven.negative_log_p, stochastic.size**2 * uneven.share)
        )
        if stochastic.cause.through_axis:
            found.append((STEADY, *steadiness(fit, moved)))
    return sorted(
        (
            ResidualDiagnostic(
                kind,
                float(np.clip(negative_log_p, 0.0, LARGEST_NEGATIVE_LOG_P)),
                float(np.sqrt(max(square, 0.0))) / sigma,
            )
            for kind, negative_log_p, square in found
        ),
        key=lambda left: -left.negative_log_p,
    )


def _unstated_noise(sigma: float, stated_sigma: float) -> tuple[str, float, float]:
    """Noise of the encoder above the stated one, which is known but roughly."""
    negative_log_p = -float(norm.logsf(np.log(sigma / stated_sigma) / STATED_LOG_SD))
    return UNSTATED_NOISE, negative_log_p, sigma**2 - stated_sigma**2


def leaves_structure(explanation: Explanation, inputs: Sequence[FloatArray]) -> bool:
    """Whether anything is left that a further effect could be the cause of."""
    return any(
        left.negative_log_p > STRUCTURE_NEGATIVE_LOG_P and left.size > SMALLEST_STRUCTURE
        for left in residual_diagnostics(explanation, inputs)
    )


def is_in_the_scatter(left: Sequence[ResidualDiagnostic]) -> bool:
    """Whether anything is left, and in the scatter of single samples more than in their mean."""
    if not left:
        return False
    most = max(left, key=lambda item: item.negative_log_p * item.size)
    return most.negative_log_p > STRUCTURE_NEGATIVE_LOG_P and most.kind in (
        "spread",
        "heavy tails",
        UNSTATED_NOISE,
    )


def _named(block: str) -> str:
    """The kind of a function: where it enters, or for memories what it follows."""
    if block == GAIN:
        return f"function of the {block}"
    return f"function {block}" if block.startswith("after") else f"function at {block}"


def _bridged(explanation: Explanation) -> list[FloatArray]:
    """Residuals with the glitches that the explanation knows of bridged, and the display applied."""
    fit, stochastic = explanation.fit, explanation.stochastic
    residuals = fit.residuals
    display = explanation.display
    if display is not None:
        residuals = [
            y - display.show(s, r) for r, (y, s) in enumerate(zip(fit.measured, fit.simulated, strict=True))
        ]
    if stochastic is not None and stochastic.isolates:
        residuals = bridged_records(residuals, find_glitches(residuals))
    return list(residuals)


def _line(residuals: Sequence[FloatArray], white: Sequence[FloatArray]) -> tuple[str, float, float]:
    """The strongest sine in every record, each with its own phase, the frequency common."""
    length = 4 * max(len(w) for w in white)
    power = np.sum([np.abs(np.fft.rfft(w, length)) ** 2 / max(float(w @ w), 1e-300) for w in white], axis=0)
    peak = LOWEST_LINE + int(np.argmax(power[LOWEST_LINE:]))
    negative_log_p = -float(gamma.logsf(power[peak], len(white))) - np.log(len(power))
    omega = 2 * np.pi * peak / length
    taken = 0.0
    for e in residuals:
        columns = np.stack([np.cos(omega * np.arange(len(e))), np.sin(omega * np.arange(len(e)))], axis=1)
        taken += float(np.sum((columns @ np.linalg.lstsq(columns, e, rcond=None)[0]) ** 2))
    return LINE, negative_log_p, taken / sum(len(e) for e in residuals)


def _spectrum(residuals: Sequence[FloatArray], white: Sequence[FloatArray]) -> tuple[str, float, float]:
    """A spectrum of many poles against that of the explanation."""
    again = fit_autoregression(white, no_glitches(residuals), FLEXIBLE_ORDER)
    ratio = again.innovation_sigma / max(again.sigma, 1e-300)
    samples = sum(len(e) for e in residuals)
    statistic = -2 * samples * np.log(max(ratio, 1e-12))
    mean_square = float(np.mean(np.concatenate(residuals) ** 2))
    return (
        "spectrum",
        chi_squared_negative_log_p(float(statistic), FLEXIBLE_ORDER),
        mean_square * (1 - ratio**2),
    )


def _step(residuals: Sequence[FloatArray], hidden: Sequence[BoolArray]) -> tuple[str, float, float]:
    """One sudden, lasting step a record: the largest change of the local mean against its usual changes.

    Noise that wanders has many changes of like size; a step is one far larger than all the rest. Means over
    samples that are `hidden` do not count.
    """
    negative_log_p, taken, samples = 0.0, 0.0, sum(len(e) for e in residuals)
    for e, gaps in zip(residuals, hidden, strict=True):
        sums, before = (np.concatenate([[0.0], np.cumsum(x)]) for x in (e, gaps))
        middle = np.arange(STEP_MARGIN, len(e) - STEP_MARGIN)
        middle = middle[before[middle + STEP_MARGIN] == before[middle - STEP_MARGIN]]
        if len(middle) < FEWEST_MEANS:
            continue
        change = (sums[middle + STEP_MARGIN] - 2 * sums[middle] + sums[middle - STEP_MARGIN]) / STEP_MARGIN
        usual = robust_sigma(change - np.median(change))
        at = int(np.argmax(np.abs(change)))
        negative_log_p += max(0.0, 0.5 * (change[at] / max(usual, 1e-300)) ** 2 - LARGEST_USUAL_CHANGE)
        share = float(middle[at]) / len(e)
        taken += len(e) * share * (1 - share) * float(change[at]) ** 2
    return "step", negative_log_p, taken / samples


def _spread(found: Sequence[Motion], white: Sequence[FloatArray], sigma: float) -> tuple[str, float, float]:
    """A variance of the whitened residuals that changes with command, speed and position."""
    every = np.concatenate(list(white))
    unit = every / max(float(np.sqrt(np.mean(every**2))), 1e-300)
    square = np.clip(unit, -FARTHEST_WHITE, FARTHEST_WHITE) ** 2
    square = square - square.mean()
    shapes = [linear_splines([getattr(m, name) for m in found]) for name in ("command", "speed", "w")]
    shapes.append([np.abs(np.gradient(m.command))[:, None] for m in found])
    columns = np.concatenate([np.concatenate(list(shape)) for shape in shapes], axis=1)
    columns = columns - columns.mean(axis=0)
    columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    amplitude, _, _ = directions(columns, square)
    statistic = float(amplitude @ amplitude) / max(float(np.var(square)), 1e-300)
    changing = float(
        np.sqrt(max(float(amplitude @ amplitude) - len(amplitude) * np.var(square), 0.0) / len(square))
    )
    return "spread", chi_squared_negative_log_p(statistic, len(amplitude)), changing * sigma**2


def _tails(white: Sequence[FloatArray], sigma: float) -> tuple[str, float, float]:
    """Kurtosis of the whitened residuals."""
    every = np.concatenate(list(white))
    excess = float(np.mean(every**4) / max(float(np.mean(every**2)), 1e-300) ** 2 - 3)
    share = np.sqrt(min(max(excess, 0.0) / KURTOSIS_OF_BURSTS, 1.0))
    return "heavy tails", 0.5 * max(excess, 0.0) ** 2 * len(every) / 24, share * sigma**2
