"""Which pole pairs of a cascade are resonances that count."""

from __future__ import annotations

import numpy as np

from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.model.linear import Mode

LIGHT_DAMPING = 0.25
"""A pole pair with a smaller damping ratio is a resonance."""

FORGETTING = 0.5
"""A resonance must decay by 1 / e within this part of the longest record; a slower one is not told from
none."""

HIGHEST_SHARE = 0.9
"""Of the Nyquist frequency: a pair above it shapes the samples' alternation, not a motion that was seen."""

RESONANCE_SHARE = 0.3
"""A resonance counts as dominant when its own section makes up at least this part of |G| at its frequency;
a pair that a neighbouring zero cancels does not."""


def dominant_modes(
    structure: Structure, values: CascadeValues, sample_rate_hz: float, longest_s: float
) -> tuple[Mode, ...]:
    """Lightly damped pole pairs that carry their share of G at their own frequency."""
    block = linear_block(structure, values)
    found = []
    for a1, a2, b1, b2 in values.sections.T:
        if a1 * a1 / 4 - a2 >= 0:
            continue
        mode = Mode.from_pole(complex(a1 / 2, np.sqrt(a2 - a1 * a1 / 4)), sample_rate_hz)
        if mode.damping_ratio >= LIGHT_DAMPING or mode.frequency_hz >= HIGHEST_SHARE * sample_rate_hz / 2:
            continue
        decay_s = 1 / (2 * np.pi * mode.frequency_hz * mode.damping_ratio)
        if decay_s > FORGETTING * longest_s:
            continue
        frequency = np.array([mode.frequency_hz])
        z = np.exp(2j * np.pi * frequency / sample_rate_hz)
        own = np.abs((b1 * z + b2) / (z * z - a1 * z + a2))
        whole = np.abs(block.frequency_response(frequency, sample_rate_hz))
        if own[0] >= RESONANCE_SHARE * whole[0]:
            found.append(mode)
    return tuple(sorted(found, key=lambda mode: mode.frequency_hz))
