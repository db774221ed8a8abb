"""Plain fits of the base model together with effects, from candidates that a screen chose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit import Fit, fit
from bayes_hw.gap.hypothesis import Hypothesis
from bayes_hw.gap.parallel import Each
from bayes_hw.gap.screen import Candidate
from bayes_hw.gap.whitener import Plain

FIRST_ITERATIONS = 4
MORE_ITERATIONS = 10
HOPEFUL = 2
"""Fits that go on although others are ahead, for what their quadratic model promises."""


@dataclass(frozen=True)
class JointFits:
    """Fits to `measured` under white noise."""

    measured: Sequence[FloatArray]
    plain: Plain
    each: Each

    def in_two_rounds(
        self, starts: Sequence[tuple[Fit, list[Candidate]]], finished: int, times: int = 1
    ) -> list[Fit]:
        """A few iterations of every host with its candidates, more of the best `finished` and of the few
        others that promise most; best first.

        Of both `times` as many as usual.
        """
        begun = self.each(lambda pair: self._begun(*pair, times * FIRST_ITERATIONS), starts)
        first = sorted(begun, key=lambda f: f.cost)
        behind = first[finished:]
        promised = self.each(lambda f: f.promised_cost(), behind)
        hopeful = [behind[i] for i in np.argsort(promised)[:HOPEFUL]]
        done = self.each(
            lambda f: fit(f.hypothesis, self.measured, f.coordinates, self.plain, times * MORE_ITERATIONS),
            [*first[:finished], *hopeful],
        )
        return cheapest_of_each([*done, *behind])

    def _begun(self, host: Fit, candidates: Sequence[Candidate], iterations: int) -> Fit:
        hypothesis, start = joined(host, candidates)
        return fit(hypothesis, self.measured, start, self.plain, iterations)


def joined(host: Fit, candidates: Sequence[Candidate]) -> tuple[Hypothesis, FloatArray]:
    """The hypothesis of `host` with the effects of `candidates` too, and the coordinates of both."""
    hypothesis, values = host.hypothesis, host.values
    for candidate in candidates:
        hypothesis = hypothesis.with_effect(candidate.effect)
        values = np.concatenate([values, candidate.values])
    return hypothesis, hypothesis.to_coordinates(values)


def candidate_of(single: Fit) -> Candidate:
    """The effect of a single fit at its estimate."""
    count = single.hypothesis.base_count
    return Candidate(single.hypothesis.effects[-1], tuple(single.values[count:]), 0.0)


def cheapest_of_each(fits: Sequence[Fit]) -> list[Fit]:
    """The cheapest fit of every combination of effects, best first."""
    best: dict[frozenset[str], Fit] = {}
    for f in fits:
        key = frozenset(effect.name for effect in f.hypothesis.effects)
        if key not in best or f.cost < best[key].cost:
            best[key] = f
    return sorted(best.values(), key=lambda f: f.cost)
