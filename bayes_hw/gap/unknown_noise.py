"""Decisions where no noise level is given: what is left is held against the gap instead of the noise.

A model.json names its noise, so that structure above it asks for a cause. A simulator that names none is
often compared with records of little noise, where every simplification stands out of it. What matters then is
how much of the gap is accounted for: what is small beside it is called neither a second effect nor "other".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayes_hw.gap.attribute import Attribution
from bayes_hw.gap.explanation import Explanation
from bayes_hw.gap.leftover import Leftover

SMALL_SHARE = 0.2
"""Of the base model's root mean square error: 4 % of its square."""

FACT = "encoder_quantization"
"""A lattice of the measured values is seen, not inferred from an error."""


def without_small_seconds(attribution: Attribution) -> Attribution:
    """The attribution without pairs of which one label alone leaves less than the small share of the error."""
    limit = SMALL_SHARE * attribution.base.fit.rmse
    enough = {e.labels for e in attribution.explanations if len(e.labels) == 1 and e.fit.rmse < limit}
    kept = tuple(
        e
        for e in attribution.explanations
        if len(e.labels) < 2 or FACT in e.labels or not any((label,) in enough for label in e.labels)
    )
    return replace(attribution, explanations=kept)


def of_the_gap(left: Sequence[Leftover], explanation: Explanation, base: Explanation) -> list[Leftover]:
    """Leftovers with their sizes as shares of the base model's error, not of what the explanation leaves."""
    ratio = min(explanation.fit.rmse / base.fit.rmse, 1.0)
    return [replace(item, size=item.size * ratio) for item in left]
