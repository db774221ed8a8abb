"""Chaotic responses in prediction-error (observer) form: what the encoder shows corrects the simulation.

Free play bounces between its flanks so that a simulation soon loses the motion, however good the model. An
observer is the same simulation whose states are corrected at every sample by a gain times the difference from
the measured output; what it leaves are one-step prediction errors, whose likelihood is smooth in the
parameters (prediction-error identification: Ljung, System Identification, chapter 7; of chaotic systems:
Abarbanel, Predicting the Future, doi 10.1007/978-1-4614-7218-6). The gain is that of the stationary Kalman
filter of the drive train with the gap closed, driven by the torque that a flank gives when it is missed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, block_diag, solve_discrete_are

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import CHAOS_MARGIN, Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, evaluated, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.fit.joint_fits import joined, part_of
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen, best_forms
from bayes_hw.gap.simulate.builder import Followed
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.gap.simulate.path import states

SHARES = (1.0, 0.5, 0.25)
"""Of the torque that is missing where the motion is lost, taken for the standard deviation in a sample of one
that is not known."""

FIRST_ITERATIONS = 4
ITERATIONS = 8
HOPEFUL = 2
LEADING = 4
RIVALS = 6
PARTNERS_TRIED = 4

SMALLEST_PART = 1e-12
"""Of the variance of the states in a sample that every one of them has: the filter is then stable."""


def observer(
    hypothesis: Hypothesis, values: FloatArray, torque: float, measured: Sequence[FloatArray], sigma: float
) -> Followed | None:
    """The observer of `measured` (samples,), a record each, with noise `sigma` at parameter values
    (parameters,), for a torque in the gear of standard deviation `torque` a sample, given as the torsion in
    output units that it belongs to.

    None where the base model is no drive train or the filter does not settle.
    """
    chain = hypothesis.chain(values)
    if chain.torque_path is None:
        return None
    held = states([chain.torque_path], 1 / hypothesis.scale.rate)
    factors, real = held.factors[:, 0], held.real_count
    turns = [
        np.array([[c, -s], [s, c]]) for c, s in zip(factors[real::2], factors[real + 1 :: 2], strict=True)
    ]
    transition = block_diag(np.diag(factors[:real]), *turns)
    of_motor, of_load = chain.stiffness
    entering = torque * (of_load * held.inputs[1, :, 0] - of_motor * held.inputs[0, :, 0])
    shown = held.outputs[0, :, 0]
    spread = np.outer(entering, entering)
    spread += SMALLEST_PART * float(np.trace(spread)) * np.eye(len(shown))
    try:
        variance = solve_discrete_are(transition.T, shown[:, None], spread, np.array([[sigma**2]]))
    except LinAlgError:
        return None
    predicted = float(shown @ variance @ shown) + sigma**2
    return Followed(tuple(measured), transition @ variance @ shown / predicted, np.sqrt(predicted) / sigma)


@dataclass(frozen=True)
class Following:
    """Rugged effects of `effects` beside `base`, fitted to `measured` while they are followed."""

    base: Hypothesis
    measured: Sequence[FloatArray]
    effects: Sequence[Effect]
    plain: Plain
    each: Each

    def found(self, origins: Sequence[Fit], rivals: Sequence[Fit]) -> list[Explanation]:
        """The rugged effect that is ahead of all others and of none, followed alike, by CHAOS_MARGIN, if any.

        Each is begun at the base parameters of `origins`. The others are `rivals`, fits of single effects,
        best first, begun where they are; springs that are not among the first are not tried.
        """
        leading = list(dict.fromkeys(rival.hypothesis.labels for rival in rivals))[:LEADING]
        tried = [e for e in self.effects if e.chaotic or (e.rugged and (e.label,) in leading)]
        forms = [found for effect in tried if (found := self._best(effect, origins)) is not None]
        forms.sort(key=lambda e: -e.log_evidence)
        if not forms:
            return []
        best = forms[0]
        others = [e.log_evidence for e in forms if e.labels != best.labels]
        reached = max([self._reached(best, rivals), *others])
        return [best] if best.log_evidence > reached + CHAOS_MARGIN else []

    def beside(self, hosts: Sequence[Fit]) -> list[Explanation]:
        """The rugged effect that is that far ahead of none, beside each of `hosts`, if any, and alone from
        where each of these ended: a second effect that is large drives the motion that is to be followed."""
        found = []
        for host in hosts:
            others = [e for e in self.effects if e.label not in host.hypothesis.labels]
            for pair in replace(self, base=host.hypothesis, effects=others).found([host], []):
                followed = replace(self.base, followed=pair.fit.hypothesis.followed)
                found += [pair, self._explained(*part_of(pair.fit, -1, followed))]
        return found

    def set_free(self, followed: Fit) -> Fit:
        """The fit of a simulation that nothing corrects, begun where a followed one ended."""
        free = replace(followed.hypothesis, followed=None)
        return fit(free, self.measured, followed.coordinates, self.plain)

    def partners(self, chaotic: Explanation) -> list[Explanation]:
        """The effect of `chaotic`, followed and alone so far, with each of the most promising second effects,
        and alone from where the best of these ended.

        Second effects are screened by what they change without the chaos: with it, any small change grows.
        """
        host = chaotic.fit
        if chaotic.followed is None or len(host.hypothesis.effects) != 1:
            return []
        calm_base = replace(self.base, followed=chaotic.followed)
        calm = evaluated(calm_base, self.measured, host.coordinates[: self.base.base_count], self.plain)
        screen = Screen(replace(calm, residuals=host.residuals), host.whitener)
        others = [e for e in self.effects if e.label not in chaotic.labels and not e.chaotic]
        best = [candidates[0] for candidates in best_forms(self.each(screen.candidates, others))]
        pairs = self.each(lambda c: self._explained(*joined(host, [c])), best[:PARTNERS_TRIED])
        if not pairs:
            return []
        likeliest = max(pairs, key=lambda e: e.log_evidence).fit
        return [*pairs, self._explained(host.hypothesis, likeliest.coordinates[: len(host.coordinates)])]

    def _best(self, effect: Effect, origins: Sequence[Fit]) -> Explanation | None:
        """The effect fitted from some of its starts, the hopeful ones followed more and less closely."""
        hypothesis = self.base.with_effect(effect)
        own = list(effect.starts(self.base.scale))[1::2]
        begun = [np.append(origin.values, values) for origin in origins for values in own]
        followed = [self._observed(hypothesis, values, SHARES[0]) for values in begun]
        first = self._fits(zip(followed, begun, strict=True), FIRST_ITERATIONS)
        hopeful = [f.values for f in sorted(first, key=lambda f: f.cost)[:HOPEFUL]]
        again = [
            (self._observed(hypothesis, values, share), values) for values in hopeful for share in SHARES
        ]
        explained = self.each(lambda f: with_coloured_noise(f, self.measured), self._fits(again, ITERATIONS))
        return max(explained, key=lambda e: e.log_evidence, default=None)

    def _observed(self, hypothesis: Hypothesis, values: FloatArray, share: float) -> Hypothesis | None:
        """`hypothesis` followed with the gain for its last effect at parameter values (parameters,)."""
        torsion = hypothesis.effects[-1].missed_torsion(values[hypothesis.effect_rows[-1]], self.base.scale)
        readings = self.measured
        if self.plain.masked:
            readings = [
                np.where(mask, np.inf, y) for mask, y in zip(self.plain.masked, readings, strict=True)
            ]
        followed = observer(hypothesis, values, share * torsion, readings, self.plain.sigma)
        return None if followed is None else replace(hypothesis, followed=followed)

    def _fits(self, starts: Iterable[tuple[Hypothesis | None, FloatArray]], iterations: int) -> list[Fit]:
        """Fits from parameter values, of hypotheses that could be followed."""
        tasks = [(h, h.to_coordinates(values)) for h, values in starts if h is not None]
        return self.each(lambda task: fit(task[0], self.measured, task[1], self.plain, iterations), tasks)

    def _reached(self, best: Explanation, rivals: Sequence[Fit]) -> float:
        """Log-evidence of the best rival, or of no effect, followed as `best` is."""
        followed = best.fit.hypothesis.followed
        others = [r for r in rivals if not set(r.hypothesis.labels) & set(best.labels)][:RIVALS]
        none = best.fit.coordinates[: best.fit.hypothesis.effect_rows[-1].start]
        tasks = [(self.base, none), *((rival.hypothesis, rival.coordinates) for rival in others)]

        alike = [(replace(hypothesis, followed=followed), start) for hypothesis, start in tasks]
        return max(e.log_evidence for e in self.each(lambda task: self._explained(*task), alike))

    def _explained(self, hypothesis: Hypothesis, start: FloatArray) -> Explanation:
        found = fit(hypothesis, self.measured, start, self.plain, ITERATIONS)
        return with_coloured_noise(found, self.measured)
