"""Fits on a full simulator by a fast stand-in that is moved, at every round, by what it lacks.

With y the full simulator and z the fast one, the fit is made on z(p) + y(c) - z(c) about a centre c, then
centred where it ended, until it stays: at the end the full simulator stands for itself and the fast one for
its derivatives only (manifold mapping: Echeverria and Hemker, doi 10.2478/cmam-2005-0006).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.simulator import Simulator
from bayes_hw.gap.fit.explanation import Explanation, best_of_each
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.gap.noise.whitener import Plain, Whitener
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.gap.search.question import Question
from bayes_hw.gap.simulate.lru_cache import LruCache
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder
from bayes_hw.time_budget import seconds_left

ROUNDS = 5
ITERATIONS = 12
SETTLED = 0.05
"""Log-likelihood that a round may still gain when the fit is taken to have settled."""

SETS_REFINED = 6
NEAR, NEAR_SHARE = 50.0, 0.1
"""Sets of labels whose best explanation is fitted on the full simulator, besides the base model: so many, and
none farther behind the best than NEAR, or than NEAR_SHARE of what the best is ahead of the base model."""

NOTICED = 0.3
"""Of the noise: what the fast simulator may be off by without a second look."""

FULL_ITERATIONS = 8
NOISE_ROUNDS = 2
SHRINK = 0.5
TRIES = 4


@dataclass(frozen=True)
class RecentredHypothesis(Hypothesis):
    """A hypothesis on a fast simulator, moved by what `full` has more at parameter values `centre`.

    `full` is None where nothing is moved; `offsets` keeps what was simulated, by the centre and the commands.
    """

    full: Simulator | None = None
    centre: FloatArray | None = None
    offsets: LruCache[bytes, FloatArray] = field(default_factory=lambda: LruCache(64))

    def simulate_batch(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None = None, drift: bool = True
    ) -> list[FloatArray]:
        found = super().simulate_batch(values, inputs, drift)
        commands = self.inputs if inputs is None else inputs
        return [y + self._offset(u, drift)[:, None] for y, u in zip(found, commands, strict=True)]

    def simulate_signals(
        self, values: FloatArray, inputs: Sequence[FloatArray] | None = None, drift: bool = True
    ) -> list[tuple[FloatArray, FloatArray]]:
        commands = self.inputs if inputs is None else inputs
        found = super().simulate_signals(values, inputs, drift)
        moved = [self._offset(u, drift) for u in commands]
        return [(w + more, y + more) for (w, y), more in zip(found, moved, strict=True)]

    def _offset(self, command: FloatArray, drift: bool) -> FloatArray:
        """What the full simulator has more for a command (samples,), at the centre."""
        if self.full is None or self.centre is None:
            return np.zeros(len(command))
        at = self.centre if len(self.centre) == len(self.parameters) else self.centre[: self.base_count]
        bare = self if len(at) == len(self.parameters) else replace(self, effects=())
        key = at.tobytes() + command.tobytes() + bytes([drift]) + "+".join(bare.labels).encode()
        found = self.offsets[key]
        if found is None:
            fast, real = _plain(bare), _on_full(bare, self.full)
            (z,), (y,) = fast.simulate(at, [command], drift), real.simulate(at, [command], drift)
            self.offsets[key] = found = y - z
        return found


@dataclass(frozen=True)
class Recentring:
    """The full simulator behind the fast one of a diagnosis; `each` shares fits among its threads."""

    full: Simulator
    each: Each

    def posed(self, asked: Question) -> Question:
        """The question about the base model moved by what the fast one lacks where the full one fits best."""
        base = asked.base
        start = _centred(base, self.full, base.prior_means)
        plain = Plain(base.scale.sigma, masked=base.unread or ())
        found = self._settled(fit(start, asked.measured, base.prior_means, plain, 0), asked.measured)
        return replace(asked, base=_centred(base, self.full, found.coordinates))

    def refined(self, asked: Question, attribution: Attribution) -> Attribution:
        """The base model and the best explanation of the likeliest sets of labels, fitted on the full
        simulator; the others stay as they are, none with more evidence than the best of its labels, and so do
        those whose turn comes when time is up."""
        base = attribution.base
        best = best_of_each(attribution.explanations, lambda e: e.labels)
        first = next(iter(best.values())).log_evidence
        least_of_all = first - max(NEAR, NEAR_SHARE * (first - base.log_evidence))
        likely = [e for e in list(best.values())[:SETS_REFINED] if e.log_evidence >= least_of_all]
        work = [base, *(e for e in likely if e is not base)]
        end = time.monotonic() + seconds_left()
        untried = [False] * len(work)

        def fitted(number: int) -> Explanation:
            untried[number] = number > 0 and time.monotonic() > end
            return work[number] if untried[number] else self._fitted(work[number], asked.measured)

        found = self.each(fitted, range(len(work)))
        least = {e.labels: e.log_evidence for e in found}
        others = [
            replace(e, log_evidence=min(e.log_evidence, least.get(e.labels, np.inf)))
            for e in attribution.explanations
            if not any(e is done for done in work)
        ]
        everything = sorted([*found, *others], key=lambda e: -e.log_evidence)
        cut_short = attribution.cut_short or any(untried)
        return replace(attribution, base=found[0], explanations=tuple(everything), cut_short=cut_short)

    def _fitted(self, explanation: Explanation, measured: Sequence[FloatArray]) -> Explanation:
        """An explanation at the best parameters of the full simulator.

        Under its own noise; and, where that of the fast one left much, under plain noise first, since the
        noise of a misfit follows what the simulator itself would explain.
        """
        before = explanation.fit
        if explanation.followed is not None or explanation.display is not None:
            return explanation
        begun = self._at(before, before.coordinates, measured, before.whitener)
        found = self._settled(begun, measured)
        more = found.log_evidence() - before.log_evidence()
        own = replace(explanation, fit=found, log_evidence=explanation.log_evidence + more)
        sigma = before.hypothesis.scale.sigma
        moved = np.concatenate([a - b for a, b in zip(begun.simulated, before.simulated, strict=True)])
        if explanation.stochastic is not None or np.std(moved) < NOTICED * sigma:
            return own
        plain = Plain(sigma, masked=before.hypothesis.unread or ())
        found = self._settled(self._at(before, before.coordinates, measured, plain), measured)
        for _ in range(NOISE_ROUNDS):
            found = self._settled(replace(found, whitener=autoregression(found)), measured)
        found = replace(found, whitener=autoregression(found))
        anew = Explanation(found, None, found.log_evidence())
        return max(own, anew, key=lambda e: e.log_evidence)

    def _settled(self, begun: Fit, measured: Sequence[FloatArray]) -> Fit:
        """Rounds of fits about where the last ended, from a fit on the full simulator, under its noise."""
        current = self._at(begun, begun.coordinates, measured, begun.whitener)
        for _ in range(ROUNDS):
            ahead = fit(current.hypothesis, measured, current.coordinates, begun.whitener, ITERATIONS)
            step, better = ahead.coordinates - current.coordinates, None
            for tried in range(TRIES):
                there = self._at(begun, current.coordinates + step * SHRINK**tried, measured, begun.whitener)
                if there.cost < current.cost:
                    better = there
                    break
            if better is None:
                break
            gained = current.cost - better.cost
            current = better
            if gained < SETTLED:
                break
        return self._finished(current, measured)

    def _finished(self, settled: Fit, measured: Sequence[FloatArray]) -> Fit:
        """Where the fast simulator's derivatives may not be those of the full one, fitted on by its own."""
        hypothesis = settled.hypothesis
        alone = _plain(hypothesis).simulate(settled.values)
        moved = np.concatenate([a - b for a, b in zip(settled.simulated, alone, strict=True)])
        if np.std(moved) < NOTICED * hypothesis.scale.sigma:
            return settled
        real = _on_full(hypothesis, self.full)
        found = fit(real, measured, settled.coordinates, settled.whitener, FULL_ITERATIONS)
        if found.cost > settled.cost - SETTLED:
            return settled
        return self._at(settled, found.coordinates, measured, settled.whitener)

    def _at(self, like: Fit, at: FloatArray, measured: Sequence[FloatArray], noise: Whitener) -> Fit:
        """The hypothesis of a fit at coordinates `at`, centred there."""
        return fit(_centred(like.hypothesis, self.full, at), measured, at, noise, 0)


def _plain(like: Hypothesis) -> Hypothesis:
    """On the fast simulator alone."""
    return Hypothesis(like.builder, like.scale, like.inputs, like.effects, unread=like.unread)


def _on_full(like: Hypothesis, full: Simulator) -> Hypothesis:
    """On the full simulator alone."""
    return replace(_plain(like), builder=SimulatorBuilder(full))


def _centred(like: Hypothesis, full: Simulator, at: FloatArray) -> RecentredHypothesis:
    """A hypothesis moved by what the full simulator has more at coordinates `at`."""
    return RecentredHypothesis(
        like.builder,
        like.scale,
        like.inputs,
        like.effects,
        unread=like.unread,
        full=full,
        centre=like.to_values(at),
    )
