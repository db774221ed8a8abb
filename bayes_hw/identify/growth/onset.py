"""A free beginning of the impulse response, which the evidence cannot exclude.

A fast real pole or a sample of delay moves a resonance's frequency and damping by a standard deviation or
two long before the criterion asks for it. So the chosen cascade is given two fast real poles, one of which
answers within a sample, and a sample less of delay: the first samples of its impulse response are then free,
and what they could take from the resonances widens their intervals.
"""

from __future__ import annotations

from bayes_hw.identify.growth.delay import at_delay
from bayes_hw.identify.growth.extension import with_separate_pole
from bayes_hw.identify.growth.held_poles import fitted_with_held_poles
from bayes_hw.identify.growth.search import Grown

ONSET_POLES = (0.0, 0.5)


def with_free_onset(item: Grown) -> Grown:
    """`item` with ONSET_POLES and, where it has one, a sample less of delay.

    Fitted with every real pole where it is: one of little weight would go anywhere, to the integrator too.
    """
    earlier = at_delay(item, max(0, item.structure.delay_samples - 1))
    structure, values = earlier.structure, earlier.values
    for pole in ONSET_POLES:
        structure, values = with_separate_pole(structure, values, pole)
    return fitted_with_held_poles(structure, values, item)
