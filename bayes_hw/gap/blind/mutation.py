"""Would the score notice a wrong truth? Swapped labels or shuffled verdicts must cost what they should."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.gap.blind.counts import confusion, named_right
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict
from bayes_hw.gap.effects.labels import LABEL_BLOCKS

SHUFFLES = 400
DEVIATIONS = 4.0


@dataclass(frozen=True)
class Mutation:
    """Cases named right before the change, expected after it, found after it, and how far off may happen."""

    name: str
    before: float
    expected: float
    found: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether the score fell to what it should."""
        return abs(self.found - self.expected) <= self.tolerance


def mutations(
    truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict], rng: np.random.Generator
) -> list[Mutation]:
    """Both checks; the labels swapped are the two single effects that were most often named right."""
    return [shuffled(truths, verdicts, rng), *swapped_most_frequent(truths, verdicts)]


def shuffled(
    truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict], rng: np.random.Generator
) -> Mutation:
    """Verdicts dealt out at random: on average sum_ij [verdict j fits truth i] / N are right.

    The variance of one shuffle is that of a random permutation's sum (Hoeffding 1951,
    doi 10.1214/aoms/1177729391).
    """
    count = len(truths)
    fits = np.array([[named_right(t, v) for v in verdicts] for t in truths], dtype=np.float64)
    found = [float(fits[np.arange(count), rng.permutation(count)].sum()) for _ in range(SHUFFLES)]
    centred = fits - fits.mean(0) - fits.mean(1)[:, None] + fits.mean()
    variance = float((centred**2).sum()) / max(count - 1, 1)
    tolerance = DEVIATIONS * float(np.sqrt(variance / SHUFFLES)) + 1e-9
    return Mutation(
        "verdicts shuffled",
        float(np.trace(fits)),
        float(fits.sum()) / count,
        float(np.mean(found)),
        tolerance,
    )


def swapped(
    truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict], first: str, second: str
) -> Mutation:
    """Two labels swapped in the truth of single effects: the confusion matrix says what must be left."""
    exchange = {first: second, second: first}
    changed = [
        replace(t, effects=(exchange.get(t.effects[0], t.effects[0]),)) if t.kind == "single" else t
        for t in truths
    ]
    table = confusion(truths, verdicts)
    before = sum(named_right(t, v) for t, v in zip(truths, verdicts, strict=True))
    a, b = table.get(first, Counter()), table.get(second, Counter())
    expected = before - a[first] - b[second] + a[second] + b[first]
    found = sum(named_right(t, v) for t, v in zip(changed, verdicts, strict=True))
    return Mutation(
        f"{first} and {second} swapped in the truth", float(before), float(expected), float(found), 0.0
    )


def swapped_most_frequent(truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict]) -> list[Mutation]:
    """The swap of the two single effects most often named right, where there are two."""
    right = Counter(
        t.effects[0]
        for t, v in zip(truths, verdicts, strict=True)
        if t.kind == "single" and t.effects[0] in LABEL_BLOCKS and named_right(t, v)
    )
    if len(right) < 2:
        return []
    (first, _), (second, _) = right.most_common(2)
    return [swapped(truths, verdicts, first, second)]
