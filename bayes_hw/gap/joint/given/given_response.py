"""Residuals of a given model with effects: the joint response in base parameters instead of free sections."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy import linalg

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.joint.fit.held_port import numbers_saved
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, JointFit
from bayes_hw.gap.joint.given.given_model import STATIC, GivenCascade, GivenModel
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.growth.cascade_response import outermost_limits
from bayes_hw.identify.growth.descent import CONVERGED_NATS, evaluate

DIFFERENCE = 1e-6
DELAY, MODE = "transport_delay", "unmodelled_mode"
MOST_STEP = 1.0
AT_A_SAMPLE = 0.02
"""Of a sample, from a whole one of delay: so near, the descent goes on beyond it."""
LIMITS, SMALLEST_SHARE, WELL_WITHIN = 2, 1e-6, 0.98
"""Coordinates that are limits; of a nominal limit, that commands reach at least; of what commands reach, at
which a limit is begun that none did."""


@dataclass(frozen=True, eq=False, kw_only=True)
class GivenResponse(JointResponse):
    """Coordinates: those of `GivenModel.cascade`, then the effects as in `JointResponse`; `part` and
    `further` say whether a delay and a mode are added to G. Readings whose instants are off by chance may be
    `late` on the whole, by so many samples at most: so short a delay has no label of its own."""

    given: GivenModel
    part: bool = False
    further: bool = False
    late: float = 0.0

    @cached_property
    def _n_base(self) -> int:
        return len(self._bounds[0])

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        return self.given.bounds(self.part, self.further)

    @property
    def held_numbers(self) -> int:
        """One more than where G is free: a given G does not bend with what only one of command and reading
        has in the controller."""
        return 1 + super().held_numbers

    @property
    def first_of_mode(self) -> int:
        """Coordinate of the further mode's first number, behind those of the base."""
        return self.given.size + int(self.part)

    @property
    def _n_natural(self) -> int:
        return self.structure.n_static + self.structure.n_linear

    def coordinates(self, values: JointValues) -> FloatArray:
        """Coordinates (size,) of natural parameters, whose cascade is a `GivenCascade`."""
        assert isinstance(values.cascade, GivenCascade)
        return np.concatenate([values.cascade.theta, self._effect_coordinates(values)])

    def values(self, coordinates: FloatArray) -> JointValues:
        """Natural parameters at `coordinates` (size,)."""
        cascade = self.given.cascade(coordinates[: self._n_base], self.part, self.further)
        return JointValues(cascade, self._effect_values(coordinates[self._n_base :]))

    def prior_precision(self) -> FloatArray:
        """That of the nominal model for its base coordinates."""
        found = np.zeros(self.size)
        found[: self._n_base] = self.given.all_sd(self.part, self.further) ** -2.0
        return found

    def _admissible_base(self, base: FloatArray, previous: FloatArray) -> FloatArray:
        """Within bounds. Where no command reaches a limit residuals have no slope in it, and a descent that
        went there under the wrong noise would not come back: one that commands reach stays reached."""
        step = np.clip(base - previous, -MOST_STEP, MOST_STEP)
        found = np.clip(previous + step, *self._bounds)
        reached = previous[:LIMITS] <= self.reach
        found[:LIMITS] = np.where(reached, np.minimum(found[:LIMITS], self.reach), found[:LIMITS])
        return found

    @cached_property
    def reach(self) -> FloatArray:
        """Coordinates (lower, upper) of the outermost limits that commands of the records reach."""
        nominal = np.array([self.given.lower, self.given.upper])
        return np.asarray(np.log(np.maximum(outermost_limits(self.records) / nominal, SMALLEST_SHARE)))

    def linearise(
        self,
        coordinates: FloatArray,
        overlap: int,  # noqa: ARG002
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        """Derivatives of y and, as the last row, the residual: rows (size + 1, samples) of every record, with
        the samples that were measured, None where all were."""
        values, turn = self.values(coordinates), self._turn(coordinates[: self._n_base])
        packed = self.packed(values, True)
        for number, record in enumerate(self.records):
            run, tangents = packed.run(record.u, record.known)
            rows = np.empty((self.size + 1, len(record)))
            rows[: self._n_base] = turn.T @ tangents[: self._n_natural]
            rows[self._n_base : -1] = tangents[self._n_natural :]
            self._chain_effects(values, rows, self._n_base)
            rows[-1] = record.y - run.y
            if self.weights is not None:
                rows /= self.weights[number]
            yield rows, 0, self.measured(number)

    def _turn(self, theta: FloatArray) -> FloatArray:
        """Derivatives (natural, base) of the natural parameters: to the logarithms of limits, half width and
        gain each is in proportion or not at all, to all else by central differences."""
        steps = DIFFERENCE * np.eye(len(theta))[STATIC:]
        points = np.concatenate([theta[None], theta + steps, theta - steps])
        natural, *ends = self.given.natural(points, self.part, self.further)
        of_limits, of_gain = self._in_proportion
        columns = [np.where(own, natural, 0.0) for own in (*of_limits, of_gain)]
        columns += [
            (above - below) / (2 * DIFFERENCE)
            for above, below in zip(ends[: len(steps)], ends[len(steps) :], strict=True)
        ]
        return np.stack(columns, axis=1)

    @cached_property
    def _in_proportion(self) -> tuple[BoolArray, BoolArray]:
        """Natural parameters (natural,) that follow either limit and the half width, one row each, and those
        that follow the gain: residues and numerators."""
        structure = self.structure
        static, integrator = STATIC - 1, int(structure.integrator)
        real = np.tile([False, True], structure.real_poles)
        pairs = np.tile([False, False, True, True], structure.sections)
        of_gain = np.concatenate([np.zeros(static, bool), np.ones(integrator, bool), real, pairs])
        return np.eye(static, len(of_gain), dtype=bool), of_gain

    def free(self, values: JointValues) -> tuple[JointResponse, FloatArray]:
        """The same explanation with its sections free, and its coordinates."""
        response = JointResponse(
            self.structure, values.effects, self.records, self.scale, self.weights, self.steps
        )
        return response, response.coordinates(values)


@dataclass(frozen=True, eq=False)
class GivenFit(JointFit):
    """An explanation of the records by a given model with effects."""

    response: GivenResponse

    @property
    def free_count(self) -> int:
        """As of any fit, without the roots that a further mode loosens: those are held by their prior; and
        without what a held port saves. Beside a free G that is no merit: a torque that the loop holds back
        well enters by that way too, and G bends to what is left."""
        loosened = self.response.further * len(self.response.given.loose_sd)
        return super().free_count - loosened - len(self.misread) * numbers_saved(self.response)

    @property
    def score(self) -> float:
        """As of any fit, less what the records tell of the roots that a further mode loosens: the nats by
        which their posterior is narrower than their prior (Laplace)."""
        return super().score - self._loosened_nats

    @cached_property
    def _loosened_nats(self) -> float:
        if not self.response.further:
            return 0.0
        loose, end = self.response.given.loose_sd, self.response._n_base
        begin = end - len(loose)
        try:
            factor = self.factor()
        except FloatingPointError:
            return np.inf
        columns = [*range(begin), *range(end, self.response.size), *range(begin, end)]
        own = linalg.qr(factor[:-1, columns], mode="r", check_finite=False)[0].diagonal()[-len(loose) :]
        sigma = np.sqrt(self.point.variance_by(factor))
        return float(np.sum(np.log(np.maximum(np.abs(own) * loose / sigma, 1.0))))

    @property
    def added(self) -> tuple[str, ...]:
        """Labels of what is added to G itself and of the noise's cause."""
        delayed = self.response.part and self.delay > self.response.late
        return (DELAY,) * delayed + (MODE,) * self.response.further + super().added

    @property
    def of_a_given_model(self) -> bool:
        return True

    @property
    def dropped_then(self) -> str:
        return "the rest fitted again"

    def said_of_g(self) -> list[str]:
        return [
            "torques and speeds of the effects enter through the poles of the model's G, at weights of their "
            "own, so that no drive train is needed"
        ]

    def at(
        self, theta: FloatArray, part: bool, further: bool, extra_delay: int, effects: tuple[Effect, ...]
    ) -> GivenFit:
        """At other coordinates of G, not descended."""
        given = self.response.given
        structure = given.structure(part, further, extra_delay)
        steps = self.response.steps if any(e.acts_within_sample for e in effects) else 1
        response = replace(
            self.response, structure=structure, template=effects, part=part, further=further, steps=steps
        )
        values = JointValues(given.cascade(theta, part, further), effects)
        return GivenFit(response, evaluate(response, response.coordinates(values), self.point.whitener))

    def descended(self, steps: int = FULL_STEPS) -> GivenFit:
        """After at most `steps` steps, and as many again beyond each whole sample of delay that it ends
        at."""
        fit: GivenFit = super().descended(steps)
        while (further := fit._over_a_sample()) is not None:
            moved = super(GivenFit, further).descended(steps)
            if moved.score < fit.score + CONVERGED_NATS:
                break
            fit = moved
        return fit

    def _over_a_sample(self) -> GivenFit | None:
        """On the other side of the whole sample of delay that it stands at; None where it stands at none."""
        if not self.response.part:
            return None
        at = self.delay - self.extra_delay
        if at > 1 - AT_A_SAMPLE:
            return self.with_delay(self.extra_delay + 1, AT_A_SAMPLE)
        if at < AT_A_SAMPLE and self.extra_delay > 0:
            return self.with_delay(self.extra_delay - 1, 1 - AT_A_SAMPLE)
        return None

    @property
    def theta(self) -> FloatArray:
        return self.point.coordinates[: self.response._n_base]

    def with_limits_reached(self) -> Self:
        """The limits that no command reaches where commands just do, not descended; itself where all are
        reached."""
        return self.with_unreached(self.response.reach + np.log(WELL_WITHIN))

    def on_records_of(self, other: Self) -> Self:
        """As `JointFit` has it; limits that its own records do not reach are those of the other fit."""
        if other.response.records is self.response.records:
            return self
        return super(GivenFit, self.with_unreached(other.theta[:LIMITS])).on_records_of(other)

    def with_unreached(self, limits: FloatArray) -> Self:
        """The limits that no command reaches at these coordinates (lower, upper), not descended; itself where
        all are reached."""
        coordinates = self.point.coordinates.copy()
        beyond = coordinates[:LIMITS] > self.response.reach
        if not beyond.any():
            return self
        coordinates[:LIMITS] = np.where(beyond, limits, coordinates[:LIMITS])
        return replace(self, point=evaluate(self.response, coordinates))

    @property
    def extra_delay(self) -> int:
        return self.structure.delay_samples - self.response.given.delay_samples

    @property
    def delay(self) -> float:
        """Beyond the model's, in samples."""
        part = float(self.theta[self.response.given.size]) if self.response.part else 0.0
        return self.extra_delay + part

    def read_late(self) -> list[GivenFit]:
        """By half of what its readings may be late on the whole, a sample at most, not descended; none where
        they may not, or where it has a delay."""
        if self.response.part or not self.response.late > 0:
            return []
        return [self.with_delay(0, min(0.5 * self.response.late, 0.5))]

    def with_delay(self, whole: int, part: float) -> GivenFit:
        """With more delay than the model has, in samples."""
        r, n = self.response, self.response.given.size
        theta = np.concatenate([self.theta[:n], [part], self.theta[n + r.part :]])
        effects = self.values.effects
        if not r.part:
            effects = _with_ports(effects, _one_more_pole)
        return self.at(theta, True, r.further, whole, effects)

    def with_mode(self, hz: float, damping_ratio: float) -> GivenFit:
        """With one more mode that changes nothing yet."""
        mode = np.log([hz, damping_ratio, hz, damping_ratio])
        added = np.concatenate([mode, np.zeros(len(self.response.given.loose_sd))])
        effects = _with_ports(self.values.effects, _one_more_section)
        return self.at(
            np.concatenate([self.theta, added]), self.response.part, True, self.extra_delay, effects
        )

    def without(self, label: str) -> GivenFit:
        """One label fewer, not descended."""
        r, n, effects = self.response, self.response.given.size, self.values.effects
        if label in super().added:
            return self.with_cause(None)
        if label == DELAY:
            theta = np.delete(self.theta, n)
            return self.at(theta, False, r.further, 0, _with_ports(effects, _one_pole_fewer))
        if label == MODE:
            theta = self.theta[: n + r.part]
            return self.at(theta, r.part, False, self.extra_delay, _with_ports(effects, _one_section_fewer))
        kept = tuple(e for e in effects if e.form.label != label)
        return self.at(self.theta, r.part, r.further, self.extra_delay, kept)


def _with_ports(effects: tuple[Effect, ...], change: Callable[[Ports], Ports]) -> tuple[Effect, ...]:
    return tuple(e if e.ports is None else replace(e, ports=change(e.ports)) for e in effects)


def _one_more_pole(p: Ports) -> Ports:
    return replace(p, real=np.append(p.real, 0.0), signal_real=np.append(p.signal_real, 0.0))


def _one_pole_fewer(p: Ports) -> Ports:
    return replace(p, real=p.real[:-1], signal_real=p.signal_real[:-1])


def _one_more_section(p: Ports) -> Ports:
    none = np.zeros((2, 1))
    return replace(
        p,
        sections=np.concatenate([p.sections, none], axis=1),
        signal_sections=np.concatenate([p.signal_sections, none], axis=1),
    )


def _one_section_fewer(p: Ports) -> Ports:
    return replace(p, sections=p.sections[:, :-1], signal_sections=p.signal_sections[:, :-1])
