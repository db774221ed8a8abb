"""Plain fits of the base model together with effects that a screen chose, and the minima that they find."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, fit, fitted_on
from bayes_hw.gap.fit.hypothesis import Candidate, Hypothesis
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.simulate.parallel import Each

FIRST_ITERATIONS = 4
MORE_ITERATIONS = 10
HOPEFUL = 2
"""Fits that go on although others are ahead, for what their quadratic model promises."""


SAME = 0.1
"""Cost by which two fits of one combination of effects may differ and yet have ended in the same minimum."""

NEARLY_THERE = 3.0
"""Cost above a known minimum at which a fit that promises nothing better is taken to lead there."""


@dataclass
class Minimum:
    """A minimum of the plain cost, with its explanation under coloured noise once that is known."""

    fit: Fit
    explanation: Explanation | None = None


@dataclass(frozen=True)
class JointFits:
    """Fits to `measured` under white noise, and the minima found: searches from many places end in the same.

    Work is handed to `each` only where no fit before led to the same minimum, so that what is found does not
    depend on the number of threads.
    """

    measured: Sequence[FloatArray]
    plain: Plain
    each: Each
    known: dict[frozenset[str], list[Minimum]] = field(default_factory=dict)

    def in_two_rounds(self, starts: Sequence[tuple[Fit, list[Candidate]]], finished: int) -> list[Fit]:
        """A few iterations of every host with its candidates, more of the best `finished` and of the few
        others that promise most; best first.

        Fits on their way to a known minimum are replaced by it.
        """
        begun = self.each(lambda pair: self._begun(*pair), starts)
        first = sorted(begun, key=lambda f: f.cost)
        behind = first[finished:]
        promised = [f.promised_cost() for f in behind]
        hopeful = [behind[i] for i in np.argsort(promised)[:HOPEFUL]]
        going_on = [*first[:finished], *hopeful]
        ends = [self._end_of(f) for f in going_on]
        new = [f for f, end in zip(going_on, ends, strict=True) if end is None]
        done = self.each(lambda f: fitted_on(f, self.measured, self.plain, MORE_ITERATIONS), new)
        for f in done:
            self._minimum(f)
        return cheapest_of_each([*done, *(end for end in ends if end is not None), *behind])

    def explained(self, fits: Sequence[Fit]) -> list[Explanation]:
        """The plain `fits` under coloured noise, those of one minimum once."""
        minima = [self._minimum(f) for f in fits]
        new = list({id(m): m for m in minima if m.explanation is None}.values())
        found = self.each(lambda m: with_coloured_noise(m.fit, self.measured), new)
        for minimum, explanation in zip(new, found, strict=True):
            minimum.explanation = explanation
        return [m.explanation for m in minima if m.explanation is not None]

    def _minimum(self, fit: Fit) -> Minimum:
        """The known minimum that `fit` ended in, known from now on."""
        minima = self.known.setdefault(_combination(fit), [])
        for minimum in minima:
            if minimum.fit is fit or abs(minimum.fit.cost - fit.cost) < SAME:
                return minimum
        minima.append(Minimum(fit))
        return minima[-1]

    def _end_of(self, begun: Fit) -> Fit | None:
        """The known minimum that `begun` is close to without a promise of a better one."""
        known = [minimum.fit for minimum in self.known.get(_combination(begun), [])]
        if not known:
            return None
        best = min(known, key=lambda f: f.cost)
        near = begun.cost < best.cost + NEARLY_THERE
        return best if near and begun.promised_cost() > best.cost - SAME else None

    def _begun(self, host: Fit, candidates: Sequence[Candidate]) -> Fit:
        hypothesis, start = joined(host, candidates)
        return fit(hypothesis, self.measured, start, self.plain, FIRST_ITERATIONS)


def joined(host: Fit, candidates: Sequence[Candidate]) -> tuple[Hypothesis, FloatArray]:
    """The hypothesis of `host` with the effects of `candidates` too, and the coordinates of both."""
    hypothesis, values = host.hypothesis, host.values
    for candidate in candidates:
        hypothesis = hypothesis.with_effect(candidate.effect)
        values = np.concatenate([values, candidate.values])
    return hypothesis, hypothesis.to_coordinates(values)


def part_of(several: Fit, number: int, base: Hypothesis) -> tuple[Hypothesis, FloatArray]:
    """Of a fit of several effects the one of this number alone beside `base`, and its coordinates there."""
    own = several.coordinates[several.hypothesis.effect_rows[number]]
    alone = base.with_effect(several.hypothesis.effects[number])
    return alone, np.concatenate([several.coordinates[: base.base_count], own])


def candidate_of(single: Fit) -> Candidate:
    """The effect of a single fit at its estimate."""
    count = single.hypothesis.base_count
    return Candidate(single.hypothesis.effects[-1], tuple(single.values[count:]), 0.0)


def cheapest_of_each(fits: Sequence[Fit]) -> list[Fit]:
    """The cheapest fit of every combination of effects, best first."""
    best: dict[frozenset[str], Fit] = {}
    for f in fits:
        key = _combination(f)
        if key not in best or f.cost < best[key].cost:
            best[key] = f
    return sorted(best.values(), key=lambda f: f.cost)


def _combination(fit: Fit) -> frozenset[str]:
    """Names of the effects of a fit."""
    return frozenset(effect.name for effect in fit.hypothesis.effects)
