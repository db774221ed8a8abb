"""Linear responses of w to small signals at the doors of an axis, by convolution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from bayes_hw.arrays import FloatArray

if TYPE_CHECKING:
    from bayes_hw.gap.chain import Chain
    from bayes_hw.gap.effects.effect import Door


def impulse_response(chain: Chain, door: Door, samples: int) -> FloatArray:
    """Response (samples,) of w to one sample of unit signal, held over the sample, at `door`."""
    response = np.zeros(samples)
    if door == "output":
        response[0] = 1.0
        return response
    if door == "command":
        real, real_out, pairs, pair_out = chain.command_path
        poles, gains = (
            np.concatenate([real.astype(np.complex128), pairs]),
            np.concatenate([real_out[0], pair_out[0]]),
        )
        weights = np.concatenate([np.ones(len(real)), np.full(len(pairs), 2.0)])
    else:
        real, real_in, real_out, pairs, pair_in, pair_out = chain.torque_path
        poles = np.concatenate([real.astype(np.complex128), pairs])
        gains = np.concatenate([real_in[0] * real_out[0], pair_in[0] * pair_out[0]])
        weights = np.concatenate([np.ones(len(real)), np.full(len(pairs), 2.0)])
    h = 1 / chain.rate
    safe = np.where(poles == 0, 1, poles)
    hold = np.where(poles == 0, h, (np.exp(poles * h) - 1) / safe)
    steps = np.arange(samples - 1) * h
    response[1:] = np.real((weights * gains * hold) @ np.exp(poles[:, None] * steps))
    return response


def convolve(response: FloatArray, signals: FloatArray) -> FloatArray:
    """`signals` (samples, n) through an impulse response (samples,)."""
    samples = len(response)
    length = next_fast_len(2 * samples, real=True)
    spectrum = rfft(response, length)[:, None] * rfft(signals, length, axis=0)
    return np.asarray(irfft(spectrum, length, axis=0)[:samples])
