"""Limits that fall at an instant of every record and stay low: an amplifier that got hot and gives less.

Nothing of it follows the angle, but limits that move with the angle leave as little on a few records, and
noise of a cause takes up the rest. The fall is a command that was limited before the drive limited it, so
that the cascade is descended with the commands that the drive then had: it names no effect, and has no part
in a prediction, since nobody knows when limits fall next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.joint_fit import LABEL_PRICE_NATS, JointFit
from bayes_hw.gap.joint.fit.structure_moves import pruned
from bayes_hw.gap.joint.residuals.command_trace import INSTANTS, limits_that_change
from bayes_hw.gap.joint.residuals.noise_screen import first_order_noise, noise_screens
from bayes_hw.record import Record
from bayes_hw.time_budget import time_is_up

SHARES = (0.6, 0.75, 0.85, 0.9, 0.94, 0.97, 0.985)
"""Of the limits that may be left, to begin with."""

PROMISING_NATS, REALISED = 25.0, 4.0
"""That falls of the limits must promise to be tried, and how many times as much a fall may be worth: it
shifts more than a score test sees."""

FIRST_STEPS, SECOND_STEPS, ROUNDS = 6, 4, 3
FINER = ((0.05, 0.02), (0.02, 0.01), (0.005, 0.003), (0.001, 0.001))
"""Steps of the instants, shares of a record, and of the logarithm of what is left."""

BETTER = 0.1
"""Nats from which a step is one."""


@dataclass(frozen=True, eq=False)
class FallenLimits:
    """`limits` (lower, upper) from sample `instants` (one a record) on; the best cascade `before` that, and
    the best `without` it in its records: their commands are those that the drive still had."""

    limits: tuple[float, float]
    instants: tuple[int, ...]
    without: JointFit
    before: JointFit

    def fallen_to(self, left: float) -> FallenLimits:
        """To a share of the limits that the cascade has before; not descended."""
        c = self.without.values.cascade
        return replace(self, limits=(left * c.lower, left * c.upper))

    @property
    def left(self) -> float:
        """What is left of the limits, a share of them."""
        c = self.without.values.cascade
        return (self.limits[1] - self.limits[0]) / (c.upper - c.lower)

    @property
    def nats(self) -> float:
        """Over the cascade whose limits stay."""
        return self.without.score - LABEL_PRICE_NATS - self.before.score

    def of(self, records: Sequence[Record]) -> list[Record]:
        """The records with such commands."""
        low, high = self.limits
        return [
            replace(r, u=np.where(np.arange(len(r)) < begin, r.u, np.clip(r.u, low, high)))
            for r, begin in zip(records, self.instants, strict=True)
        ]

    def descended(self, steps: int, start: JointFit | None = None, order: int | None = None) -> FallenLimits:
        """The cascade descended under its commands from `start`, under noise of a held `order` first."""
        fit = self.without if start is None else start
        fit = fit.under(replace(fit.response, records=self.of(self.before.response.records)))
        fit = replace(fit, taken=self.before.taken + len(self.instants) + 1)
        if order is not None:
            fit = fit.descended_under(order, steps)
        return replace(self, without=fit.descended(steps))


def fallen_limits(fit: JointFit, asked: float) -> FallenLimits | None:
    """The fall that helps `fit` most, of those that score tests promise; None where they promise none that
    may be worth the nats that are `asked`, or where time is up."""
    if time_is_up():
        return None
    begun = []
    for screen in noise_screens(fit):
        promised, instants = limits_that_change(fit, screen)
        if promised > max(PROMISING_NATS, asked / REALISED):
            begun.append(FallenLimits((0.0, 0.0), instants, fit, fit))
    if not begun:
        return None
    trials = [(one, left) for one in begun for left in SHARES]
    best = max(each(lambda trial: _settled(*trial), trials), key=lambda one: one.nats)
    best = replace(best, without=pruned(best.without))
    longest = fit.response.scale.samples
    for of_record, of_size in FINER:
        step = max(round(of_record * longest), 1)
        for number in range(len(best.instants)):
            for change in (-step, step):
                best = _moved(best, number, change)
        for size in (-of_size, of_size):
            best = _better(best, best.fallen_to(best.left * float(np.exp(size))))
    return replace(best, without=pruned(best.without.descended()))


def _settled(found: FallenLimits, left: float) -> FallenLimits:
    """Descended under noise of the first order, which takes up nothing that is slow; the instants looked for
    anew as the cascade changes."""
    for _ in range(ROUNDS):
        found = found.fallen_to(left).descended(FIRST_STEPS, order=1)
        found = replace(found, instants=_likeliest(found))
    return found.fallen_to(left).descended(FIRST_STEPS, order=1)


def _likeliest(found: FallenLimits) -> tuple[int, ...]:
    """The instants at which the commands leave the least of every record."""
    response, values = found.without.response, found.without.values
    noise = first_order_noise(found.without.point.residuals)
    instants = []
    for number, record in enumerate(found.before.response.records):
        weights = 1.0 if response.weights is None else response.weights[number]
        every = [round(share * len(record)) for share in INSTANTS]
        left = []
        for begin in every:
            (tried,) = replace(found, instants=(begin,)).of([record])
            e = record.y - response.simulate(values, tried.u, record.known).y
            white = noise.apply((e / weights)[None], 0, response.measured(number))
            left.append(float(np.sum(white**2)))
        instants.append(every[int(np.argmin(left))])
    return tuple(instants)


def _moved(found: FallenLimits, number: int, change: int) -> FallenLimits:
    """One instant moved on by `change` samples as long as that is better."""
    while True:
        instants = list(found.instants)
        instants[number] += change
        if not 0 <= instants[number] <= len(found.before.response.records[number]):
            return found
        further = _better(found, replace(found, instants=tuple(instants)))
        if further is found:
            return found
        found = further


def _better(found: FallenLimits, other: FallenLimits) -> FallenLimits:
    """`other` after a few steps, if it is better."""
    other = other.descended(SECOND_STEPS)
    return other if other.nats > found.nats + BETTER else found
