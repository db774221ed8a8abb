"""A free beginning of the impulse response, which the evidence cannot exclude.

A fast real pole or a sample of delay moves a resonance's frequency and damping by a standard deviation or
two long before the criterion asks for it. So the chosen cascade is given two fast real poles, one of which
answers within a sample, and a sample less of delay: the first samples of its impulse response are then free,
and what they could take from the resonances widens their intervals.
"""

from __future__ import annotations

from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.delay import at_delay
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.identify.growth.extension import with_separate_pole
from bayes_hw.identify.growth.search import Grown

ONSET_POLES = (0.0, 0.5)
"""Where the two poles start."""


def with_free_onset(item: Grown) -> Grown:
    """`item` with ONSET_POLES at zero weight and, where it has one, a sample less of delay, descended."""
    earlier = at_delay(item, max(0, item.structure.delay_samples - 1))
    structure, values = earlier.structure, earlier.values
    for pole in ONSET_POLES:
        structure, values = with_separate_pole(structure, values, pole)
    response = CascadeResponse(structure, item.response.records)
    start = evaluate(response, response.coordinates(values), earlier.point.whitener, item.point.most_noise)
    return Grown(response, start).descended()
