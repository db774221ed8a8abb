"""The error sources of section 3.3 of the paper, as changes of the twin, of its encoder or of its model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from backlash import Backlash
from scipy import signal
from scipy.interpolate import CubicSpline

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bayes_hw.identify.output_error import fit_output_error
from bayes_hw.infer.inference import axis_for
from bayes_hw.model.blocks import DeadZone
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Record

REFERENCE_NOISE = 0.1
"""Noise of the reference, and beside every other source, as a share of the twin's."""

ENCODER_STEP_DEG = 360 / 2**16
LATE_S = 0.010
JITTER_S = 0.005
SLOPE_RATIO = 1.05
SHARPNESS = 12.0
UPSAMPLING = 20
SLOW = 0.99
"""Where the slow poles beside the integrator, and the zeros that nearly cancel them, lie in z."""

Truth = Callable[[HammersteinWiener, FloatArray], FloatArray]
Reading = Callable[[FloatArray, float, np.random.Generator], FloatArray]
Fitted = Callable[[HammersteinWiener, Sequence[Record]], HammersteinWiener]


def as_modelled(axis: HammersteinWiener, u: FloatArray) -> FloatArray:
    """The output of the axis that the model describes."""
    return axis.simulate(u).y


def with_play(axis: HammersteinWiener, u: FloatArray) -> FloatArray:
    """Backlash with memory (eq. 3) where the model has a static dead zone (eq. 5) of the same width."""
    return Backlash.play(axis.dead_zone.half_width)(axis.simulate(u).w)


def with_unequal_slopes(axis: HammersteinWiener, u: FloatArray) -> FloatArray:
    """c3 larger than c2 by SLOPE_RATIO."""
    return DeadZone(axis.dead_zone.half_width, 1.0, SLOPE_RATIO)(axis.simulate(u).w)


def with_rounded_limits(axis: HammersteinWiener, u: FloatArray) -> FloatArray:
    """Limits that set in gradually: f(u) = u / (1 + |u / limit|^p)^(1/p) with p = SHARPNESS."""
    limit = np.where(u > 0, axis.saturation.upper, axis.saturation.lower)
    return axis.simulate(u / (1 + np.abs(u / limit) ** SHARPNESS) ** (1 / SHARPNESS)).y


def exactly(y: FloatArray, _rate: float, _rng: np.random.Generator) -> FloatArray:
    """An encoder without error of its own."""
    return y


def between_samples(y: FloatArray, rate: float, shift_s: FloatArray) -> FloatArray:
    """The band-limited continuation of y (samples,), read `shift_s` later than its time stamps."""
    dense = signal.resample_poly(y, UPSAMPLING, 1, padtype="line")
    times = np.arange(len(y)) / rate
    return np.asarray(CubicSpline(np.arange(len(dense)) / (UPSAMPLING * rate), dense)(times + shift_s))


def rounded(y: FloatArray, _rate: float, _rng: np.random.Generator) -> FloatArray:
    """Every sample at the nearest step of the encoder."""
    return np.asarray(ENCODER_STEP_DEG * np.round(y / ENCODER_STEP_DEG))


def read_late(y: FloatArray, rate: float, _rng: np.random.Generator) -> FloatArray:
    """Every sample read LATE_S after the command is given out."""
    return between_samples(y, rate, np.full(len(y), LATE_S))


def read_unevenly(y: FloatArray, rate: float, rng: np.random.Generator) -> FloatArray:
    """Samples read with a jitter of standard deviation JITTER_S."""
    return between_samples(y, rate, JITTER_S * rng.standard_normal(len(y)))


def true_order(axis: HammersteinWiener, _records: Sequence[Record]) -> HammersteinWiener:
    """The model of the true order; its roots other than the modes are the true ones."""
    return axis


def without_poles(
    axis: HammersteinWiener, records: Sequence[Record], poles: IntArray, zeros: IntArray
) -> HammersteinWiener:
    """The model without some poles and the zeros beside them, all that is left of G fitted to the records."""
    kept_poles = np.delete(axis.linear.poles, poles)
    kept_zeros = np.delete(axis.linear.zeros, zeros)
    leading = np.real(np.prod(1 - axis.linear.zeros[zeros]) / np.prod(1 - axis.linear.poles[poles]))
    linear = LinearBlock(kept_zeros, kept_poles, axis.linear.gain * float(leading), axis.linear.delay_samples)
    modes = tuple(
        mode
        for mode in axis.dominant_modes
        if np.min(np.abs(kept_poles - mode.pole(axis.sample_rate_hz))) < 1e-9
    )
    smaller = replace(axis, linear=linear, dominant_modes=modes)
    everything = axis_for(smaller, records, "all", "rest")
    return everything.to_model(fit_output_error(everything, records, everything.nominal).values)


def without_slow_pair(axis: HammersteinWiener, records: Sequence[Record]) -> HammersteinWiener:
    """The two slow poles beside the integrator and the zeros that nearly cancel them are left out."""
    poles, zeros = axis.linear.poles, axis.linear.zeros
    slow = np.flatnonzero((np.abs(poles - SLOW) < 0.005) & (poles.imag == 0))
    return without_poles(axis, records, slow, np.flatnonzero(np.abs(zeros - SLOW) < 0.02))


def with_one_mode(axis: HammersteinWiener, records: Sequence[Record]) -> HammersteinWiener:
    """The second mode is left out, and the pair of zeros nearest to it."""
    second = axis.dominant_modes[1].pole(axis.sample_rate_hz)
    poles, zeros = axis.linear.poles, axis.linear.zeros
    nearest = zeros[np.argmin(np.abs(zeros - second))]
    return without_poles(
        axis, records, np.flatnonzero(_is_pair(poles, second)), np.flatnonzero(_is_pair(zeros, nearest))
    )


def _is_pair(roots: ComplexArray, root: complex) -> BoolArray:
    return np.asarray(np.minimum(np.abs(roots - root), np.abs(roots - np.conj(root))) < 1e-9)


@dataclass(frozen=True)
class Source:
    """One error source: how strong, and where it enters."""

    name: str
    family: str
    strength: str
    noise_share: float = REFERENCE_NOISE
    truth: Truth = as_modelled
    reading: Reading = exactly
    fitted: Fitted = true_order


SOURCES = (
    Source("noise", "noise", "AR(1), 5.4 % of the output's spread", noise_share=1.0),
    Source("quantization", "quantization", "encoder of 16 bits a turn (0.0055 deg)", reading=rounded),
    Source("late reading", "sampling", f"angle read {1000 * LATE_S:g} ms late", reading=read_late),
    Source("uneven reading", "sampling", f"jitter of {1000 * JITTER_S:g} ms", reading=read_unevenly),
    Source(
        "slow pair lost",
        "order",
        "order 7 of 9: slow poles and their zeros left out",
        fitted=without_slow_pair,
    ),
    Source("one mode lost", "order", "order 7 of 9: second mode left out", fitted=with_one_mode),
    Source("play for a dead zone", "structure", "backlash with memory, same width", truth=with_play),
    Source("unequal slopes", "structure", f"c₃ / c₂ = {SLOPE_RATIO:g}", truth=with_unequal_slopes),
    Source(
        "rounded limits",
        "structure",
        f"limits set in gradually, p = {SHARPNESS:g}",
        truth=with_rounded_limits,
    ),
)
REFERENCE = Source("reference", "reference", "a tenth of the noise, nothing else")
