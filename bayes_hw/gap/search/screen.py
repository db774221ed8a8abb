"""All effects in one pass: how much of the whitened residual each could take, base tangents projected off.

For an effect with response r (its simulated output less that of the base) the reducible error is
(r' e)^2 / r' r, with e the base's residual and both r and e whitened and with the span of the base
parameters' derivatives removed: what re-estimating the base could not do. It is in units of log-likelihood
times two. Periodic effects are scanned over their period with the linear response of a sine of the position.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.effects.effect import Effect, PeriodicEffect
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.fit.free_level import level_columns
from bayes_hw.gap.fit.hypothesis import Candidate
from bayes_hw.gap.noise.spectra import standing_out
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.search.period_scan import scan_periods
from bayes_hw.gap.simulate.columns import largest_sizes, misses, square_sums

MAX_PERIODS = 240
SHORTEST_PERIOD_SHARE = 1 / 60
"""Of the travel, where a quarter of a cycle more over it is told apart; shorter periods are not scanned."""

SAMPLES_A_PERIOD = 1.25
SAMPLES_A_READING = 2.5
"""At the axis' greatest speed, of a torque and of an encoder's error; an error of a shorter period is that of
the encoder's interpolation, not of its centre."""

MAX_FINE_PERIODS = 2000

PEAKS_KEPT = 4

NEARBY = 1.6
"""Between starts of one effect: from nearer ones fits end in the same place."""

LARGEST_RESPONSE = 1e6
"""Output units; a start whose simulation runs away is left out."""

SMALL, TINY = 1e-10, 1e-300
"""Added to the squares of responses, as a share and as it is: those of nothing stay apart from zero."""


def most_promising(candidates: Sequence[Candidate]) -> float:
    """Key that sorts the candidates of effects, best first each, by what they promise."""
    return -candidates[0].reduction


def best_forms(found: Sequence[list[Candidate]]) -> list[list[Candidate]]:
    """The candidates of the most promising form of every label, best first."""
    best: dict[str, list[Candidate]] = {}
    for candidates in sorted((c for c in found if c), key=most_promising):
        best.setdefault(candidates[0].effect.label, candidates)
    return list(best.values())


def distinct(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The best of `candidates` of one effect, best first, as many as it tries, none near a better one."""
    kept: list[Candidate] = []
    for candidate in candidates:
        if len(kept) == candidate.effect.starts_tried:
            break
        if not any(_near(candidate.values, other.values) for other in kept):
            kept.append(candidate)
    return kept


def _near(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether no value differs by more than a factor NEARBY."""
    sizes = [sorted((abs(a), abs(b))) for a, b in zip(one, other, strict=True)]
    return all(large <= NEARBY * small for small, large in sizes)


class Screen:
    """The base fit's residual with the base tangents projected off, ready to hold responses against.

    `positions` (samples,), a record each, are those of periodic effects, the simulated ones if not given.
    """

    def __init__(self, base: Fit, whitener: Whitener, positions: Sequence[FloatArray] | None = None) -> None:
        self.base, self.whitener, self.positions = base, whitener, positions
        levels = level_columns(base.hypothesis, whitener, [len(e) for e in base.residuals])
        tangents = self._white(base.jacobians)
        self.tangents, _ = np.linalg.qr(
            np.concatenate([tangents, levels], axis=1) if levels.size else tangents
        )
        self.residual = self._projected(self._white([e[:, None] for e in base.residuals]))[:, 0]

    def beside(self, response: FloatArray) -> Screen:
        """The same with a projected response (samples,) off too: an effect that is there already."""
        other = copy(self)
        size = float(np.linalg.norm(response))
        if size > 0:
            direction = response / size
            other.tangents = np.concatenate([self.tangents, direction[:, None]], axis=1)
            other.residual = self.residual - direction * float(direction @ self.residual)
        return other

    def _white(self, columns: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([self.whitener.whiten(c, record) for record, c in enumerate(columns)])

    def _projected(self, columns: FloatArray) -> FloatArray:
        return columns - self.tangents @ (self.tangents.T @ columns)

    def project(self, responses: Sequence[FloatArray]) -> FloatArray:
        """Responses (samples, n) a record, whitened and projected, all records stacked."""
        return self._projected(self._white(responses))

    def reduction(self, projected: FloatArray) -> float:
        """Twice the log-likelihood that the columns (samples, n) could gain together."""
        gram = projected.T @ projected
        gram = gram + (SMALL * np.trace(gram) + TINY) * np.eye(len(gram))
        correlation = projected.T @ self.residual
        return float(correlation @ np.linalg.solve(gram, correlation))

    def candidates(self, effect: Effect, finely: bool = False) -> list[Candidate]:
        """Every start of `effect` with what it promises, best first.

        Periods are scanned `finely` down to what the samples can follow, otherwise to a share of the travel.
        """
        if effect.periodic is not None:
            found = self._scanned(effect.periodic, finely)
        else:
            starts = [*effect.starts(self.base.hypothesis.scale), *effect.starts_at(self.lines_hz)]
            found = self.tried(effect, starts)
        return sorted(found, key=lambda candidate: -candidate.reduction)

    @cached_property
    def lines_hz(self) -> FloatArray:
        """Frequencies (lines,) at which the residual stands out of its own smooth spectrum most."""
        return standing_out(self.base.residuals, self.base.hypothesis.scale.rate)

    def response(self, candidate: Candidate) -> FloatArray:
        """The projected response (samples,) to a candidate; zero where its simulation runs away."""
        return self.responses([candidate])[:, 0]

    def responses(self, candidates: Sequence[Candidate]) -> FloatArray:
        """The projected responses (samples, candidates) to candidates of one effect; zero where a simulation
        runs away."""
        hypothesis = self.base.hypothesis.with_effect(candidates[0].effect)
        values = np.array([np.concatenate([self.base.values, c.values]) for c in candidates])
        return self._changes(hypothesis.simulate_batch(values))[0]

    def _changes(self, simulated: Sequence[FloatArray]) -> tuple[FloatArray, BoolArray]:
        """The projected changes (samples, n) to what is `simulated`, zero where it runs away, and whether it
        does not (n,)."""
        changes = [misses(b, s) for s, b in zip(simulated, self.base.simulated, strict=True)]
        tame = np.max([largest_sizes(change) for change in changes], axis=0) < LARGEST_RESPONSE
        if not tame.all():
            changes = [np.where(tame, change, 0.0) for change in changes]
        return -self.project(changes), tame

    def tried(self, effect: Effect, starts: Sequence[tuple[float, ...]]) -> list[Candidate]:
        """The given starts of `effect` with what each promises."""
        if not len(starts):
            return []
        hypothesis = self.base.hypothesis.with_effect(effect)
        values = np.array([np.concatenate([self.base.values, start]) for start in starts])
        responses, tame = self._changes(hypothesis.simulate_batch(values))
        power, along = square_sums(responses), responses.T @ self.residual
        promised = np.maximum(2 * along - power, along**2 / (power * (1 + SMALL) + TINY))
        return [
            Candidate(effect, tuple(start), float(most))
            for start, most, kept in zip(starts, promised, tame, strict=True)
            if kept
        ]

    def _scanned(self, effect: PeriodicEffect, finely: bool) -> list[Candidate]:
        scale = self.base.hypothesis.scale
        is_reading = effect.door == "output"
        samples = SAMPLES_A_READING if is_reading else SAMPLES_A_PERIOD
        followed = max(samples * scale.output_speed / scale.rate, scale.shortest if is_reading else 0.0)
        shortest = followed if finely else max(SHORTEST_PERIOD_SHARE * scale.travel, followed)
        count = int(np.clip(4 * scale.travel / shortest, 10, MAX_FINE_PERIODS if finely else MAX_PERIODS))
        frequencies = np.linspace(0.3 / scale.travel, 1 / shortest, count)
        scan = scan_periods(
            self.base, self.whitener, self.tangents, self.residual, effect, frequencies, self.positions
        )
        return [
            Candidate(
                effect, (*scan.amplitudes[:, i].tolist(), 1 / frequencies[i]), float(scan.reductions[i])
            )
            for i in scan.peaks()[:PEAKS_KEPT]
        ]
