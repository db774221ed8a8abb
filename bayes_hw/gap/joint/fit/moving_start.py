"""Predictions of records held out that begin in motion, from the state that fits their first samples.

What the axis did before its record is stood for by a command of a few steps that comes before the first
sample: whatever holds a state (G, its delay, the memory of an effect) is then at a state that it can reach.
The steps, longer the farther back, are estimated from the beginning of the record by weighted least squares
with a prior of the size of the usual command; the whitened errors are weighed as Huber does (Robust
Statistics, 1981, sec. 7.7). The beginning is not scored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.unreached_limits import beyond_records
from bayes_hw.gap.joint.forms.effect_form import JointScale
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.response.packed_axis import PackedAxis
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.record import Record

LEAD_CONSTANTS, BEGINNING_CONSTANTS = 4.0, 3.0
"""Length of the command before a record, and of the beginning that it is estimated from, in the longest time
constants of G other than its integrator's."""

SHORTEST_LEAD, LONGEST_LEAD = 32, 4000
"""Samples, the delay not counted."""

SAMPLES_A_STEP = 4
"""Of the beginning, for every step that is estimated, at least."""

MOST_OF_A_RECORD = 0.25
"""Share of a record that its beginning may take."""

HUBER = 3.0
EVALUATIONS = 60
COST_TOLERANCE = 1e-4
"""Relative: a few hundredths of a nat."""

LARGEST = 1e6
BEYOND_LIMITS = 3.0
"""Of the largest command: a step before the record where no limit is known."""

ELSEWHERE_NATS = 10.0
"""What another place of the axis than the record's own angles say must earn."""

BEYOND_NOISE = 12.0
"""Deviations of the noise, beyond the dead zone, by which a beginning must have moved."""

FARTHEST = 200_000
"""Samples before a record, in which the axis comes there from where the records trained on begin."""

APART = 1e-3
"""Beginnings farther apart, in travels, are different places of the axis."""

DIFFERENCE = 1e-4
"""Step of a difference quotient."""


@dataclass(frozen=True)
class Place:
    """Where a record's zero lies, as the fitted model counts angles, with its sd, output units both."""

    level: float
    sd: float

    @classmethod
    def candidates(cls, record: Record, train: Sequence[Record], scale: JointScale) -> list[Place]:
        """Where the angles say, if those that `train` counts from are one; anywhere in the travel."""
        origins = np.array([one.origin for one in train])
        anywhere = cls(0.0, scale.travel)
        if np.ptp(origins) > APART * scale.travel:
            return [anywhere]
        known = max(scale.sigma, float(np.std(origins)), *(one.level_sd for one in train))
        return [cls(record.origin - float(np.mean(origins)), known), anywhere]


@dataclass(frozen=True, eq=False)
class MovingStart:
    """A record that begins in motion: `samples` of it are its beginning, the command before it has steps of
    `lengths` (steps,) samples within `lower` and `upper`, of the size `usual`.

    Estimated are the level of the record's zero, in deviations of its `place`, and the steps, in usual sizes.
    """

    record: Record
    samples: int
    lengths: tuple[int, ...]
    usual: float
    lower: float
    upper: float
    place: Place
    _found: dict[JointFit, OptimizeResult] = field(default_factory=dict)
    _sds: dict[JointFit, float] = field(default_factory=dict)

    @classmethod
    def of(cls, record: Record, fit: JointFit, train: Sequence[Record]) -> MovingStart:
        """At the place that explains the beginning best; another than that of the record's own angles must
        earn it."""
        found = [cls._at(place, record, fit) for place in Place.candidates(record, train, fit.response.scale)]
        best = found[0]
        for one in found[1:]:
            if one.nats(fit) > best.nats(fit) + ELSEWHERE_NATS:
                best = one
        return best

    @classmethod
    def _at(cls, place: Place, record: Record, fit: JointFit) -> MovingStart:
        """How long the beginning and what comes before it are, by the fitted G."""
        structure, cascade = fit.structure, fit.values.cascade
        usual = float(np.sqrt(np.mean(record.u**2))) or 1.0
        largest = BEYOND_LIMITS * max(float(np.abs(record.u).max()), usual)
        lower, upper = max(cascade.lower, -largest), min(cascade.upper, largest)
        usual = min(usual, max(-lower, upper))
        constant = min(time_constant(cascade), float(LONGEST_LEAD))
        delay = structure.delay_samples
        before = delay + float(np.clip(LEAD_CONSTANTS * constant, SHORTEST_LEAD, LONGEST_LEAD))
        if structure.integrator and cascade.integrator_residue != 0:
            way = abs(place.level) + (place.sd if place.level == 0 else 0.0)
            before += min(way / (abs(cascade.integrator_residue) * usual), float(FARTHEST))
        lengths = [1, 1]
        while sum(lengths) < before:
            lengths.append(2 * lengths[-1])
        shown = 2 * cascade.half_width + BEYOND_NOISE * fit.response.scale.sigma
        off = np.abs(record.y - np.median(record.y[:3])) > shown
        first = int(np.argmax(off)) if off.any() else 0
        samples = max(first + delay + round(BEGINNING_CONSTANTS * constant), SAMPLES_A_STEP * len(lengths))
        samples = min(samples, int(MOST_OF_A_RECORD * len(record)))
        return cls(record, samples, tuple(lengths[::-1]), usual, lower, upper, place)

    def predict(
        self, fit: JointFit, values: JointValues | None = None, rng: np.random.Generator | None = None
    ) -> FloatArray:
        """Angles (samples,) of the whole record, at the `values` of a draw where given; with `rng` the state
        is drawn too: fitted to a beginning and from a prior that are off by their own deviations (randomize,
        then optimize; doi 10.1137/140964023), within what the drive lets through."""
        best = self._best(fit)
        if values is None:
            at = fit.response.packed(beyond_records(fit, fit.values, self.record.u))
            return self._simulated(at, best.x)
        values = beyond_records(fit, values, self.record.u, rng)
        count = self.samples + len(best.x)
        moved = np.zeros(count) if rng is None else rng.standard_normal(count)
        found = self._descended(fit, values, best.x, moved)
        return self._simulated(fit.response.packed(values), found.x)

    def nats(self, fit: JointFit) -> float:
        """By how much the state explains the beginning better than rest at a level of its own does, less half
        of Schwarz's price of it."""
        count, known = self.samples, {n: c[: self.samples] for n, c in self.record.known.items()}
        at_rest = fit.response.simulate(fit.values, self.record.u[:count], known).y
        own, level = self._whitening(fit, np.array([self.record.y[:count] - at_rest, np.ones(count)]))

        def errors(x: FloatArray) -> FloatArray:
            return own - x[0] * level

        rest = least_squares(errors, [0.0], loss="huber", f_scale=HUBER)
        price = 0.5 * len(self.lengths) * float(np.log(count))
        return float(rest.cost - self._best(fit).cost) - price

    @property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        far, count = 20.0, len(self.lengths)
        return (
            np.append(-far, np.full(count, self.lower / self.usual)),
            np.append(far, np.full(count, self.upper / self.usual)),
        )

    def _best(self, fit: JointFit) -> OptimizeResult:
        if fit not in self._found:
            tried = [self._descended(fit, fit.values, start) for start in self._guesses(fit)]
            self._found[fit] = min(tried, key=lambda one: float(one.cost))
        return self._found[fit]

    def _guesses(self, fit: JointFit) -> list[FloatArray]:
        """Standing there; and come there under the first command, either way."""
        found = []
        residue, lengths = fit.values.cascade.integrator_residue, np.array(self.lengths)
        for steady in (0.0, 1.0, -1.0):
            steps = np.full(len(lengths), steady * self.record.u[0])
            if residue != 0:
                way = self.place.level / residue - float(lengths[1:] @ steps[1:])
                steps[0] = way / lengths[0]
            found.append(np.append(0.0, steps / self.usual))
        return found

    def _descended(
        self, fit: JointFit, values: JointValues, start: FloatArray, moved: FloatArray | float = 0.0
    ) -> OptimizeResult:
        """The state at `values`, errors and prior `moved` by (samples + size,) deviations."""

        def all_errors(points: FloatArray) -> FloatArray:
            shown = [self._simulated(packed, x, self.samples) for x in points]
            own = self._whitening(fit, self.record.y[: self.samples] - np.array(shown))
            return np.concatenate([own, points], axis=1) + moved

        def errors(x: FloatArray) -> FloatArray:
            return all_errors(x[None, :])[0]

        def slopes(x: FloatArray) -> FloatArray:
            found = all_errors(np.concatenate([x[None, :], x + steps]))
            return np.ascontiguousarray(((found[1:] - found[0]) / DIFFERENCE).T)

        packed, steps = fit.response.packed(values), DIFFERENCE * np.eye(len(start))
        low, high = self._bounds
        inside = 1e-6 * (high - low)
        return least_squares(
            errors,
            np.clip(start, low + inside, high - inside),
            slopes,
            bounds=(low, high),
            x_scale="jac",
            loss="huber",
            f_scale=HUBER,
            ftol=COST_TOLERANCE,
            max_nfev=EVALUATIONS,
        )

    def _whitening(self, fit: JointFit, errors: FloatArray) -> FloatArray:
        """Innovations of errors (n, samples), in their standard deviations."""
        measured = self.record.measured
        mask = None if measured is None or measured[: self.samples].all() else measured[: self.samples]
        found = fit.point.whitener.apply(np.nan_to_num(errors), 0, mask) / self._innovation(fit)
        return np.clip(np.nan_to_num(found, nan=LARGEST), -LARGEST, LARGEST)

    def _innovation(self, fit: JointFit) -> float:
        if fit not in self._sds:
            self._sds[fit] = innovation(fit)
        return self._sds[fit]

    def _simulated(self, axis: PackedAxis, x: FloatArray, stop: int | None = None) -> FloatArray:
        """Angles (samples,) of the record up to `stop`."""
        before = np.repeat(self.usual * x[1:], self.lengths)
        u = np.concatenate([before, self.record.u[:stop]])
        run, _ = axis.run(u, self._known(stop))
        return run.y[len(before) :] - (self.place.level + self.place.sd * x[0])

    def _known(self, stop: int | None) -> Mapping[str, FloatArray]:
        """Known inputs, before the record as at its first sample."""
        count = sum(self.lengths)
        return {
            name: np.concatenate([np.full(count, column[0]), column[:stop]])
            for name, column in self.record.known.items()
        }


def innovation(fit: JointFit) -> float:
    """Standard deviation of an innovation of the fit, output units where readings are not weighted."""
    squares = fit.point.whitener.sum_of_squares(fit.point.residuals, fit.response.masks)
    return float(np.sqrt(squares / fit.point.samples))


def time_constant(cascade: CascadeValues) -> float:
    """The longest of G's poles, in samples, its integrator left out."""
    sizes = [np.abs(cascade.real[0])]
    for a1, a2 in cascade.sections[:2].T:
        sizes.append(np.abs(np.roots([1.0, -a1, a2])))
    longest = float(np.max(np.concatenate(sizes), initial=0.0))
    return -1 / np.log(np.clip(longest, 1e-6, 1 - 1e-9))
