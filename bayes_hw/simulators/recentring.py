"""Fits on a full simulator by a fast stand-in that is moved, at every round, by what it lacks.

With y the full simulator and z the fast one, the fit is made on z(p) + y(c) - z(c) about a centre c, then
centred where it ended, until it stays: at the end the full simulator stands for itself and the fast one for
its derivatives only (manifold mapping: Echeverria and Hemker, doi 10.2478/cmam-2005-0006).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.simulator import Simulator
from bayes_hw.gap.fit.explanation import Explanation, best_of_each
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.gap.search.question import Question
from bayes_hw.gap.simulate.lru_cache import LruCache
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder

ROUNDS = 5
ITERATIONS = 12
SETTLED = 0.05
"""Log-likelihood that a round may still gain when the fit is taken to have settled."""

SETS_REFINED = 6
NEAR, NEAR_SHARE = 50.0, 0.1
"""Sets of labels whose best explanation is fitted on the full simulator, besides the base model: so many, and
none farther behind the best than NEAR, or than NEAR_SHARE of what the best is ahead of the base model."""

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
            fast, real = bare.plain(), bare.on_full(self.full)
            (z,), (y,) = fast.simulate(at, [command], drift), real.simulate(at, [command], drift)
            self.offsets[key] = found = y - z
        return found

    def plain(self) -> Hypothesis:
        """The fast simulator alone."""
        return Hypothesis(self.builder, self.scale, self.inputs, self.effects, unread=self.unread)

    def on_full(self, full: Simulator) -> Hypothesis:
        """The full simulator alone."""
        return replace(self.plain(), builder=SimulatorBuilder(full))


@dataclass(frozen=True)
class Recentring:
    """The full simulator behind the fast one of a diagnosis; `each` shares fits among its threads."""

    full: Simulator
    each: Each

    def posed(self, asked: Question) -> Question:
        """The question about the base model moved by what the fast one lacks at its nominal parameters."""
        base = asked.base
        nominal = base.to_values(base.prior_means)
        moved = RecentredHypothesis(
            base.builder, base.scale, base.inputs, unread=base.unread, full=self.full, centre=nominal
        )
        return replace(asked, base=moved)

    def refined(self, asked: Question, attribution: Attribution) -> Attribution:
        """The base model and the best explanation of the likeliest sets of labels, fitted on the full
        simulator; the others stay as they are, none with more evidence than the best of its labels."""
        base = attribution.base
        best = best_of_each(attribution.explanations, lambda e: e.labels)
        first = next(iter(best.values())).log_evidence
        least_of_all = first - max(NEAR, NEAR_SHARE * (first - base.log_evidence))
        likely = [e for e in list(best.values())[:SETS_REFINED] if e.log_evidence >= least_of_all]
        work = [base, *(e for e in likely if e is not base)]
        found = self.each(lambda e: self._fitted(e, asked.measured), work)
        least = {e.labels: e.log_evidence for e in found}
        others = [
            replace(e, log_evidence=min(e.log_evidence, least.get(e.labels, np.inf)))
            for e in attribution.explanations
            if not any(e is done for done in work)
        ]
        everything = sorted([*found, *others], key=lambda e: -e.log_evidence)
        return replace(attribution, base=found[0], explanations=tuple(everything))

    def _fitted(self, explanation: Explanation, measured: Sequence[FloatArray]) -> Explanation:
        """An explanation at the best parameters of the full simulator, under its own noise."""
        before = explanation.fit
        if explanation.followed is not None or explanation.display is not None:
            return explanation
        current = self._centred(before, before.values, before.coordinates, measured, 0)
        for _ in range(ROUNDS):
            ahead = fit(current.hypothesis, measured, current.coordinates, before.whitener, ITERATIONS)
            step, found = ahead.coordinates - current.coordinates, None
            for tried in range(TRIES):
                at = current.coordinates + step * SHRINK**tried
                values = current.hypothesis.to_values(at)
                there = self._centred(before, values, at, measured, 0)
                if there.cost < current.cost:
                    found = there
                    break
            if found is None:
                break
            gained = current.cost - found.cost
            current = found
            if gained < SETTLED:
                break
        more = current.log_evidence() - before.log_evidence()
        return replace(explanation, fit=current, log_evidence=explanation.log_evidence + more)

    def _centred(
        self, before: Fit, values: FloatArray, at: FloatArray, measured: Sequence[FloatArray], iterations: int
    ) -> Fit:
        """A fit of the hypothesis centred at `values`, from coordinates `at`."""
        own = before.hypothesis
        centred = RecentredHypothesis(
            own.builder, own.scale, own.inputs, own.effects, unread=own.unread, full=self.full, centre=values
        )
        return fit(centred, measured, at, before.whitener, iterations)
