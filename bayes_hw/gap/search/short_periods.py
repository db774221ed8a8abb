"""Fits of effects periodic in position, from periods that the first scan was too coarse for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bayes_hw.gap.effects.effect import Effect, everywhere_periodic
from bayes_hw.gap.fit.continuation import can_be_led, led, measured_positions
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.fit.hypothesis import Candidate
from bayes_hw.gap.fit.joint_fits import JointFits, cheapest_of_each, joined
from bayes_hw.gap.search.screen import Screen, most_promising
from bayes_hw.gap.simulate.parallel import Each

PERIODS_TRIED = 2
SHORT_KEPT = 3
"""Fits that are worth to be explained under coloured noise."""


def short_periods(nominal: Fit, base: Fit, effects: Sequence[Effect], joint: JointFits) -> list[Fit]:
    """Plain fits of every periodic effect beside the nominal model or the `base` fit, best first.

    Periods are scanned at the simulated positions of the base fit and at the measured ones; the ripple that
    promises most is led from where it is measured to where it is simulated.
    """
    starts: list[tuple[Fit, list[Candidate]]] = []
    for host, positions in ((nominal, measured_positions(nominal)), (base, None)):
        screen = Screen(host, joint.plain.widened(host.rmse), positions)
        scanned = _scanned(screen, effects, joint.each)
        starts += [(host, [candidate]) for forms in scanned for candidate in forms[:PERIODS_TRIED]]
    rippling = [start for start in starts if can_be_led(joined(*start)[0])]
    best = sorted(rippling, key=lambda start: most_promising(start[1]))[:1]

    def lead(start: tuple[Fit, list[Candidate]]) -> list[Fit]:
        return [led(*joined(*start), measured_positions(start[0]), joint.measured, joint.plain)]

    tasks = [partial(lead, start) for start in best]
    tasks.append(partial(joint.in_two_rounds, starts, SHORT_KEPT))
    found = joint.each(lambda task: task(), tasks)
    return cheapest_of_each([f for fits in found for f in fits])


def most_of_a_short_period(screen: Screen, effects: Sequence[Effect], each: Each) -> float:
    """Twice the log-likelihood that the most promising periodic effect could gain on `screen`."""
    return max((forms[0].reduction for forms in _scanned(screen, effects, each) if forms), default=0.0)


def _scanned(screen: Screen, effects: Sequence[Effect], each: Each) -> list[list[Candidate]]:
    """Candidates of every periodic effect, best first each."""
    return each(partial(screen.candidates, finely=True), everywhere_periodic(effects))
