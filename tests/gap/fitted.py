"""Hypotheses held against residuals made for the purpose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from drive_axis import (
    LOAD_TORQUE,
    RATE,
    SIGMA,
    TRAIN,
    W,
    coloured,
    command,
    drive_axis,
    held,
    hypothesis,
    white,
)

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import Fit, evaluated
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.model.blocks import DeadZone

AXIS = drive_axis()
SAMPLES = 1200


def base(samples: int = SAMPLES, records: int = 2) -> Hypothesis:
    """The axis without effects on `records` commands."""
    return hypothesis(AXIS, [command(samples, seed) for seed in range(records)])


def noise(correlation: float = 0.3, records: int = 2) -> list[FloatArray]:
    """First-order noise of the encoder, a record each."""
    return [coloured(SAMPLES, SIGMA, correlation, seed) for seed in range(records)]


def walking(step: float = 0.3 * SIGMA, correlation: float = 0.0) -> list[FloatArray]:
    """Noise of two records beside a random walk of `step` a sample."""
    steps = [np.cumsum(white(SAMPLES, step, 10 + i)) for i in range(2)]
    return [w + e for w, e in zip(steps, noise(correlation), strict=True)]


def outputs() -> list[FloatArray]:
    """What the axis answers at its own parameters."""
    found = base()
    return found.simulate(found.builder.axis.nominal)


def with_residuals(residuals: list[FloatArray], found: Hypothesis | None = None) -> Fit:
    """The axis at its own parameters, its records off by `residuals`."""
    found = found or base(len(residuals[0]), len(residuals))
    simulated = found.simulate(found.builder.axis.nominal)
    measured = [s + e for s, e in zip(simulated, residuals, strict=True)]
    return of_records(measured, found)


def of_records(measured: list[FloatArray], found: Hypothesis) -> Fit:
    """The axis at its own parameters held against `measured`."""
    start = found.to_coordinates(found.builder.axis.nominal)
    return evaluated(found, measured, start, Plain(SIGMA))


def explained(residuals: list[FloatArray]) -> Explanation:
    """The same with first-order noise fitted to the residuals."""
    fit = with_residuals(residuals)
    coloured = replace(fit, whitener=autoregression(fit))
    return Explanation(coloured, None, coloured.log_evidence())


def noisy(clean: Sequence[FloatArray]) -> list[FloatArray]:
    """Records (samples,) with white noise, each its own."""
    return [y + white(len(y), SIGMA, 7 + i) for i, y in enumerate(clean)]


def simulated_with(effect: Effect, values: tuple[float, ...], inputs: list[FloatArray]) -> list[FloatArray]:
    """Noise-free outputs of the axis with an effect."""
    found = hypothesis(AXIS, inputs, effect)
    return found.simulate(np.concatenate([found.builder.axis.nominal, values]))


def gusts(corner: float, second: float, torque_sd: float, seed: int = 8) -> list[FloatArray]:
    """What a torque with two corners adds to w, integrated by the state space of the drive train."""
    h = 1 / RATE
    a, b, c = TRAIN.state_space()
    ad, bd = held(a, b[:, [LOAD_TORQUE]], h)
    rng, found = np.random.default_rng(seed), []
    phi, smooth = np.exp(-2 * np.pi * corner * h), np.exp(-2 * np.pi * second * h)
    for _ in range(2):
        x, torque, felt = np.zeros(7), rng.normal(0, torque_sd), 0.0
        added = np.empty(SAMPLES)
        for k in range(SAMPLES):
            added[k] = c[W] @ x
            x = ad @ x + bd[:, 0] * felt
            torque = phi * torque + np.sqrt(1 - phi**2) * rng.normal(0, torque_sd)
            felt = smooth * felt + (1 - smooth) * torque
        found.append(added)
    return found


def shown(
    added: list[FloatArray], show: DeadZone = AXIS.dead_zone, motion: list[FloatArray] | None = None
) -> list[FloatArray]:
    """What shows behind a dead zone of what is added to w, that of the axis if `motion` is not given."""
    if motion is None:
        found = base()
        motion = [w for w, _ in found.simulate_signals(found.builder.axis.nominal)]
    return [show(w + g) - show(w) for w, g in zip(motion, added, strict=True)]
