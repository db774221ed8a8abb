"""Effects before and behind a simulator of any kind, compiled: the command side and the output side.

The command side, in this order, from the command u held over every sample:

    c = u delayed by EXTRA_DELAY samples, zero before the record
    LAG x' = c - x                                   a first-order lag, its mean over the sample taken
    c = x clipped to [LOWER, UPPER], followed at COMMAND_RATE at most
    d = c - INPUT_DEAD_UPPER above it, c + INPUT_DEAD_LOWER below minus it, zero between
    v = (1 + GAIN_CHANGE (1 - exp(-t / GAIN_TIME))) d + BIAS

The output side, from what the simulator returns:

    w = play(output) + eccentricity,   times GAIN_RATIO where positive
    y = dead zone of w + drift(t)
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled
from bayes_hw.gap.simulate import settings as S  # noqa: N812

TAU = 2 * np.pi


@compiled
def behind_dead_zone(w, half_width):  # type: ignore[no-untyped-def]
    """What a dead zone shows of w, both numbers."""
    return max(w - half_width, 0.0) + min(w + half_width, 0.0)


@compiled(nogil=True)
def command_side(u, rate, s, v):  # type: ignore[no-untyped-def]
    """Fill v (samples,) for the command u (samples,) under the settings s."""
    h = 1.0 / rate
    whole = int(np.floor(s[S.EXTRA_DELAY]))
    part = s[S.EXTRA_DELAY] - whole
    state, followed = 0.0, 0.0
    for k in range(len(u)):
        later = u[k - whole] if k - whole >= 0 else 0.0
        earlier = u[k - whole - 1] if k - whole - 1 >= 0 else 0.0
        c = part * earlier + (1 - part) * later
        if s[S.LAG] > 0:
            decay = np.exp(-h / s[S.LAG])
            mean = c + (state - c) * (1 - decay) * s[S.LAG] / h
            state = c + (state - c) * decay
            c = mean
        c = min(max(c, s[S.LOWER]), s[S.UPPER])
        if s[S.COMMAND_RATE] < np.inf:
            distance = c - followed
            needed = abs(distance) / s[S.COMMAND_RATE]
            if needed >= h:
                end = followed + np.sign(distance) * s[S.COMMAND_RATE] * h
                c = 0.5 * (followed + end)
                followed = end
            else:
                mean = (0.5 * (followed + c) * needed + c * (h - needed)) / h
                followed = c
                c = mean
        c = max(c - s[S.INPUT_DEAD_UPPER], 0.0) + min(c + s[S.INPUT_DEAD_LOWER], 0.0)
        v[k] = (1 + s[S.GAIN_CHANGE] * (1 - np.exp(-k * h / s[S.GAIN_TIME]))) * c + s[S.BIAS]


@compiled(nogil=True)
def output_side(simulated, rate, s, w, y):  # type: ignore[no-untyped-def]
    """Fill w, before the sensor's map, and y (samples,) for a simulated output under the settings s."""
    start_phase = np.sin(s[S.ECCENTRICITY_PHASE])
    play = 0.0
    for k in range(len(simulated)):
        output = simulated[k]
        if s[S.PLAY] != 0:
            play = min(max(play, output - s[S.PLAY]), output + s[S.PLAY])
            output = play
        if s[S.ECCENTRICITY] != 0:
            output += s[S.ECCENTRICITY] * (
                np.sin(TAU * output / s[S.ECCENTRICITY_PERIOD] + s[S.ECCENTRICITY_PHASE]) - start_phase
            )
        w[k] = output
        if output > 0:
            output *= s[S.GAIN_RATIO]
        shown = behind_dead_zone(output, s[S.DEAD_ZONE])
        t = k / rate
        y[k] = shown + s[S.DRIFT_RATE] * t + s[S.DRIFT_SETTLING] * (1 - np.exp(-t / s[S.DRIFT_TIME]))
